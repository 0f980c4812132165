// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/name_remarks.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <set>

#include "host-tools/coefficients/demand.h"
#include "host-tools/coefficients/machine_file.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config/config.h"
#include "firmware/terms/kinds.h"
#include "firmware/wire/number.h"
}

namespace compbox::coefficients {

namespace {

using sentences = std::vector<std::string>;

constexpr double most_limit_um = 5000.0;
constexpr double overlap_of_range = 0.1;  // of a range that its register may miss at an end
constexpr double off_20_degC = 1.0;
constexpr unsigned least_same_numbers = 8;  // fewer equal numbers are chance

// The letters of an ISO 230-1 name: E, direction, moving axis.
struct iso_name {
    char direction, axis;
    bool angle() const { return direction <= 'C'; }
};

std::optional<iso_name> iso_of(const std::string &name) {
    const std::string letters = "XYZUVWABC";
    const bool fits = name.size() == 3 && name[0] == 'E' &&
                      letters.find(name[1]) != std::string::npos &&
                      letters.find(name[2]) != std::string::npos;
    return fits ? std::optional(iso_name{name[1], name[2]}) : std::nullopt;
}

const char *unit_of(const iso_name &iso) {
    return iso.angle() ? "µrad" : "µm";
}

// out: a text of provenance[name], "" where there is none
std::string origin_of(const json &file, const std::string &name, const char *key) {
    const json all = file.value("provenance", json::object());
    const json own = all.is_object() ? all.value(name, json()) : json();
    const json value = own.is_object() ? own.value(key, json()) : json();
    return value.is_string() ? value.get<std::string>() : "";
}

// ---- terms

// A curve's name has the axis of its signal as the last letter: EZX over X, X1 or X2.
void judge_axis(const cb_config &config, const cb_term_config &term, const std::string &name,
                sentences &remarks) {
    const auto iso = iso_of(name);
    if (!iso || !is_curve(term)) return;
    const unsigned s = term.as.curve.signal;
    const std::string signal = config.signals[s].name;
    const char letter = linear_letter(signal);
    if (letter == iso->axis || (letter == 0 && is_position(config, s))) return;
    const std::string unit = config.signals[s].unit;
    if (letter == 0) {
        remarks.push_back(fmt::format(
            "term {}: an error by the position of {} works on {}, whose unit is {}; fit it with "
            "--signal {}, or give it another name",
            name, iso->axis, signal, unit, iso->axis));
        return;
    }
    remarks.push_back(
        fmt::format("term {}: an error of axis {} works on the signal {}; fit it with --signal {}, "
                    "or name it E{}{}",
                    name, iso->axis, signal, iso->axis, iso->direction, letter));
}

// A volumetric term takes the positions of X, Y and Z in this order.
void judge_positions(const cb_config &config, const cb_term_config &term, const std::string &name,
                     sentences &remarks) {
    for (unsigned a = 0; term.type == CB_TERM_VOLUMETRIC && a < 3; ++a) {
        const std::string signal = config.signals[term.as.volumetric.signals[a]].name;
        const char letter = linear_letter(signal), own = "XYZ"[a];
        if (letter < 'X' || letter == own) continue;
        remarks.push_back(fmt::format(
            "volumetric term of {}: its position of {} is the signal {}; correct the order of its "
            "positions",
            name, own, signal));
        return;
    }
}

// What the fit noted of the data: its unit, and a file that is named after another error.
void judge_origin(const json &file, const std::string &name, sentences &remarks) {
    const auto iso = iso_of(name);
    if (!iso) return;
    const std::string unit = origin_of(file, name, "unit");
    if (!unit.empty() && (unit == "urad") != iso->angle()) {
        remarks.push_back(fmt::format(
            "term {}: its data are in {}, but E{}{} is {} in {}; name the column {}, or the term "
            "as the error that it is",
            name, unit == "urad" ? "µrad" : "µm", iso->direction, iso->axis,
            iso->angle() ? "an angle" : "a displacement", unit_of(*iso),
            iso->angle() ? "error_urad" : "error_um"));
    }
    const std::string data = origin_of(file, name, "data");
    const std::string stem = data.substr(0, data.find('.'));
    if (iso_of(stem) && stem != name) {
        remarks.push_back(
            fmt::format("term {}: it was fitted to {}; fit it to the file of {}, or "
                        "name the term {}",
                        name, data, name, stem));
    }
}

// out: the numbers of a curve in the pool, without those of its branch
std::pair<const float *, unsigned> numbers_of(const cb_config &config, const cb_term_config &term) {
    const cb_curve_config &curve = term.as.curve;
    const unsigned ends = term.type == CB_TERM_POLYNOMIAL ? 0 : curve.spans + 1u;
    return {config.pool + curve.pool + ends, curve.spans * (curve.degree + 1u)};
}

bool same_curve(const cb_config &config, const cb_term_config &a, const cb_term_config &b) {
    if (!is_curve(a) || !is_curve(b) || a.type != b.type) return false;
    const auto [first, count] = numbers_of(config, a);
    const auto [second, other] = numbers_of(config, b);
    return count == other && count >= least_same_numbers &&
           std::equal(first, first + count, second) &&
           std::any_of(first, first + count, [](float value) { return value != 0.0f; });
}

void judge_copies(const cb_config &config, sentences &remarks) {
    for (unsigned b = 1; b < config.terms_count; ++b) {
        for (unsigned a = 0; a < b; ++a) {
            if (!same_curve(config, config.terms[a], config.terms[b])) continue;
            const auto name = [&](unsigned t) {
                return config.outputs[config.terms[t].first_output].name;
            };
            remarks.push_back(
                fmt::format("terms {} and {}: the same curve, number by number; fit each to its "
                            "own file",
                            name(a), name(b)));
        }
    }
}

// ---- signals

// The register of a position can hold its range, but for a tenth at an end.
void judge_register(const cb_signal_config &signal, sentences &remarks) {
    const auto type = static_cast<cb_number_type>(signal.type);
    if (signal.source != CB_SOURCE_PLC || !cb_number_is_integer(type)) return;
    const double scale = static_cast<double>(signal.scale), zero = static_cast<double>(signal.zero);
    const cb_range raw = cb_number_range(type);
    const double a = static_cast<double>(raw.min) * scale + zero;
    const double b = static_cast<double>(raw.max) * scale + zero;
    const double low = std::min(a, b), high = std::max(a, b);
    const double min = static_cast<double>(signal.min), max = static_cast<double>(signal.max);
    const double most = std::max(plausible_beyond_mm, overlap_of_range * (max - min));
    if (min >= low - most && max <= high + most) return;
    remarks.push_back(fmt::format(
        "signal {}: its register holds {:.6g} to {:.6g} {}, but its range is {:.6g} to {:.6g}; "
        "check its scale and type",
        signal.name, low, high, signal.unit, min, max));
}

// Two positions that the PLC's program keeps in one register are one axis, read twice.
void judge_shared(const cb_config &config, unsigned i, sentences &remarks) {
    for (unsigned k = 0; k < i; ++k) {
        const cb_signal_config &a = config.signals[k], &b = config.signals[i];
        const bool shared = a.source == CB_SOURCE_PLC && b.source == CB_SOURCE_PLC &&
                            a.reg == b.reg && is_position(config, k);
        if (!shared) continue;
        remarks.push_back(
            fmt::format("signals {} and {}: both are read from the register {}; give each axis its "
                        "own",
                        a.name, b.name, config.plc.read.start + a.reg));
    }
}

void judge_signals(const cb_config &config, sentences &remarks) {
    for (unsigned i = 0; i < config.signals_count; ++i) {
        const cb_signal_config &signal = config.signals[i];
        const std::string unit = signal.unit;
        if (signal.source == CB_SOURCE_LAG) continue;
        if (linear_letter(signal.name) != 0 && unit != "mm") {
            remarks.push_back(
                fmt::format("signal {}: a linear axis with the unit {}; scale its position to mm "
                            "and set unit to mm",
                            signal.name, unit.empty() ? "\"\"" : unit));
        }
        if (!is_position(config, i)) continue;
        judge_register(signal, remarks);
        judge_shared(config, i, remarks);
    }
}

// ---- channels

// out: outputs that the output's term works with
std::set<unsigned> used_by(const cb_config &config, unsigned output) {
    std::set<unsigned> all;
    unsigned count = 0;
    const std::uint8_t *list = cb_term_used(&config.terms[config.outputs[output].term], &count);
    for (unsigned i = 0; i < count; ++i) {
        if (list[i] != CB_NONE) all.insert(list[i]);
    }
    return all;
}

// Remarks an output of the sum that is an angle, that acts in another direction, or whose term
// works with another one of the sum. A product may: K0 and the slope that it multiplies differ.
void judge_sum(const cb_config &config, const cb_channel_config &channel, sentences &remarks) {
    const char letter = linear_letter(channel.name);
    for (unsigned i = 0; i < channel.sum_count; ++i) {
        const std::string name = config.outputs[channel.sum[i]].name;
        const auto iso = iso_of(name);
        if (iso && iso->angle()) {
            remarks.push_back(fmt::format(
                "channel {}: it sums {}, an angle in µrad, as µm; let compbox volumetric bring the "
                "angle to the tool",
                channel.name, name));
        } else if (iso && letter != 0 && iso->direction != letter) {
            remarks.push_back(fmt::format(
                "channel {}: it sums {}, an error in the direction {}; set sum to null, and build "
                "chooses the terms",
                channel.name, name, iso->direction));
        }
        const auto used = used_by(config, channel.sum[i]);
        for (unsigned k = 0; k < channel.sum_count; ++k) {
            const bool product =
                config.terms[config.outputs[channel.sum[i]].term].type == CB_TERM_PRODUCT;
            if (product || used.count(channel.sum[k]) == 0) continue;
            remarks.push_back(fmt::format(
                "channel {}: it sums {} and {}, which holds {} already; "
                "leave {} out of sum",
                channel.name, config.outputs[channel.sum[k]].name, name,
                config.outputs[channel.sum[k]].name, config.outputs[channel.sum[k]].name));
        }
    }
}

void judge_limit(const cb_channel_config &channel, sentences &remarks) {
    const auto um = static_cast<double>(channel.limit_um);
    if (um > least_limit_um && um < most_limit_um) return;
    if (um <= least_limit_um) {
        remarks.push_back(
            fmt::format("channel {}: limit_um {:.6g} is less than a compensation needs; it is a "
                        "length in µm ({:.6g} mm are {:.6g} µm)",
                        channel.name, um, um, 1e3 * um));
    } else {
        remarks.push_back(
            fmt::format("channel {}: limit_um {:.6g} is {:.6g} mm, more than a compensation needs; "
                        "it is a length in µm",
                        channel.name, um, 1e-3 * um));
    }
}

// The slope of a channel is that by its own axis.
void judge_tangent(const cb_config &config, const cb_channel_config &channel, sentences &remarks) {
    if (!channel.tangent) return;
    const std::string signal = config.signals[channel.tangent_signal].name;
    const char own = linear_letter(channel.name), other = linear_letter(signal);
    if (own == 0 || other == 0 || own == other) return;
    remarks.push_back(fmt::format(
        "channel {}: its tangent is by the position of {}; the control applies it to {}, so set "
        "tangent.signal to that axis",
        channel.name, signal, channel.name));
}

// Remarks motors of a stage with different limits or signs.
void judge_pairs(const cb_config &config, sentences &remarks) {
    for (unsigned p = 0; p < config.pairs_count; ++p) {
        const cb_channel_config &a = config.channels[config.pairs[p].a];
        const cb_channel_config &b = config.channels[config.pairs[p].b];
        if (a.limit_um != b.limit_um || a.slew_um_per_s != b.slew_um_per_s) {
            remarks.push_back(fmt::format(
                "pairs[{}]: {} has limit_um {:.6g} and slew_um_per_s {:.6g}, but {} has {:.6g} and "
                "{:.6g}; give both motors of the stage the same",
                p, a.name, a.limit_um, a.slew_um_per_s, b.name, b.limit_um, b.slew_um_per_s));
        }
        if (config.pairs[p].max_difference_um >= std::max(a.limit_um, b.limit_um)) {
            remarks.push_back(fmt::format(
                "pairs[{}]: max_difference_um {:.6g} lets {} and {} differ by a whole limit_um "
                "({:.6g}); ask the builder of the machine for the number, in µm",
                p, config.pairs[p].max_difference_um, a.name, b.name,
                std::max(a.limit_um, b.limit_um)));
        }
        if (a.sign == b.sign) continue;
        remarks.push_back(fmt::format(
            "pairs[{}]: {} has sign {} and {} has sign {}, so one motor of the stage would move "
            "against the other; repeat the sign test of both",
            p, a.name, a.sign, b.name, b.sign));
    }
}

bool is_paired(const cb_config &config, unsigned channel) {
    return std::any_of(config.pairs, config.pairs + config.pairs_count,
                       [&](const auto &pair) { return pair.a == channel || pair.b == channel; });
}

// Remarks two channels of one axis, as Y1 and Y2, that no pair keeps together.
void judge_unpaired(const cb_config &config, sentences &remarks) {
    for (unsigned b = 1; b < config.channels_count; ++b) {
        for (unsigned a = 0; a < b; ++a) {
            const std::string first = config.channels[a].name, second = config.channels[b].name;
            const char letter = linear_letter(first);
            if (letter == 0 || letter != linear_letter(second)) continue;
            if (is_paired(config, a) || is_paired(config, b)) continue;
            remarks.push_back(fmt::format(
                "channels {} and {}: no pair limits their difference; if they move one stage, add "
                "them to pairs with its max_difference_um",
                first, second));
        }
    }
}

// ---- temperature

bool uses_temperature(const cb_config &config, unsigned output) {
    const auto signals = signals_of_output(config, output);
    return std::any_of(signals.begin(), signals.end(),
                       [&](unsigned s) { return std::string(config.signals[s].unit) == "degC"; });
}

// The environment that `fit` noted of a laser file.
struct environment {
    std::optional<double> expansion_um_per_m_K;  // 0: the instrument did not correct it
    std::optional<double> material_degC;         // at the start, by its first sensor
};

environment environment_of(const json &file, const std::string &name) {
    const json all = file.value("provenance", json::object());
    const json own = all.is_object() ? all.value(name, json()) : json();
    const json noted = own.is_object() ? own.value("environment", json()) : json();
    environment result;
    if (!noted.is_object()) return result;
    const json expansion = noted.value("expansion_um_per_m_K", json());
    if (expansion.is_number()) result.expansion_um_per_m_K = expansion.get<double>();
    json material = noted.value("material_degC", json());
    while (material.is_array() && !material.empty()) material = json(material[0]);
    if (material.is_number()) result.material_degC = material.get<double>();
    return result;
}

// in : a positioning curve, as EXX, and a term of the same channel that works on a temperature
// out: a sentence where the fit noted that the instrument corrected the temperature, or that the
//      curve holds the expansion of a material that was not at 20 °C; else ""
std::string twice_corrected(const json &file, const std::string &channel, const std::string &curve,
                            const std::string &thermal) {
    const auto [expansion, degC] = environment_of(file, curve);
    if (!expansion) return "";
    if (*expansion != 0.0) {
        return fmt::format(
            "channel {}: {} was measured with the instrument's correction of the material's "
            "temperature ({:.4g} µm/m/K), and {} corrects by temperature again; leave one of the "
            "two out, unless {} counts from 20 degC",
            channel, curve, *expansion, thermal, thermal);
    }
    if (!degC || std::fabs(*degC - 20.0) < off_20_degC) return "";
    return fmt::format(
        "channel {}: {} was measured at {:.1f} degC without the instrument's correction of the "
        "material's temperature, so it holds an expansion, and {} corrects by temperature again; "
        "let {} be zero at {:.1f} degC",
        channel, curve, *degC, thermal, thermal, *degC);
}

// Looks at the terms of one channel, and at the curves that its volumetric term uses.
void judge_temperature(const cb_config &config, const cb_channel_config &channel, const json &file,
                       sentences &remarks) {
    std::set<unsigned> outputs(channel.sum, channel.sum + channel.sum_count);
    std::string thermal;
    for (unsigned i = 0; i < channel.sum_count; ++i) {
        for (const unsigned used : used_by(config, channel.sum[i])) outputs.insert(used);
        if (uses_temperature(config, channel.sum[i])) thermal = config.outputs[channel.sum[i]].name;
    }
    if (thermal.empty()) return;
    for (const unsigned output : outputs) {
        const std::string curve = config.outputs[output].name;
        const auto iso = iso_of(curve);
        if (!iso || iso->direction != iso->axis || uses_temperature(config, output)) continue;
        const auto remark = twice_corrected(file, channel.name, curve, thermal);
        if (!remark.empty()) remarks.push_back(remark);
    }
}

}  // namespace

std::vector<std::string> name_remarks(const cb_config &config, const json &file) {
    sentences remarks;
    for (unsigned i = 0; i < config.terms_count; ++i) {
        const cb_term_config &term = config.terms[i];
        const std::string name = config.outputs[term.first_output].name;
        judge_axis(config, term, name, remarks);
        judge_positions(config, term, name, remarks);
        judge_origin(file, name, remarks);
    }
    judge_copies(config, remarks);
    judge_signals(config, remarks);
    for (unsigned i = 0; i < config.channels_count; ++i) {
        judge_sum(config, config.channels[i], remarks);
        judge_limit(config.channels[i], remarks);
        judge_tangent(config, config.channels[i], remarks);
        judge_temperature(config, config.channels[i], file, remarks);
    }
    judge_pairs(config, remarks);
    judge_unpaired(config, remarks);
    return remarks;
}

}  // namespace compbox::coefficients
