// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/sigma.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "host-tools/coefficients/evaluate.h"
#include "host-tools/coefficients/load.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::coefficients {

namespace {

// What may be wrong by a stated standard deviation: a curve, a squareness, an output of a bank.
struct cause {
    std::size_t term;
    json raised;                // the term with this larger by 1
    std::string signal;         // of a curve; "": sigma is the same everywhere
    double from = 0, to = 0;    // of the curve
    std::vector<double> sigma;  // equidistant from `from` to `to`, or one value
    std::string output = {};    // of a term that states its own sigma: instead of `sigma`

    double at(double position) const {
        if (signal.empty()) return sigma.front();
        const double steps = static_cast<double>(sigma.size() - 1);
        const double place = std::clamp((position - from) / (to - from), 0.0, 1.0) * steps;
        const auto low = std::min(static_cast<std::size_t>(place), sigma.size() - 2);
        const double part = place - static_cast<double>(low);
        return (1.0 - part) * sigma[low] + part * sigma[low + 1];
    }
};

// Raises a curve by 1 everywhere, in all its branches.
void raise(json &curve) {
    if (curve.contains("coefficients")) {
        curve["coefficients"][0] = curve["coefficients"][0].get<double>() + 1.0;
    }
    for (const char *key : {"control_points", "values"}) {
        if (!curve.contains(key)) continue;
        for (json &value : curve[key]) value = value.get<double>() + 1.0;
    }
    if (curve.contains("backward")) raise(curve["backward"]);
}

// out: the cause of a curve's term. in : found: its provenance, with the member sigma
cause cause_of_curve(std::size_t index, const json &term, const json &found,
                     const std::string &path) {
    cause one = {index, term, formats::get<std::string>(term, "signal", path), 0, 0, {}};
    const json stated = found["sigma"];
    one.from = formats::get<double>(stated, "from_mm", path);
    one.to = formats::get<double>(stated, "to_mm", path);
    one.sigma = formats::get<std::vector<double>>(stated, "values", path);
    if (one.sigma.size() < 2 || !(one.to > one.from)) {
        throw input_error(path, 0, 0, "provenance.{}.sigma needs two values or more over a range",
                          formats::get<std::string>(term, "name", path));
    }
    raise(one.raised);
    return one;
}

// out: a cause for each output of a term that states its own sigma, which the box computes
std::vector<cause> causes_of_bank(std::size_t index, const json &term) {
    std::vector<cause> causes;
    const json names = term.value("outputs", json::array({term["name"]}));
    for (std::size_t k = 0; k < names.size(); ++k) {
        cause one = {index, term, "", 0, 0, {}, names[k].get<std::string>()};
        json &bank = one.raised["bank"];
        if (!bank.contains("bias")) bank["bias"] = json(names.size(), 0.0);
        bank["bias"][k] = bank["bias"][k].get<double>() + 1.0;
        causes.push_back(one);
    }
    return causes;
}

struct found_causes {
    std::vector<cause> causes;
    std::vector<std::string> exact;  // terms that state no sigma
};

// in : a file that the loader accepted. out: a cause for each sigma of its provenance
found_causes causes_of(const json &file, const std::string &path) {
    found_causes found;
    const json provenance = formats::member_or_null(file, "provenance");
    for (std::size_t k = 0; k < file["terms"].size(); ++k) {
        const json &term = file["terms"][k];
        const auto name = formats::get<std::string>(term, "name", path);
        const auto type = formats::get<std::string>(term, "type", path);
        const json own = formats::member_or_null(provenance, name.c_str());
        if (type == "volumetric") {
            const json sigmas = formats::member_or_null(own, "squareness_sigma_urad");
            for (const auto &[key, sigma] : sigmas.items()) {
                cause one = {k, term, "", 0, 0, {formats::get<double>(sigmas, key, path)}};
                json &squareness = one.raised["squareness_urad"][key];
                squareness = (squareness.is_number() ? squareness.get<double>() : 0.0) + 1.0;
                found.causes.push_back(one);
            }
        } else if (own.is_object() && own.contains("sigma") && term.contains("signal")) {
            found.causes.push_back(cause_of_curve(k, term, own, path));
        } else if (term.contains("sigma")) {
            for (cause &one : causes_of_bank(k, term)) found.causes.push_back(std::move(one));
        } else if (type != "product") {
            found.exact.push_back(name);
        }
    }
    return found;
}

// Throws input_error where the box's loader refuses the file with this term.
evaluation with_term(json file, const cause &one, const formats::csv_table &samples,
                     const std::string &path) {
    file["terms"][one.term] = one.raised;
    cb_message message;
    const auto config = load_coefficient_text(formats::json_text(file), &message);
    if (config == nullptr) throw input_error(path, 0, 0, message.text);
    return evaluate(*config, samples, true);
}

std::string list_of(const std::vector<std::string> &names) {
    std::string text;
    for (const std::string &name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
}

}  // namespace

namespace {

// out: index of a column in the rows, which have no time_s
std::size_t column_of(const evaluation &plain, const std::string &name) {
    const auto place = std::find(plain.names.begin(), plain.names.end(), name);
    return static_cast<std::size_t>(place - plain.names.begin()) - 1;
}

// An adapted term has the standard deviation of its filter, which stands for all that is wrong with
// its model: so no cause passes through it. in : a row of `plain`, and the same with one cause
// raised out: the rises of all columns behind time_s
std::vector<double> rises(const evaluation &plain, const evaluation &raised, std::size_t row) {
    std::vector<double> rise;
    for (std::size_t c = 0; c + 1 < plain.names.size(); ++c) {
        rise.push_back(double{raised.rows[row][c]} - double{plain.rows[row][c]});
    }
    for (const adapted_term &adapted : plain.adapted) {
        const auto own = column_of(plain, adapted.name);
        for (const std::string &channel : adapted.channels) {
            rise[column_of(plain, channel)] += rise[own];
        }
        rise[own] = 0.0;
    }
    return rise;
}

// Adds the variances of the adapted terms to those of the rows.
void add_adapted(const evaluation &plain, sigma_table &table) {
    for (const adapted_term &adapted : plain.adapted) {
        std::vector<std::string> columns = adapted.channels;
        columns.push_back(adapted.name);
        for (const std::string &column : columns) {
            const auto c = column_of(plain, column);
            for (std::size_t r = 0; r < table.rows.size(); ++r) {
                table.rows[r][c] += std::pow(double{adapted.sigma_um[r]}, 2);
            }
        }
    }
}

// out: the names that no sigma is known of, without adapted terms and their models
std::vector<std::string> without_adapted(const evaluation &plain, std::vector<std::string> names) {
    for (const adapted_term &adapted : plain.adapted) {
        for (const std::string &name : {adapted.name, adapted.of}) {
            names.erase(std::remove(names.begin(), names.end(), name), names.end());
        }
    }
    return names;
}

}  // namespace

sigma_table sigma_of(const std::string &coefficients, const formats::csv_table &samples) {
    std::string text;
    const auto config = load_coefficients(coefficients, &text);
    const json file = json::parse(text);
    const found_causes found = causes_of(file, coefficients);
    const evaluation plain = evaluate(*config, samples, true);
    sigma_table table;
    for (std::size_t c = 1; c < plain.names.size(); ++c) {
        table.names.push_back("sigma_" + plain.names[c]);
    }
    table.rows.assign(plain.rows.size(), std::vector<double>(table.names.size(), 0.0));
    for (const cause &one : found.causes) {
        const evaluation raised = with_term(file, one, samples, coefficients);
        const std::vector<double> places = one.signal.empty()
                                               ? std::vector<double>(plain.rows.size(), 0.0)
                                               : samples.values(one.signal);
        const std::size_t own = one.output.empty() ? 0 : column_of(plain, one.output);
        for (std::size_t r = 0; r < plain.rows.size(); ++r) {
            const double sigma =
                one.output.empty() ? one.at(places[r]) : double{plain.sigma_um[r][own]};
            const std::vector<double> rise = rises(plain, raised, r);
            for (std::size_t c = 0; c < table.names.size(); ++c) {
                table.rows[r][c] += std::pow(sigma * rise[c], 2);
            }
        }
    }
    add_adapted(plain, table);
    for (auto &row : table.rows) {
        for (double &value : row) value = std::sqrt(value);
    }
    const std::vector<std::string> exact = without_adapted(plain, found.exact);
    if (!exact.empty()) {
        table.remarks.push_back("no sigma is known of " + list_of(exact) + ": counts as exact");
    }
    return table;
}

namespace {

constexpr std::size_t map_steps = 11;
constexpr double usual_degC = 20.0, coverage = 2.0;

// out: samples at the nodes of the grid, the first axis fastest
formats::csv_table grid_of(const cb_config &config, const std::vector<std::string> &axes) {
    formats::csv_table table;
    table.file = "the map";
    table.names = {"time_s"};
    std::size_t count = 1;
    for (std::size_t a = 0; a < axes.size(); ++a) count *= map_steps;
    for (unsigned s = 0; s < config.signals_count; ++s)
        table.names.push_back(config.signals[s].name);
    for (std::size_t node = 0; node < count; ++node) {
        std::vector<double> row = {1e-3 * static_cast<double>(node)};
        for (unsigned s = 0; s < config.signals_count; ++s) {
            const cb_signal_config &signal = config.signals[s];
            const double low = double{signal.min}, high = double{signal.max};
            const double usual = std::string(signal.unit) == "degC" ? usual_degC : 0.0;
            double value = std::clamp(usual, low, high);
            std::size_t rest = node;
            for (const std::string &axis : axes) {
                const auto step = static_cast<double>(rest % map_steps);
                if (axis == signal.name) value = low + (high - low) * step / (map_steps - 1);
                rest /= map_steps;
            }
            row.push_back(value);
        }
        table.rows.push_back(row);
        table.lines.push_back(static_cast<long>(node) + 2);
    }
    table.mistakes.resize(table.names.size());
    return table;
}

}  // namespace

sigma_map map_of_sigma(const std::string &coefficients) {
    std::string text;
    const auto config = load_coefficients(coefficients, &text);
    std::set<std::string> moved;
    for (const cause &one : causes_of(json::parse(text), coefficients).causes) {
        if (!one.signal.empty()) moved.insert(one.signal);
    }
    if (moved.empty() || moved.size() > 3) {
        throw input_error(coefficients, 0, 0,
                          "a map needs curves of one to three axes with a sigma in the provenance, "
                          "as fit and volumetric write it; here are {}",
                          moved.size());
    }
    const std::vector<std::string> axes(moved.begin(), moved.end());
    const formats::csv_table grid = grid_of(*config, axes);
    const sigma_table sigma = sigma_of(coefficients, grid);
    sigma_map map;
    map.steps = map_steps;
    map.remarks = sigma.remarks;
    for (const std::string &axis : axes) {
        for (unsigned s = 0; s < config->signals_count; ++s) {
            const cb_signal_config &signal = config->signals[s];
            if (axis == signal.name) map.axes.push_back(axis + "_" + signal.unit);
        }
    }
    for (unsigned c = 0; c < config->channels_count; ++c) {
        map.channels.emplace_back(config->channels[c].name);
    }
    const std::size_t first = sigma.names.size() - map.channels.size();
    for (std::size_t r = 0; r < sigma.rows.size(); ++r) {
        std::vector<double> node;
        for (const std::string &axis : axes) node.push_back(grid.rows[r][grid.column(axis)]);
        double squares = 0.0;
        for (std::size_t c = first; c < sigma.names.size(); ++c) {
            node.push_back(coverage * sigma.rows[r][c]);
            squares += node.back() * node.back();
        }
        node.push_back(std::sqrt(squares));
        map.nodes.push_back(node);
    }
    return map;
}

std::string sigma_map_csv(const sigma_map &map) {
    std::vector<std::string> names = map.axes;
    for (const std::string &channel : map.channels) names.push_back("U_" + channel + "_um");
    names.push_back("U_um");
    return formats::csv_text(names, map.nodes);
}

}  // namespace compbox::coefficients
