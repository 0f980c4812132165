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
        if (text == fitting::name_of(one)) return one;
    }
    std::string there;
    for (const kind one : all)
        there += std::string(there.empty() ? "" : ", ") + fitting::name_of(one);
    throw input_error(file, 0, 0, "there is no method or line '{}' (there are {})", text, there);
}

// in : a curve's name, as EZX: its signal is what follows the second letter
// out: the recipe's options for it. Throws input_error that names the recipe's file.
fitting::fit_options options_of(const fit_recipe &recipe, const std::string &curve) {
    fitting::fit_options options;
    options.name = curve;
    options.signal = curve.substr(2);
    options.method = named(recipe.method,
                           {fitting::fit_method::bspline, fitting::fit_method::bspline_lmc,
                            fitting::fit_method::polynomial, fitting::fit_method::polyline},
                           recipe.file);
    options.line = named(recipe.line,
                         {fitting::reference_line::keep, fitting::reference_line::end_point,
                          fitting::reference_line::least_squares},
                         recipe.file);
    options.degree = recipe.degree;
    const auto tolerance = recipe.tolerance_um.find(curve);
    if (tolerance != recipe.tolerance_um.end()) options.tolerance_um = tolerance->second;
    return options;
}

drawn_curve drawn(const fitting::fit_result &fit) {
    constexpr int points = 400;
    drawn_curve curve;
    curve.position_mm = fit.data.position;
    curve.mean_um = fit.data.mean;
    for (int i = 0; i <= points; ++i) {
        curve.at_mm.push_back(fit.data.from() + (fit.data.to() - fit.data.from()) * i / points);
        curve.curve_um.push_back(fit.curve.value(curve.at_mm.back()));
    }
    for (const fitting::key_step &step : fit.key_steps) {
        curve.key_points.push_back(static_cast<double>(step.key_points));
        curve.largest_residual_um.push_back(step.largest_residual);
    }
    return curve;
}

}  // namespace

fitted_files fit_files(const std::string &measurements, const std::vector<std::string> &curves,
                       const fit_recipe &recipe, const std::string &machine,
                       const std::string &folder) {
    formats::make_folder(folder);
    fitted_files result;
    std::vector<std::string> terms;
    for (const auto &curve : curves) {
        const std::string data = fmt::format("{}/{}.csv", measurements, curve);
        const fitting::fit_result fit =
            fitting::fit_curve(fitting::read_measurement(data), options_of(recipe, curve));
        terms.push_back(fmt::format("{}/{}.json", folder, curve));
        formats::write_file(terms.back(), formats::json_text(fitting::fragment_of(fit)));
        result.coefficient_count[curve] = static_cast<int>(fit.curve.coefficient_count());
        result.curves[curve] = drawn(fit);
        for (const auto &warning : fit.warnings) result.warnings.push_back(data + ": " + warning);
    }
    result.coefficients = folder + "/coefficients.json";
    build_file({machine, terms, {}, result.coefficients, "", true});
    return result;
}

}  // namespace compbox::coefficients
