// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/fit_files.h"

#include "host-tools/coefficients/build.h"
#include "host-tools/fitting/fit.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

namespace compbox::coefficients {

namespace {

// out: the value with the name `text`; throws input_error for an unknown name
template <typename kind>
kind named(const std::string &text, std::initializer_list<kind> all, const std::string &file) {
    for (const kind one : all) {
        if (text == name_of(one)) return one;
    }
    std::string there;
    for (const kind one : all) there += std::string(there.empty() ? "" : ", ") + name_of(one);
    throw input_error(file, 0, 0, "there is no method or line '{}' (there are {})", text, there);
}

// in : a curve's name, as EZX: its signal is what follows the second letter
// out: the recipe's options for it. Throws input_error that names the recipe's file.
fit_options options_of(const fit_recipe &recipe, const std::string &curve) {
    fit_options options;
    options.name = curve;
    options.signal = curve.substr(2);
    options.method = named(recipe.method,
                           {fit_method::bspline, fit_method::bspline_lmc, fit_method::polynomial,
                            fit_method::polyline},
                           recipe.file);
    options.line =
        named(recipe.line,
              {reference_line::keep, reference_line::end_point, reference_line::least_squares},
              recipe.file);
    options.degree = recipe.degree;
    const auto tolerance = recipe.tolerance_um.find(curve);
    if (tolerance != recipe.tolerance_um.end()) options.tolerance_um = tolerance->second;
    return options;
}

}  // namespace

fitted_files fit_files(const std::string &measurements, const std::vector<std::string> &curves,
                       const fit_recipe &recipe, const std::string &machine,
                       const std::string &folder) {
    make_folder(folder);
    fitted_files result;
    std::vector<std::string> terms;
    for (const auto &curve : curves) {
        const std::string data = fmt::format("{}/{}.csv", measurements, curve);
        const fit_result fit = fit_curve(read_measurement(data), options_of(recipe, curve));
        terms.push_back(fmt::format("{}/{}.json", folder, curve));
        write_file(terms.back(), json_text(fragment_of(fit)));
        result.coefficient_count[curve] = static_cast<int>(fit.curve.coefficient_count());
        for (const auto &warning : fit.warnings) result.warnings.push_back(data + ": " + warning);
    }
    result.coefficients = folder + "/coefficients.json";
    build_file({machine, terms, {}, result.coefficients, "", true});
    return result;
}

}  // namespace compbox::coefficients
