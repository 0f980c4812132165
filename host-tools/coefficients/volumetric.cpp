// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/volumetric.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "host-tools/coefficients/volumetric_curve.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/numbers.h"
#include "host-tools/metrology/straightness.h"

namespace compbox::coefficients {

namespace {

namespace fs = std::filesystem;

// Directions of the straightness curves whose slope is that squareness.
constexpr const char *squareness_slopes[3] = {"EXY", "EXZ", "EYZ"};
constexpr double slope_that_counts_urad = 0.5;

struct curve_file {
    std::string name, path;
};

// The curves of all folders in the order of ISO 230-1, each once.
std::vector<curve_file> find_curves(const std::vector<std::string> &folders) {
    std::map<std::string, std::string> home;
    for (const auto &folder : folders) {
        if (!fs::is_directory(folder)) throw input_error(folder, 0, 0, "is not a folder");
        std::size_t found = 0;
        for (const char axis : {'X', 'Y', 'Z'}) {
            for (const char kind : std::string("XYZABC")) {
                const std::string name = fmt::format("E{}{}", kind, axis);
                const std::string path = (fs::path(folder) / (name + ".csv")).string();
                if (!fs::is_regular_file(path)) continue;
                ++found;
                const auto [place, is_new] = home.insert({name, path});
                if (!is_new) {
                    throw input_error(path, 0, 0,
                                      "{} is already in {}: name only one of the two folders", name,
                                      place->second);
                }
            }
        }
        if (found == 0) {
            throw input_error(folder, 0, 0,
                              "holds none of EXX.csv … ECZ.csv, which `compbox identify` writes");
        }
    }
    std::vector<curve_file> curves;
    for (const char *axis : axis_names) {
        for (const char kind : std::string("XYZABC")) {
            const auto one = home.find(fmt::format("E{}{}", kind, axis));
            if (one != home.end()) curves.push_back({one->first, one->second});
        }
    }
    return curves;
}

void check_unit(const std::string &name, const fitting::measurement &data) {
    const bool angle = name[1] <= 'C';
    if (angle == (data.unit == "urad")) return;
    throw input_error(data.file, 0, 0,
                      name + (angle ? " is an angle: its column must be error_urad"
                                    : " is a displacement: its column must be error_um"));
}

// The reference point that `identify` noted in DIR/report.json, for the axis it names.
void take_reference_point(const std::string &folder, volumetric_result &result) {
    const std::string path = (fs::path(folder) / "report.json").string();
    if (!fs::is_regular_file(path)) return;
    const json report = formats::read_json(path);
    if (!report.is_object() || !report.contains("reference_point_mm")) return;
    const std::string axis = formats::get<std::string>(report, "axis", path);
    const auto point = formats::get<std::vector<double>>(report, "reference_point_mm", path);
    if (point.size() != 3 || result.reference_points_mm.count(axis) == 0) {
        throw input_error(path, 0, 0, "axis must be X, Y or Z, reference_point_mm three numbers");
    }
    result.reference_points_mm[axis] = {point[0], point[1], point[2]};
}

volumetric_curve read_curve(const curve_file &file, const volumetric_options &options) {
    volumetric_curve one = {file.name, fitting::read_measurement(file.path), {}};
    check_unit(one.name, one.data);
    one.fit(options);
    return one;
}

// The linear roll that diagonals showed has a standard deviation of its own.
void add_sigma_of_rise(const volumetric_curve &is, const volumetric_result &result, json &found) {
    if (!result.diagonals || result.diagonals->found.count(is.name) == 0) return;
    if (!found.contains("sigma")) return;
    json &values = found["sigma"]["values"];
    const double from = is.data.from(),
                 step_mm = (is.data.to() - from) / (double(values.size()) - 1);
    for (std::size_t k = 0; k < values.size(); ++k) {
        const double rise = is.rise_at(from + step_mm * static_cast<double>(k));
        const double sigma = result.diagonals->found.at(is.name).sigma * rise;
        values[k] = formats::five_digits(std::hypot(values[k].get<double>(), sigma));
    }
}

// Adds term and provenance of a curve to result.fragment.
// out: its figures in the file's unit
fitted_error add_curve(const volumetric_curve &is, volumetric_result &result) {
    const fitting::measurement &data = is.data;
    const fitting::fit_result &fitted = is.fitted;
    json fragment = fitting::fragment_of(fitted);
    add_sigma_of_rise(is, result, fragment["provenance"][is.name]);
    result.fragment["terms"].push_back(fragment["terms"][0]);
    result.fragment["provenance"][is.name] = fragment["provenance"][is.name];
    fitted_error one;
    one.name = is.name;
    one.file = data.file;
    one.unit = data.unit;
    one.positions = data.position.size();
    one.coefficients = fitted.curve.coefficient_count();
    const auto [low, high] = std::minmax_element(data.mean.begin(), data.mean.end());
    one.range = *high - *low;
    one.residual_rms = fitted.summary.rms;
    one.slope_per_m = 1e3 * metrology::least_squares_line(data.position, data.mean).slope;
    one.warnings = fitted.warnings;
    return one;
}

json numbers(const vector_mm &v) {
    return json::array({v[0], v[1], v[2]});
}

// in : options in mm, result with reference points, squareness and errors. out: the term
// volumetric.
json term_of(const volumetric_options &options, const volumetric_result &result) {
    json term;
    term["name"] = options.name;
    term["type"] = "volumetric";
    for (const char *end : {"_x", "_y", "_z"}) term["outputs"].push_back(options.name + end);
    term["chain"] = options.chain;
    term["errors"] = json::array();
    for (const auto &error : result.errors) term["errors"].push_back(error.name);
    term["positions"] = options.positions;
    for (const auto &[axis, point] : result.reference_points_mm) {
        term["reference_points_mm"][axis] = numbers(point);
    }
    term["tool_offset_mm"] = numbers(options.tool_offset_mm);
    term["tool_direction"] = numbers(options.tool_direction);
    if (!options.tool_length_signal.empty()) {
        term["tool_length"] = options.tool_length_signal;
    } else {
        term["tool_length_mm"] = options.tool_length_mm;
    }
    for (const char *name : squareness_names) {
        term["squareness_urad"][name] = result.squareness_urad.at(name);
    }
    return term;
}

// Adds a remark for a squareness option together with a straightness curve that has a slope, which
// counts twice.
void judge_squareness(const volumetric_options &options, volumetric_result &result) {
    std::string absent;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::string name = squareness_names[k];
        const bool by_diagonals = result.diagonals && result.diagonals->found.count(name) > 0;
        if (by_diagonals) {
            result.squareness_urad[name] = result.diagonals->found.at(name).value;
            continue;
        }
        const bool given = options.squareness_urad.count(name) > 0;
        result.squareness_urad[name] = given ? options.squareness_urad.at(name) : 0.0;
        double slope_urad = 0.0;
        for (const auto &error : result.errors) {
            if (error.name == squareness_slopes[k]) slope_urad = error.slope_per_m;
        }
        const bool slope = std::fabs(slope_urad) > slope_that_counts_urad;
        if (!given && !slope) absent += (absent.empty() ? "" : ", ") + name;
        if (given && slope) {
            result.remarks.push_back(
                fmt::format("{} is given, but the curve {} keeps a slope of {:.1f} urad, which is "
                            "squareness too: both count",
                            name, squareness_slopes[k], slope_urad));
        }
    }
    if (!absent.empty()) {
        result.remarks.push_back(fmt::format("squareness {} not given: zero", absent));
    }
}

void judge_missing(volumetric_result &result) {
    std::string text;
    for (const char *axis : axis_names) {
        for (const char kind : std::string("XYZABC")) {
            const std::string name = fmt::format("E{}{}", kind, axis);
            bool found = false;
            for (const auto &error : result.errors) found |= error.name == name;
            if (found) continue;
            result.missing.push_back(name);
            text += (text.empty() ? "" : ", ") + name;
        }
    }
    if (!text.empty()) result.remarks.push_back("not measured, zero: " + text);
}

json provenance_of(const volumetric_options &options, const volumetric_result &result) {
    json own;
    own["squareness_convention"] =
        "urad; C0Y > 0 opens the angle between +X and +Y, A0Z > 0 that between +Y and +Z, "
        "B0Z > 0 closes that between +X and +Z; X is the primary axis";
    own["not_measured"] = result.missing;
    own["remarks"] = result.remarks;
    for (const auto &[name, sigma] : options.squareness_sigma_urad) {
        own["squareness_sigma_urad"][name] = sigma;
    }
    if (!result.diagonals) return own;
    for (const auto &[name, size] : result.diagonals->found) {
        if (name[0] != 'E') own["squareness_sigma_urad"][name] = size.sigma;
    }
    return own;
}

}  // namespace

void volumetric_curve::fit(const volumetric_options &options) {
    fitting::fit_options how = options.fit;
    how.name = name;
    how.signal = options.positions[axis()];
    fitted = fitting::fit_curve(data, how);
}

volumetric_result make_volumetric(const std::vector<std::string> &folders,
                                  const volumetric_options &options) {
    volumetric_result result;
    result.fragment["signals"] = json::array();
    result.fragment["terms"] = json::array();
    for (const char *axis : axis_names) result.reference_points_mm[axis] = {0, 0, 0};
    std::vector<volumetric_curve> curves;
    for (const auto &file : find_curves(folders)) curves.push_back(read_curve(file, options));
    for (const auto &folder : folders) take_reference_point(folder, result);
    for (const auto &[axis, point] : options.reference_points_mm) {
        result.reference_points_mm[axis] = point;
    }
    if (!options.diagonals.empty()) adjust_to_diagonals(options, curves, result);
    for (const auto &one : curves) result.errors.push_back(add_curve(one, result));
    judge_missing(result);
    judge_squareness(options, result);
    result.fragment["terms"].push_back(term_of(options, result));
    result.fragment["provenance"][options.name] = provenance_of(options, result);
    return result;
}

}  // namespace compbox::coefficients
