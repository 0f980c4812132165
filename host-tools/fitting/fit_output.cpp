// SPDX-License-Identifier: MIT
// Output of a fit: the fragment for `build`, and the report for a person.
#include <algorithm>
#include <cmath>

#include "host-tools/fitting/fit.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/json.h"
#include "host-tools/formats/numbers.h"

namespace compbox::fitting {

namespace {

json numbers(const std::vector<double> &values) {
    json list = json::array();
    for (const double value : values) list.push_back(formats::short_float(value));
    return list;
}

// Adds the curve's own keys.
void add_curve(json &term, const fitted_curve &curve) {
    switch (curve.method) {
        case fit_method::bspline:
        case fit_method::bspline_lmc:
            term["degree"] = curve.bspline.degree;
            term["knots"] = numbers(curve.bspline.knots);
            term["control_points"] = numbers(curve.bspline.control_points);
            break;
        case fit_method::polynomial:
            term["coefficients"] = numbers(curve.polynomial.coefficients);
            term["center"] = formats::short_float(curve.polynomial.centre);
            term["half_range"] = formats::short_float(curve.polynomial.half_range);
            term["from"] = formats::short_float(curve.polynomial.from);
            term["to"] = formats::short_float(curve.polynomial.to);
            break;
        case fit_method::polyline:
            term["positions"] =
                numbers({curve.bspline.knots.begin() + 1, curve.bspline.knots.end() - 1});
            term["values"] = numbers(curve.bspline.control_points);
            break;
    }
}

json term_of(const fit_result &result) {
    const bool lmc = result.curve.method == fit_method::bspline_lmc;
    json term;
    term["name"] = result.options.name;
    term["type"] = lmc ? "bspline" : name_of(result.curve.method);
    term["signal"] = result.options.signal;
    add_curve(term, result.curve);
    for (const auto &backward : result.backward) {
        add_curve(term["backward"], backward.curve);
        term["reversal_mm"] = formats::short_float(result.options.reversal_mm);
    }
    return term;
}

// The file's name without its folder, because a coefficient file must not contain paths of one
// computer.
std::string file_name(const std::string &path) {
    return path.substr(path.find_last_of('/') + 1);
}

json residuals_of(const residual_summary &sum) {
    return json{{"range", formats::five_digits(sum.range)},
                {"lowest", formats::five_digits(sum.lowest)},
                {"highest", formats::five_digits(sum.highest)},
                {"mean", formats::five_digits(sum.mean)},
                {"variance", formats::five_digits(sum.variance)},
                {"rms", formats::five_digits(sum.rms)},
                {"worst", formats::five_digits(sum.worst)},
                {"worst_at_mm", formats::five_digits(sum.worst_at_mm)}};
}

std::size_t largest_run_count(const measurement &data) {
    int most = 0;
    for (const int count : data.readings) most = std::max(most, count);
    return static_cast<std::size_t>(most);
}

// The source of the noise figure.
std::string noise_source(const measurement &data) {
    if (data.repeat_freedom > 0 && data.repeat_freedom == data.cells.freedom) {
        return "readings within cells, and residuals";
    }
    if (data.repeat_freedom > 0 && data.sigma_given) return "repeats, sigma column and residuals";
    if (data.repeat_freedom > 0) return "repeats and residuals";
    return data.sigma_given ? "sigma column and residuals"
                            : "residuals, and what instruments usually have";
}

json distance_of(const fit_result &result) {
    const curve_distance distance = estimate_distance(result);
    return json{{"rms", formats::five_digits(distance.rms)},
                {"largest", formats::five_digits(distance.largest)},
                {"largest_at_mm", formats::five_digits(distance.largest_at_mm)}};
}

// out: what the instrument recorded: pairs are start and end
json environment_of(const formats::laser_environment &environment) {
    const auto pair = [](const formats::start_and_end &values) {
        return json::array({formats::five_digits(values.start), formats::five_digits(values.end)});
    };
    json found;
    if (environment.air_degC) found["air_degC"] = pair(*environment.air_degC);
    if (environment.air_kPa) found["air_kPa"] = pair(*environment.air_kPa);
    if (environment.humidity_percent) {
        found["humidity_percent"] = pair(*environment.humidity_percent);
    }
    for (const auto &material : environment.material_degC) {
        found["material_degC"].push_back(pair(material));
    }
    if (environment.expansion_um_per_m_K) {
        found["expansion_um_per_m_K"] = formats::five_digits(*environment.expansion_um_per_m_K);
    }
    if (!environment.times.empty()) found["times"] = environment.times;
    found["material_compensated"] = environment.material_compensated();
    return found;
}

// out: standard deviation of the curve's error at equidistant places, of its worse branch
json sigma_of(const fit_result &result) {
    constexpr std::size_t places = 17;
    const auto at = [](const fit_result &branch, double x) {
        const std::vector<double> &known = branch.best.x;
        const auto next = std::lower_bound(known.begin() + 1, known.end() - 1, x);
        const auto high = static_cast<std::size_t>(next - known.begin());
        const double part = (x - known[high - 1]) / (known[high] - known[high - 1]);
        return (1.0 - part) * band_sigma(branch, high - 1) + part * band_sigma(branch, high);
    };
    const double from = result.data.from(), to = result.data.to();
    json values = json::array();
    for (std::size_t k = 0; k < places; ++k) {
        const double x = from + (to - from) * static_cast<double>(k) / (places - 1);
        double sigma = at(result, x);
        for (const fit_result &backward : result.backward) {
            sigma = std::max(sigma, at(backward, x));
        }
        values.push_back(formats::five_digits(sigma));
    }
    return {{"from_mm", formats::short_float(from)},
            {"to_mm", formats::short_float(to)},
            {"values", values}};
}

// Appends what was read: positions, runs, and what was averaged.
void add_readings(json &found, const fit_result &result) {
    const measurement &data = result.data;
    found["positions"] = data.position.size();
    found["runs"] = data.runs.size();
    if (data.cells.readings > 0) {
        found["averaged_in_cells"] = {
            {"readings", data.cells.readings},
            {"cell_mm", formats::five_digits(data.cells.width_mm)},
            {"largest_change_of_curve", formats::five_digits(result.cell_loss)}};
    }
    found["readings_per_position"] = largest_run_count(data);
    if (data.runs_aligned) found["run_offsets_and_slopes_evened_out"] = true;
    if (data.bidirectional) {
        found["branches"] = result.backward.empty() ? "averaged" : "forward and backward";
        found["mean_lost_motion"] = formats::five_digits(data.mean_lost_motion);
    }
}

// Appends the curve, its noise and its residuals.
void add_curve(json &found, const fit_result &result) {
    const measurement &data = result.data;
    if (result.options.tolerance_um > 0.0) {
        found["tolerance"] = formats::five_digits(result.options.tolerance_um);
        found["converged"] = result.converged;
    }
    if (result.key_points > 0) found["key_points"] = result.key_points;
    for (const key_step &step : result.key_steps) {
        found["residual_by_key_points"].push_back(
            {step.key_points, formats::five_digits(step.largest_residual)});
    }
    found["coefficients"] = result.curve.coefficient_count();
    found[data.sigma_given ? "noise_per_sigma" : "noise"] = formats::five_digits(result.noise);
    found["noise_from"] = noise_source(data);
    found["noise_degrees_of_freedom_of_repeats"] = data.repeat_freedom;
    if (result.best.x.size() > 1) found["sigma"] = sigma_of(result);
    if (result.best.correlated()) {
        found["noise_correlation_of_neighbours"] =
            formats::five_digits(result.best.noise_correlation);
        found["band_by_that_of_white_noise"] = formats::five_digits(result.best.widened);
    }
    found["left_out_rms"] = formats::five_digits(result.best.left_out_rms);
    found["residuals"] = residuals_of(result.summary);
    if (result.best.x.size() > 1) found["from_best_estimate"] = distance_of(result);
}

// out: the member "provenance" of the fragment; numbers with five digits, in the unit of the data
json findings_of(const fit_result &result) {
    const measurement &data = result.data;
    json found;
    found["data"] = file_name(data.file);
    found["method"] = name_of(result.options.method);
    found["unit"] = data.unit;
    if (data.environment) found["environment"] = environment_of(*data.environment);
    found["line"] = name_of(result.options.line);
    if (result.options.line != reference_line::keep) {
        found["line_offset"] = formats::five_digits(result.line_offset);
        found["line_slope_per_mm"] = formats::five_digits(result.line_slope);
    }
    if (result.options.zero_at_mm) {
        found["zero_at_mm"] = formats::five_digits(*result.options.zero_at_mm);
        found["zero_offset"] = formats::five_digits(result.zero_offset);
    }
    add_readings(found, result);
    add_curve(found, result);
    for (const auto &backward : result.backward) {
        json branch;
        if (result.options.tolerance_um > 0.0) branch["converged"] = backward.converged;
        branch["coefficients"] = backward.curve.coefficient_count();
        branch["residuals"] = residuals_of(backward.summary);
        if (backward.best.x.size() > 1) branch["from_best_estimate"] = distance_of(backward);
        found["backward"] = branch;
    }
    if (!result.warnings.empty()) found["warnings"] = result.warnings;
    return found;
}

// One line of the report, its label padded to a column.
std::string line(std::string label, const std::string &value) {
    label.resize(std::max<std::size_t>(label.size(), 24), ' ');
    return "  " + label + " " + value + "\n";
}

// The inner knots, eight on a line.
std::string list_of_knots(const fitted_curve &curve) {
    if (curve.method == fit_method::polynomial) return "none (one polynomial)";
    const auto inner = inner_knots(curve.bspline);
    std::string text;
    for (std::size_t i = 0; i < inner.size(); ++i) {
        if (i > 0) text += i % 8 ? ", " : ",\n" + std::string(27, ' ');
        text += fmt::format("{:.6g}", inner[i]);
    }
    return inner.empty() ? "none" : text + " mm";
}

// The measured data and the subtracted line.
std::string data_lines(const fit_result &result, const std::string &unit) {
    const measurement &data = result.data;
    const std::size_t runs =
        data.runs.size() + (result.backward.empty() ? 0 : result.backward.front().data.runs.size());
    std::string text = line("positions, runs", fmt::format("{}, {}", data.position.size(), runs));
    if (data.cells.readings > 0) {
        text +=
            line("", fmt::format("{} readings, averaged in cells of {:.4g} mm (changes the curve "
                                 "by {:.1g} {} at most)",
                                 data.cells.readings, data.cells.width_mm, result.cell_loss, unit));
    }
    if (data.runs_aligned) text += line("", "each run's own offset and slope were evened out");
    if (result.options.line != reference_line::keep) {
        text += line("line taken off", fmt::format("{}, {:.3f} {}", name_of(result.options.line),
                                                   1000.0 * result.line_slope, unit + "/m"));
    }
    if (result.options.zero_at_mm) {
        text += line("zero at", fmt::format("{} mm ({:.3f} {} taken off)",
                                            *result.options.zero_at_mm, result.zero_offset, unit));
    }
    if (data.bidirectional) {
        text +=
            line("mean lost motion", fmt::format("{:.3f} {}", data.mean_lost_motion, unit) +
                                         (result.backward.empty() ? " (directions averaged)" : ""));
    }
    const std::string environment =
        data.environment ? formats::environment_text(*data.environment) : "";
    if (!environment.empty()) text += line("environment", environment);
    const std::string noise =
        fmt::format("{:.3f} {}", result.noise, data.sigma_given ? "of its sigma" : unit);
    text += line(data.cells.readings > 0 ? "noise of a cell's mean" : "noise of one reading",
                 fmt::format("{} ({})", noise, noise_source(data)));
    if (!result.best.correlated()) return text;
    return text +
           line("", fmt::format("correlation {:.2f} between neighbours of a run: band {:.1f} "
                                "times as wide",
                                result.best.noise_correlation, result.best.widened));
}

// out: the written curve, its residuals and its distance from the best estimate
std::string curve_lines(const fit_result &result, const std::string &unit) {
    const residual_summary &sum = result.summary;
    std::string text = line("coefficients", std::to_string(result.curve.coefficient_count()));
    if (result.key_points > 0) text += line("key points", std::to_string(result.key_points));
    text += line("residual range", fmt::format("{:.3f} {}", sum.range, unit));
    text += line("residual mean, variance",
                 fmt::format("{:.3f} {}, {:.3f} {}", sum.mean, unit, sum.variance, unit + "²"));
    text += line("worst point",
                 fmt::format("{:.3f} {} at {:.10g} mm", sum.worst, unit, sum.worst_at_mm));
    if (result.best.x.size() > 1) {
        const curve_distance distance = estimate_distance(result);
        text += line("from best estimate",
                     fmt::format("rms {:.3f} {}, largest {:.3f} {} at {:.10g} mm", distance.rms,
                                 unit, distance.largest, unit, distance.largest_at_mm));
    }
    text += line("left-out rms", fmt::format("{:.3f} {}", result.best.left_out_rms, unit));
    return text + line("inner knots", list_of_knots(result.curve));
}

}  // namespace

json fragment_of(const fit_result &result) {
    json fragment;
    fragment["signals"] = json::array();
    fragment["terms"] = json::array({term_of(result)});
    fragment["provenance"] = json{{result.options.name, findings_of(result)}};
    return fragment;
}

std::string band_of(const fit_result &result) {
    const std::string unit = result.data.unit;
    std::vector<std::string> names = {"position_mm", "curve_" + unit, "sigma_" + unit};
    for (std::size_t k = 0; k < result.backward.size(); ++k) {
        names.push_back("backward_" + unit);
        names.push_back("backward_sigma_" + unit);
    }
    std::vector<std::vector<double>> rows;
    for (std::size_t i = 0; i < result.best.x.size(); ++i) {
        const double x = result.best.x[i];
        rows.push_back({x, result.curve.value(x), band_sigma(result, i)});
        for (const auto &backward : result.backward) {
            rows.back().push_back(backward.curve.value(x));
            rows.back().push_back(band_sigma(backward, i));
        }
    }
    return formats::csv_text(names, rows);
}

std::string report_of(const fit_result &result) {
    const std::string unit = result.data.unit == "urad" ? "µrad" : "µm";
    std::string text =
        fmt::format("{}({}) from {} by {}\n", result.options.name, result.options.signal,
                    result.data.file, name_of(result.options.method));
    text += data_lines(result, unit);
    text += curve_lines(result, unit);
    for (const auto &backward : result.backward) {
        text += line("backward branch",
                     fmt::format("reversal over {} mm", result.options.reversal_mm)) +
                curve_lines(backward, unit);
    }
    for (const auto &warning : result.warnings) text += fmt::format("  note: {}\n", warning);
    return text;
}

}  // namespace compbox::fitting
