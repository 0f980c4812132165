// SPDX-License-Identifier: MIT
#include "host-tools/test_report/uncertainty.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/test_report/figures.h"

namespace compbox::test_report {

namespace {

using metrology::budget;
using metrology::budget_inputs;

// Throws input_error for inputs that cannot be used for this measurement.
void check(const budget_inputs &inputs, const fitting::measurement &data) {
    if (data.unit != "um" && (inputs.device_um_per_m || inputs.misalignment_mm ||
                              inputs.temperature_K || inputs.expansion_range)) {
        throw input_error(data.file, 0, 0,
                          "holds angles; their budget has device-um and eve-um alone, in urad");
    }
    if (inputs.temperature_K && !inputs.expansion_um_per_m_K) {
        throw input_error(data.file, 0, 0,
                          "states no expansion coefficient, which temperature-K of the budget "
                          "needs; give --expansion-um-per-m-K");
    }
    if (inputs.expansion_range && !inputs.material_degC) {
        throw input_error(data.file, 0, 0,
                          "states no material temperature, which expansion-range of the budget "
                          "needs; give --material-degC");
    }
}

json contributions_json(const budget &known, bool along) {
    const auto number = [](const std::optional<double> &U) { return U ? json(*U) : json(nullptr); };
    json one;
    one["device"] = number(known.device);
    if (along) {
        one["misalignment"] = number(known.misalignment);
        one["temperature"] = number(known.temperature);
        one["expansion"] = number(known.expansion);
    }
    one["environment"] = number(known.environment);
    return one;
}

metrology::approach approach_of(const std::string &key) {
    if (key.size() < 2) return metrology::approach::both;
    return key[1] == '+' ? metrology::approach::forward : metrology::approach::backward;
}

// U (k = 2) of a linear measurement by the makers' data sheets, with the instrument's own weather
// station. From memory: a certificate outweighs it.
struct data_sheet {
    const char *instrument;
    double um_per_m;
};
constexpr data_sheet data_sheets[] = {{"XL-80", 0.5}, {"XM-60", 0.5}, {"ML10", 0.7}};

// Fills in the instrument of a length by the file's EQUIPMENT:: where the budget states none, with
// a remark.
void take_data_sheet(json &part, budget_inputs &inputs, const fitting::measurement &data) {
    if (inputs.device_um || inputs.device_um_per_m || data.unit != "um") return;
    for (const data_sheet &one : data_sheets) {
        if (data.about.instrument.find(one.instrument) == std::string::npos) continue;
        inputs.device_um_per_m = one.um_per_m;
        part["remarks"].push_back(
            fmt::format("U of the instrument is {:g} um/m by the data sheet of the {}; a "
                        "certificate is stated by device-um-per-m",
                        one.um_per_m, one.instrument));
        return;
    }
}

// in : figures of positioning; eve: range of the drift
// A remark where its standard deviation exceeds half of the scatter: R and A then grow with the
// drift in proportion, which U does not cover.
void remark_drift(json &part, double eve) {
    std::vector<double> scatter;
    for (const char *side : {"forward", "backward"}) {
        if (!part.contains(side)) continue;
        for (const json &s : part[side]["s"]) {
            if (s.is_number()) scatter.push_back(s.get<double>());
        }
    }
    if (scatter.empty()) return;
    const auto middle = scatter.begin() + static_cast<std::ptrdiff_t>(scatter.size() / 2);
    std::nth_element(scatter.begin(), middle, scatter.end());
    if (eve / std::sqrt(12.0) <= 0.5 * *middle) return;
    part["remarks"].push_back(fmt::format(
        "the drift of {:.2f} um is not small beside the scatter: R and A contain it, and their U "
        "is too small",
        eve));
}

// Adds U of A, R, E, M and B where the readings give them.
void add_positioning(json &into, const json &figures, const fitting::measurement &data,
                     const budget &known) {
    const metrology::axis_readings axis = readings_of(data);
    const auto found = metrology::evaluate_positioning(axis);
    for (const figure &one : positioning_figures) {
        if (!value_of(figures, one)) continue;
        const std::string key = one.key;
        into[key] = metrology::figure_uncertainty(known, axis, found, key[0], approach_of(key));
    }
}

void add_straightness(json &into, const fitting::measurement &data, const budget &known) {
    const std::pair<const char *, metrology::reference> lines[] = {
        {"end-point", metrology::reference::end_point},
        {"least-squares", metrology::reference::least_squares},
        {"minimum-zone", metrology::reference::minimum_zone}};
    for (const auto &[key, line] : lines) {
        into[key] = metrology::straightness_uncertainty(known, line, data.position, data.mean,
                                                        data.readings);
    }
}

}  // namespace

budget_inputs with_drift(const budget_inputs &inputs, const json &figures) {
    budget_inputs all = inputs;
    if (!figures.contains("drift")) return all;
    const double drift = std::fabs(figures["drift"]["change"].get<double>());
    all.eve_um = std::max(all.eve_um.value_or(0.0), drift);
    return all;
}

void add_uncertainty(json &figures, const fitting::measurement &data, const budget_inputs &inputs) {
    check(inputs, data);
    const double length_mm = data.to() - data.from();
    const bool angles = data.unit != "um";
    budget_inputs along_axis = inputs;
    take_data_sheet(figures["positioning"], along_axis, data);
    const budget along = angles ? metrology::transverse_budget(inputs, length_mm)
                                : metrology::positioning_budget(along_axis, length_mm);
    const budget across = metrology::transverse_budget(inputs, length_mm);
    json &result = figures["uncertainty"];
    result["k"] = 2;
    result["length_mm"] = length_mm;
    result["contributions"]["positioning"] = contributions_json(along, !angles);
    result["contributions"]["straightness"] = contributions_json(across, false);
    result["figures"] = json::object();
    add_positioning(result["figures"], figures, data, along);
    add_straightness(result["figures"], data, across);
    if (inputs.eve_um) remark_drift(figures["positioning"], *inputs.eve_um);
}

void add_stated(json &figures, const by_figure &stated) {
    const std::string file = figures["file"].get<std::string>();
    for (const auto &[key, U] : stated) {
        figure_of(file, key);
        figures["uncertainty"]["k"] = 2;
        figures["uncertainty"]["figures"][key] = U;
        figures["uncertainty"]["stated"].push_back(key);
    }
}

by_figure uncertainties_in(const json &figures) {
    by_figure known;
    if (!figures.contains("uncertainty")) return known;
    for (const auto &[key, U] : figures["uncertainty"]["figures"].items()) {
        known[key] = U.get<double>();
    }
    return known;
}

std::string budget_text(const json &figures, const char *of) {
    const json::json_pointer place("/uncertainty/contributions");
    if (!figures.contains(place)) return "";
    std::string known, unknown;
    for (const auto &[name, U] : figures.at(place)[of].items()) {
        std::string &into = U.is_null() ? unknown : known;
        into += (into.empty() ? "" : ", ") + name;
        if (!U.is_null()) into += fmt::format(" {:.2f}", U.get<double>());
    }
    return known + (unknown.empty() ? "" : "; not stated: " + unknown);
}

}  // namespace compbox::test_report
