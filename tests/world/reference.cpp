// SPDX-License-Identifier: MIT
#include "tests/world/reference.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"

namespace compbox::world {

namespace {

using nlohmann::json;
using numbers = std::vector<double>;

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
constexpr double float_eps = 6e-8;  // of one rounding to 24 bits

double seconds_of(time_ns ns) {
    return 1e-9 * static_cast<double>(ns);
}

// out: NaN if one of them is
double least(double a, double b) {
    return b < a || std::isnan(b) ? b : a;
}

}  // namespace

std::string bank_key(const std::string &input, unsigned power, float tau_s) {
    return fmt::format("{} {} {}", input, power, tau_s);
}

std::vector<trained_range> ranges_of(const json &net) {
    std::vector<trained_range> ranges(net.contains("input_min") ? 0 : net.at("inputs").size());
    for (std::size_t i = ranges.size(); i < net.at("inputs").size(); ++i) {
        const double min = net.at("input_min")[i], max = net.at("input_max")[i];
        const auto own = [&net, i](const char *key, double otherwise) {
            return net.contains(key) ? net.at(key)[i].get<double>() : otherwise;
        };
        ranges.push_back(
            {min, max, own("margin", 0.1 * (max - min)), own("fade", 0.5 * (max - min))});
    }
    return ranges;
}

double polyline_at(const numbers &at, const numbers &values, double x) {
    if (std::isnan(x)) return unknown;
    if (x <= at.front()) return values.front();
    if (x >= at.back()) return values.back();
    const auto above = std::upper_bound(at.begin(), at.end(), x);
    const auto i = static_cast<std::size_t>(above - at.begin());
    const double share = (x - at[i - 1]) / (at[i] - at[i - 1]);
    return values[i - 1] + share * (values[i] - values[i - 1]);
}

double lagged(double y, double u, double to, double dt_s, double tau_s) {
    const double h = dt_s / tau_s, gain = -std::expm1(-h);
    const double ramp = h < 1e-3 ? h / 2 - h * h / 6 : 1 - gain / h;
    return y + gain * (u - y) + ramp * (to - u);
}

polynomial::polynomial(const json &term)
    : from(term.value("from", -1e9)),
      to(term.value("to", 1e9)),
      center(term.at("center")),
      half_range(term.at("half_range")),
      coefficients(term.at("coefficients").get<numbers>()) {}

double polynomial::at(double x) const {
    if (std::isnan(x)) return unknown;
    const double u = (std::clamp(x, from, to) - center) / half_range;
    double sum = 0, power = 1;
    for (const double coefficient : coefficients) {
        sum += coefficient * power;
        power *= u;
    }
    return sum;
}

volumetric::volumetric(const json &term) {
    const std::string letters = "XYZ", kinds = "XYZABC", chain = term.at("chain");
    const std::size_t f = chain.find('f');
    const json &square = term.at("squareness_urad");
    b0z_urad = square.value("B0Z", 0.0);
    c0y_urad = square.value("C0Y", 0.0);
    a0z_urad = square.value("A0Z", 0.0);
    tool = term.value("tool_length", "");
    for (const std::string name : term.at("errors")) {
        const std::string of = name.substr(2);
        const std::size_t i = chain.find(of);
        part made = {name, kinds.find(name[1]), {}, {}};
        for (std::size_t c = 0; c < 3; ++c) {
            const std::size_t j = chain.find(letters[c]);
            made.moves[c] = i > f ? j > i : j >= i || j > f;
            made.lever_mm[c] = term.at("tool_offset_mm")[c].get<double>() -
                               term.at("reference_points_mm").at(of)[c].get<double>() -
                               (c == 2 ? term.value("tool_length_mm", 0.0) : 0);
        }
        parts.push_back(made);
    }
}

double volumetric::um(std::size_t axis, const std::array<double, 3> &at_mm, const numbers &errors,
                      double tool_mm) const {
    double e_um[3] = {1e-3 * (b0z_urad * at_mm[2] - c0y_urad * at_mm[1]),
                      -1e-3 * a0z_urad * at_mm[2], 0};
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const part &one = parts[k];
        if (one.kind < 3) {
            e_um[one.kind] += errors[k];
            continue;
        }
        const auto lever_mm = [&](std::size_t c) {
            return one.lever_mm[c] + (one.moves[c] ? at_mm[c] : 0) - (c == 2 ? tool_mm : 0);
        };
        const std::size_t next = (one.kind + 1) % 3, last = (one.kind + 2) % 3;  // (e_r x L)
        e_um[next] -= 1e-3 * errors[k] * lever_mm(last);
        e_um[last] += 1e-3 * errors[k] * lever_mm(next);
    }
    return e_um[axis];
}

double power_of(double x, unsigned power) {
    return power == 0 ? 1 : x * power_of(x, power - 1);
}

// By de Boor's recursion.
double bspline_at(const numbers &knots, std::size_t degree, const numbers &points, double x) {
    if (std::isnan(x)) return unknown;
    x = std::clamp(x, knots[degree], knots[points.size()]);
    std::size_t span = degree;
    while (span + 1 < points.size() && x >= knots[span + 1]) ++span;
    numbers d(points.begin() + static_cast<std::ptrdiff_t>(span - degree),
              points.begin() + static_cast<std::ptrdiff_t>(span + 1));
    for (std::size_t r = 1; r <= degree; ++r) {
        for (std::size_t j = degree; j >= r; --j) {
            const double low = knots[span - degree + j], high = knots[span + 1 + j - r];
            const double share = high > low ? (x - low) / (high - low) : 0;
            d[j] = (1 - share) * d[j - 1] + share * d[j];
        }
    }
    return d[degree];
}

// ---- the file

reference_box::reference_box(const machine &of) : period_ns_(of.period_us * us) {
    const json &root = of.file();
    const json &cycle = root.at("cycle"), &plc = root.at("plc");
    const double line_s = 1e-3 * plc.value("interpolate_ms", 0.0);
    const json lead = cycle.value("lead_ms", json(0));
    if (lead.is_string()) {  // measured: period / 2, and what the exchange and the PLC's cycle take
        const double handshake_s = plc.value("profile", "") == "fanuc" ? 0.15 : 0;
        const double before_s = of.fc23 ? seconds_of(period_ns_) : 0;
        lead_unsure_s_ = (0.12 + handshake_s + before_s) / 2;
        lead_s_ = 0.5 * (seconds_of(period_ns_) + line_s) + lead_unsure_s_;
    } else {
        lead_s_ = 1e-3 * lead.get<double>();
    }
    counts_beats_ = line_s > 0;
    scan_s_ = of.twin.plc.scan_s;
    take_signals(of);
    take_terms(root);
    for (const auto &channel : root.at("channels")) {
        sums_.emplace_back();
        for (const std::string output : channel.at("sum"))
            sums_.back().push_back(outputs_.at(output));
    }
}

void reference_box::take_signals(const machine &of) {
    const json &root = of.file();
    for (const auto &entry : root.at("signals")) {
        signal made;
        made.name = entry.at("name");
        const std::string unit = entry.value("unit", "");
        made.from_plc = entry.contains("plc");
        made.waits_ns = 3 * period_ns_ + (entry.contains("hand") ? 1100 : 100) * ms;
        made.leads = made.from_plc && (unit == "mm" || unit == "deg");
        made.min = entry.value("min", 0.0);
        made.max = entry.value("max", 0.0);
        made.rate_per_s = entry.value("max_rate_per_s", 0.0);
        if (entry.value("type", "").rfind("float", 0) != 0)
            made.unit = std::fabs(entry.value("scale", 1.0));
        made.max_age_ns = of.signal(made.name)->max_age_us * us;
        signals_.push_back(made);
    }
    if (root.contains("sensors")) {
        watch_.emplace(root.at("sensors"), period_ns_);
        for (std::size_t j = 0; j < watch_->names().size(); ++j)
            signals_[place_of(watch_->names()[j])].watched = j;
    }
    for (std::size_t i = 0; i < signals_.size(); ++i) {
        signals_[i].source = i;
        while (root.at("signals")[signals_[i].source].contains("lag_of"))
            signals_[i].source = place_of(root.at("signals")[signals_[i].source].at("lag_of"));
        const json &entry = root.at("signals")[i];
        if (entry.contains("velocity")) {
            const std::size_t place = place_of(entry.at("velocity"));
            const std::string unit = root.at("signals")[place].at("unit");
            signals_[i].reported = place;
            signals_[i].per_s = unit.find("/min") != std::string::npos ? 60 : 1;
        }
        if (!entry.contains("lag_of")) continue;
        lags_.push_back(
            {place_of(entry.at("lag_of")), i, entry.at("tau_s"), entry.value("power", 1u)});
        lags_.back().key = signals_[i].name;
    }
}

void reference_box::take_terms(const json &root) {
    for (const auto &term : root.at("terms")) {
        const json &model = term.contains("bank") ? term.at("bank") : term;
        for (std::size_t i = 0; model.contains("input_min") && i < model.at("inputs").size(); ++i)
            trained_.push_back({place_of(model.at("inputs")[i]), model.at("input_min")[i],
                                model.at("input_max")[i]});
        const std::string type = term.at("type");
        if (!term.contains("outputs")) {
            outputs_[term.at("name")] = function_of(term, 0);
            continue;
        }
        std::size_t k = 0;
        for (const std::string output : term.at("outputs"))
            outputs_[output] =
                type == "volumetric" ? volumetric_of(term, output[1]) : function_of(term, k++);
    }
}

std::size_t reference_box::place_of(const std::string &name) const {
    std::size_t i = 0;
    while (signals_.at(i).name != name) ++i;
    return i;
}

// out: the place of another value behind those of the signals
std::size_t reference_box::hidden_place() {
    hidden_.push_back(unknown);
    hidden_near_.push_back(1e-5);
    return signals_.size() + hidden_.size() - 1;
}

// in : k: which of its outputs. out: nothing but NaN for kinds that need more than readings
reference_box::function reference_box::function_of(const json &term, std::size_t k) {
    const std::string type = term.at("type");
    if (type == "linear") return linear_of(term, k);
    if (type == "bpnet") return network_of(term, k);
    if (type == "polyline" || type == "bspline" || type == "polynomial")
        return term.contains("backward") ? play_of(term) : curve_of(term);
    if (type != "product") return [](const values &) { return unknown; };
    const function slope = outputs_.at(term.at("term"));
    return [slope, x = place_of(term.at("signal")), origin = term.value("origin", 0.0)](
               const values &at) { return slope(at) * (at[x] - origin); };
}

// in : a curve with its signal
reference_box::function reference_box::curve_of(const json &curve) const {
    const std::size_t x = place_of(curve.at("signal"));
    if (curve.at("type") == "polynomial")
        return [x, drawn = polynomial(curve)](const values &at) { return drawn.at(at[x]); };
    if (curve.at("type") == "polyline")
        return [x, positions = curve.at("positions").get<numbers>(),
                drawn = curve.at("values").get<numbers>()](const values &at) {
            return polyline_at(positions, drawn, at[x]);
        };
    return [x, knots = curve.at("knots").get<numbers>(),
            degree = curve.at("degree").get<std::size_t>(),
            points = curve.at("control_points").get<numbers>()](const values &at) {
        return bspline_at(knots, degree, points, at[x]);
    };
}

reference_box::function reference_box::play_of(const json &term) {
    json back = term;
    back.update(term.at("backward"));
    const std::size_t b = hidden_place();
    const std::size_t axis = place_of(term.at("signal"));
    const double width = term.at("reversal_mm");
    hidden_near_.back() += 5 * float_eps * signals_[axis].max / width;
    plays_.push_back({axis, b, width, term.at("name"), hidden_near_.back()});
    return [forward = curve_of(term), backward = curve_of(back), b](const values &at) {
        return (1 + at[b]) / 2 * forward(at) + (1 - at[b]) / 2 * backward(at);
    };
}

reference_box::function reference_box::linear_of(const json &term, std::size_t k) {
    if (term.contains("bank")) return bank_of(term.at("bank"), k);
    std::vector<std::size_t> inputs;
    for (const std::string name : term.at("inputs")) inputs.push_back(place_of(name));
    return [inputs, weights = term.at("weights").get<numbers>(),
            constant = term.value("constant", 0.0)](const values &at) {
        double sum = constant;
        for (std::size_t i = 0; i < inputs.size(); ++i) sum += weights[i] * at[inputs[i]];
        return sum;
    };
}

// Columns in their order: inputs, powers, time constants.
reference_box::function reference_box::bank_of(const json &bank, std::size_t k) {
    struct column {
        std::size_t place;
        unsigned power;
        double weight;
        trained_range range;
    };
    std::vector<column> columns;
    std::vector<std::size_t> inputs;
    const std::vector<trained_range> ranges = ranges_of(bank);
    const json &weights = bank.at("weights")[k];
    for (const std::string name : bank.at("inputs")) {
        const trained_range &range = ranges[inputs.size()];
        inputs.push_back(place_of(name));
        for (const unsigned power : bank.at("powers").at(name)) {
            for (const double tau_s : bank.at("tau_s")) {
                const double weight = weights[columns.size()];
                if (tau_s == 0) {
                    columns.push_back({inputs.back(), power, weight, range});
                    continue;
                }
                const std::size_t lagged = hidden_place();
                lags_.push_back(
                    {inputs.back(), lagged, tau_s, power, range.held(-1e30), range.held(1e30)});
                lags_.back().key = bank_key(name, power, static_cast<float>(tau_s));
                columns.push_back({lagged, 1, weight, trained_range()});
            }
        }
    }
    return [columns, inputs, ranges, bias = bank.at("bias")[k].get<double>()](const values &at) {
        double sum = bias, weight = 1;
        for (const column &one : columns)
            sum += one.weight * power_of(one.range.held(at[one.place]), one.power);
        for (std::size_t i = 0; i < inputs.size(); ++i)
            weight = least(weight, ranges[i].weight(at[inputs[i]]));
        return sum * weight;
    };
}

reference_box::function reference_box::network_of(const json &net, std::size_t k) const {
    std::vector<std::size_t> inputs;
    for (const std::string name : net.at("inputs")) inputs.push_back(place_of(name));
    const bool logistic = net.at("activation") == "logsig";
    return [inputs, logistic, ranges = ranges_of(net),
            rows = net.at("hidden_weights").get<std::vector<numbers>>(),
            biases = net.at("hidden_bias").get<numbers>(),
            out = net.at("output_weights")[k].get<numbers>(),
            bias = net.at("output_bias")[k].get<double>(),
            center = net.at("input_center").get<numbers>(),
            scale = net.at("input_scale").get<numbers>(),
            beside =
                net.value("linear_weights", std::vector<numbers>(k + 1, numbers(inputs.size())))[k],
            out_center = net.value("output_center", numbers(k + 1))[k],
            out_scale = net.value("output_scale", numbers(k + 1, 1.0))[k]](const values &at) {
        double sum = bias, weight = 1;
        numbers n;
        for (std::size_t i = 0; i < inputs.size(); ++i) {
            n.push_back((ranges[i].held(at[inputs[i]]) - center[i]) / scale[i]);
            sum += beside[i] * n[i];
            weight = least(weight, ranges[i].weight(at[inputs[i]]));
        }
        for (std::size_t h = 0; h < rows.size(); ++h) {
            double s = biases[h];
            for (std::size_t i = 0; i < inputs.size(); ++i) s += rows[h][i] * n[i];
            sum += out[h] * (logistic ? 1 / (1 + std::exp(-s)) : std::tanh(s));
        }
        return (out_center + out_scale * sum) * weight;
    };
}

reference_box::function reference_box::volumetric_of(const json &term, char axis) const {
    const std::size_t along = std::string("XYZ").find(axis);
    const std::array<std::size_t, 3> places = {place_of("X"), place_of("Y"), place_of("Z")};
    const volumetric made(term);
    std::vector<function> errors;
    for (const volumetric::part &one : made.parts) errors.push_back(outputs_.at(one.error));
    const std::size_t tool = made.tool.empty() ? 0 : place_of(made.tool);
    return [made, along, places, errors, tool](const values &at) {
        const double tool_mm = made.tool.empty() ? 0 : at[tool];
        numbers found;
        for (const function &error : errors) found.push_back(error(at));
        // With one of them missing, a position or the tool length, the box has none of its outputs.
        if (std::isnan(tool_mm + at[places[0]] + at[places[1]] + at[places[2]]) ||
            std::any_of(found.begin(), found.end(), [](double um) { return std::isnan(um); }))
            return unknown;
        return made.um(along, {at[places[0]], at[places[1]], at[places[2]]}, found, tool_mm);
    };
}

// ---- what comes

void reference_box::take(const machine &of) {
    reference_box fresh(of);
    for (signal &one : fresh.signals_) {
        const auto was =
            std::find_if(signals_.begin(), signals_.end(),
                         [&one](const signal &other) { return other.name == one.name; });
        if (was == signals_.end()) continue;
        const signal made = one;
        one = *was;
        one.source = made.source;
        one.reported = made.reported;
        one.watched = made.watched;
    }
    for (lag &one : fresh.lags_) {
        const lag made = one;
        if (const lag *was = ancestor_of(one)) adopt(fresh, one, *was);
        one.tau_s = made.tau_s;
        one.min = made.min;
        one.max = made.max;
        one.u = power_of(std::clamp(one.x, one.min, one.max), one.power);
    }
    for (play &one : fresh.plays_)
        for (const play &was : plays_)
            if (was.key == one.key) adopt(fresh, one, was);
    std::swap(signals_, fresh.signals_);
    std::swap(lags_, fresh.lags_);
    std::swap(plays_, fresh.plays_);
    std::swap(hidden_, fresh.hidden_);
    std::swap(hidden_near_, fresh.hidden_near_);
    std::swap(outputs_, fresh.outputs_);
    std::swap(trained_, fresh.trained_);
    std::swap(sums_, fresh.sums_);
    watch_ = fresh.watch_;  // a file may come with sensors that check each other, or without
}

// out: the lag whose state that of another file takes over: of several banks, that of the nearest
//      range; nullptr: there is none
const reference_box::lag *reference_box::ancestor_of(const lag &fresh) const {
    const lag *nearest = nullptr;
    const auto apart = [&fresh](const lag &was) {
        return std::fabs(was.min - fresh.min) + std::fabs(was.max - fresh.max);
    };
    for (const lag &was : lags_)
        if (was.key == fresh.key && (nearest == nullptr || apart(was) < apart(*nearest)))
            nearest = &was;
    return nearest;
}

// The same lag or direction goes on in its new place.
template <typename State>
void reference_box::adopt(reference_box &fresh, State &one, const State &was) const {
    const std::size_t of = one.of, to = one.to;
    one = was;
    one.of = of;
    one.to = to;
    if (to < fresh.signals_.size()) return;
    fresh.hidden_[to - fresh.signals_.size()] = hidden_[was.to - signals_.size()];
    fresh.hidden_near_[to - fresh.signals_.size()] = hidden_near_[was.to - signals_.size()];
}

void reference_box::start(bool has_state) {
    knows_ = true;
    has_state_ = has_state;
    watched_ns_ = 0;
    if (watch_) watch_->begin();
    for (auto &one : signals_) {
        if (one.known) one.at_ns = one.other_ns = one.before_ns = -never / 2;  // another daemon's
        one.known = false;
        one.velocity = one.velocity_near = one.doubt = 0;
    }
    for (auto &one : lags_) one.known = false;
    for (auto &one : plays_) one.known = false;
    std::fill(hidden_.begin(), hidden_.end(), unknown);
}

// out: whether the box takes a value, where it has its own roundings or time of the reading
static verdict verdict_of(double beyond, double near) {
    if (std::fabs(beyond) < near) return verdict::either;
    return beyond > 0 ? verdict::refused : verdict::taken;
}

verdict reference_box::judge_range(const signal &of, double value) {
    const double largest = std::max(std::fabs(of.min), std::fabs(of.max));
    const double beyond = std::max(value - of.max, of.min - value);
    return std::isnan(beyond) ? verdict::refused
                              : verdict_of(beyond - 2.5e-7 * largest, 3 * float_eps * largest);
}

// in : an accepted value, and its time
verdict reference_box::judge_rate(const signal &of, double change, time_ns apart_ns) {
    if (of.rate_per_s == 0) return verdict::taken;
    const double most = of.rate_per_s * seconds_of(apart_ns) + of.unit;
    return verdict_of(std::fabs(change) - most, 0.02 + 1e-3 * most);
}

// A value outside of its range, or faster than its rate since the last one, is refused.
void reference_box::accept(signal &of, double value, time_ns at) {
    verdict taken = judge_range(of, value);
    if (taken == verdict::refused) return;
    if (of.known) {
        const verdict slow = judge_rate(of, value - of.value, at - of.at_ns);
        // If the box has another past, both have to agree.
        if (of.doubt > 0 && judge_rate(of, value - of.other, at - of.other_ns) != slow)
            knows_ = false;
        if (slow == verdict::refused) return;
        if (slow == verdict::either) taken = slow;
    }
    const double was = of.doubt, change = of.known ? value - of.value : 0;
    if (taken == verdict::either && (!of.known || was > 0)) knows_ = false;
    of.doubt = taken == verdict::either ? std::fabs(change) : 0;
    if (of.known && of.leads) move(of, change, at, std::max(of.doubt, was));
    of.other = of.value;
    of.other_ns = taken == verdict::either ? of.at_ns : at;
    of.before = value - change;
    of.value = std::clamp(value, of.min, of.max);
    of.before_ns = of.known ? of.at_ns : -never / 2;
    of.at_ns = at;
    of.known = true;
}

// A velocity by two accepted values: filtered, and 0 behind three periods.
void reference_box::move(signal &of, double change, time_ns at, double doubt) const {
    constexpr time_ns stamped = ms / 2;  // between the request and the box's time of it
    const time_ns apart_ns = at - of.at_ns, longest_ns = 3 * period_ns_;
    if (apart_ns <= 0) return;
    const double by_clock = change / seconds_of(apart_ns);
    if (doubt > 0) {
        of.velocity += (by_clock - of.velocity) / 3;
        of.velocity_near +=
            std::fabs(of.velocity) + std::fabs(by_clock) + doubt / seconds_of(apart_ns);
        return;
    }
    if (counts_beats_ && of.at_ns == before_ns_ && apart_ns < longest_ns) {
        // Within a quarter of a change by the PLC's count it may be filtered too. Without a new
        // beat the position is the same, unless a sensor lies.
        if (beats_ == 0) {
            if (change != 0) of.velocity_near += std::fabs(of.velocity) + 2 * std::fabs(by_clock);
            // Where a beat is overdue, it may also be an axis that has stopped. The box has to
            // learn how long a beat takes.
            if (seconds_of(apart_ns) > 0.9 * scan_s_ || watched_ns_ < 2 * second)
                of.velocity_near += std::fabs(of.velocity);
            return;
        }
        const double by_beats = change / (static_cast<double>(beats_) * scan_s_);
        of.velocity = by_beats;
        of.velocity_near = 0.22 * std::max(std::fabs(by_beats), std::fabs(by_clock)) +
                           std::fabs(by_beats - by_clock);
        return;
    }
    const double jump = (by_clock - of.velocity) / 3;
    of.velocity += jump;
    of.velocity_near = 2.0 / 3 * of.velocity_near + 0.01 * std::fabs(jump);  // of the times
    if (apart_ns > longest_ns + stamped) of.velocity = of.velocity_near = 0;
    if (std::llabs(apart_ns - longest_ns) <= stamped) of.velocity_near += std::fabs(of.velocity);
}

void reference_box::read(const machine &of, const exchange &seen, time_ns sent) {
    const std::uint16_t beat = head_of(of, seen).heartbeat;
    beats_ = static_cast<std::uint16_t>(beat - std::exchange(beat_, beat));
    for (const fakeplc::shown_signal &shown : of.map.signals)
        accept(signals_[place_of(shown.name)], signal_in(of, shown, seen), sent);
    const time_ns apart_ns = sent - std::exchange(before_ns_, sent);
    if (apart_ns < second) watched_ns_ += apart_ns;
    for (signal &one : signals_) one.at_reading = one.known ? one.value : unknown;
    watch_sensors(sent);
    follow();
}

void reference_box::watch_sensors(time_ns now) {
    if (!watch_) return;
    std::vector<sensor_watch::reading> readings;
    for (const std::string &name : watch_->names()) {
        const signal &one = signals_[place_of(name)];
        // The box looks within its exchange.
        const bool fresh = one.known && now - one.other_ns <= one.max_age_ns - 17 * period_ns_ / 20;
        const bool stale = !one.known || now - one.at_ns > one.max_age_ns + ms;
        readings.push_back({one.known ? one.value : unknown,
                            one.doubt + 2 * float_eps * std::fabs(one.max), fresh, stale, one.min,
                            one.max});
    }
    watch_->look(now, readings);
}

void reference_box::sample(const std::string &name, double value, time_ns at) {
    accept(signals_[place_of(name)], value, at);
}

judged_number reference_box::lag_of(const std::string &key) const {
    const auto found =
        std::find_if(lags_.begin(), lags_.end(), [&key](const lag &one) { return one.key == key; });
    return {found->y, found->known ? found->near : 1e30};
}

// out: what its lags follow; of a doubted sensor what the others predict
judged_number reference_box::input_of(const signal &of) const {
    if (!of.watched || watch_->trusts(*of.watched)) return {of.value, of.doubt};
    const interval all =
        watch_->followed(*of.watched, {of.value, of.doubt, true, false, of.min, of.max});
    return {(all.low + all.high) / 2, all.width() / 2};
}

// out: the largest size of a signal; a lag may be one of a lag
double reference_box::largest_of(std::size_t place) const {
    for (const lag &one : lags_)
        if (one.to == place) return power_of(largest_of(one.of), one.power);
    return std::max(std::fabs(signals_[place].max), std::fabs(signals_[place].min));
}

// Lags and directions go on to the newest values.
void reference_box::follow() {
    for (lag &one : lags_) {
        const signal &of = signals_[one.of];
        if (!of.known || (one.known && of.at_ns == one.at_ns)) continue;
        const judged_number input = input_of(of);
        const double held = std::clamp(input.value, one.min, one.max);
        const double u = power_of(held, one.power);
        const double doubt = one.power == 1 ? input.near : 2 * largest_of(one.of) * input.near;
        one.before = one.known ? one.y : u;
        if (!one.known) {
            one.y = u;
            one.near = has_state_ ? 2 * power_of(largest_of(one.of), one.power) : 0;
        } else {
            const double dt_s = seconds_of(of.at_ns - one.at_ns);
            const double gain = -std::expm1(-dt_s / one.tau_s);
            one.y = lagged(one.y, one.u, u, dt_s, one.tau_s);
            constexpr double most_apart_s = 0.2;
            one.near += gain * (std::max(one.doubt, doubt) - one.near);
            // The box has its own time of a reading.
            one.near += std::fabs(u - one.u) * std::min(0.1, 1e-3 / one.tau_s);
            if (!of.from_plc)
                one.near += std::fabs(u - one.u) * std::min(1.0, most_apart_s / one.tau_s);
        }
        one.u = u;
        one.x = input.value;
        one.doubt = doubt;
        one.at_ns = of.at_ns;
        one.known = true;
        if (one.to >= signals_.size()) {
            hidden_[one.to - signals_.size()] = one.y;
            hidden_near_[one.to - signals_.size()] = 1e-5 + 1e-6 * std::fabs(one.y) + one.near;
            continue;
        }
        signal &to = signals_[one.to];
        to.value = to.before = one.y;
        to.at_ns = of.at_ns;
        to.doubt = one.near;
        to.other_ns = of.other_ns;
        to.max_age_ns = of.max_age_ns;
        to.known = true;
    }
    for (play &one : plays_) {
        const signal &of = signals_[one.of];
        double &b = hidden_[one.to - signals_.size()];
        double &near = hidden_near_[one.to - signals_.size()];
        if (!of.known) continue;
        if (of.doubt > 0) knows_ = false;
        const double moved = one.known ? b + 2 * (of.value - one.x) / one.width : 0;
        // Behind a whole reversal it is exact, until the next one.
        if (moved != b) near = std::fabs(moved) > 1 + one.near ? 0 : one.near;
        b = std::clamp(moved, -1.0, 1.0);
        one.x = of.value;
        one.known = true;
    }
}

// ---- what the channels want

// The PLC's velocity, as long as it is not too old; else that of the readings.
judged_number reference_box::velocity_of(const signal &of, time_ns now) const {
    const judged_number computed = {of.velocity, of.velocity_near};
    if (!of.reported) return computed;
    const signal &by = signals_[*of.reported];
    if (!by.known || now - by.at_ns > by.max_age_ns + ms) return computed;
    const judged_number given = {by.value / of.per_s, by.doubt / of.per_s};
    // The box looks within its exchange.
    if (now - by.other_ns <= by.max_age_ns - 17 * period_ns_ / 20) return given;
    const double of_times = 0.01 * std::fabs(computed.value);  // as in look(), for the other one
    return {given.value,
            given.near + computed.near + of_times + std::fabs(given.value - computed.value)};
}

void reference_box::look(time_ns now) {
    used_.clear();
    unsure_.clear();
    for (const signal &one : signals_) {
        // The box looks within its exchange, four fifths of a period behind the request.
        const std::optional<std::size_t> sensor = signals_[one.source].watched;
        const bool old = (sensor && !watch_->trusts(*sensor)) || !one.known ||
                         now - one.other_ns > one.max_age_ns - 17 * period_ns_ / 20;
        double value = old ? unknown : one.value;
        double near = 2 * float_eps * std::max(std::fabs(one.max), std::fabs(value)) + one.doubt;
        // The box looks ahead of readings of up to three periods.
        if (one.leads && 2 * (now - one.at_ns) <= 7 * period_ns_) {
            const judged_number velocity = velocity_of(one, now);
            const double speed = std::fabs(velocity.value);
            value = std::clamp(value + velocity.value * lead_s_, one.min, one.max);
            if (8 * (now - one.other_ns) > 17 * period_ns_) near += speed * lead_s_;
            near += speed * lead_unsure_s_ + 0.01 * speed * lead_s_;
            near += velocity.near * (lead_s_ + lead_unsure_s_);
        }
        if (!one.from_plc) near += 1e-3;  // a lag by the times of readings
        if (!one.from_plc && now - one.at_ns < one.waits_ns) {
            near += std::max(std::fabs(one.value - one.before),
                             std::fabs(one.value - one.at_reading));  // several may come since
            // Until the box takes the new one, it has the one before, if that is not too old.
            if (now - one.before_ns > one.max_age_ns - period_ns_) value = unknown;
        }
        used_.push_back(value);
        unsure_.push_back(near);
    }
    used_.insert(used_.end(), hidden_.begin(), hidden_.end());
    unsure_.insert(unsure_.end(), hidden_near_.begin(), hidden_near_.end());
    // Until the box takes a new sample, its lags are where the one before left them. It may have
    // taken one that came behind the reading.
    for (const lag &one : lags_) {
        const signal &of = signals_[one.of];
        if (of.from_plc || now - of.at_ns >= of.waits_ns) continue;
        unsure_[one.to] += std::fabs(one.y - one.before);
        if (one.known && one.at_ns != of.at_ns)
            unsure_[one.to] +=
                std::fabs(power_of(std::clamp(of.value, one.min, one.max), one.power) - one.y);
    }
}

double reference_box::sum_of(std::size_t channel, const values &at) const {
    double sum = 0;
    for (const function &output : sums_[channel]) sum += output(at);
    return sum;
}

const std::string *reference_box::beyond_training() const {
    for (const trained_input &one : trained_) {
        const double x = used_[one.place], near = unsure_[one.place] + 1e-5 * std::fabs(x);
        if (x > one.max + near || x < one.min - near) return &signals_[one.place].name;
    }
    return nullptr;
}

bool reference_box::may_lack_input(time_ns now) const {
    return std::any_of(signals_.begin(), signals_.end(), [this, now](const signal &one) {
        return one.known && now - one.other_ns > one.max_age_ns - 3 * period_ns_;
    });
}

bool reference_box::lacks_input(std::size_t channel, time_ns now) const {
    return lack_input(sums_[channel], now);
}

bool reference_box::lack_input(const std::vector<std::string> &outputs, time_ns now) const {
    return lack_input(functions_of(outputs), now);
}

bool reference_box::is_gone(const signal &one, time_ns now) const {
    return one.known && one.doubt == 0 && now - one.at_ns > one.max_age_ns + 3 * period_ns_;
}

bool reference_box::lack_input(const std::vector<function> &outputs, time_ns now) const {
    const auto is_old = [this, now](const signal &one) { return is_gone(one, now); };
    if (std::none_of(signals_.begin(), signals_.end(), is_old)) return false;  // as in most steps
    values all = used_;
    for (std::size_t i = 0; i < signals_.size(); ++i)
        if (std::isnan(all[i])) all[i] = signals_[i].value;
    values gone = all;
    for (std::size_t i = 0; i < signals_.size(); ++i)
        if (is_old(signals_[i])) gone[i] = unknown;
    return std::any_of(outputs.begin(), outputs.end(), [&all, &gone](const function &output) {
        return !std::isnan(output(all)) && std::isnan(output(gone));
    });
}

// in : value of a function of what the terms take
// out: how far the box's may be from it
template <typename Value>
double reference_box::most_change(double value, const Value &value_at) const {
    values at = used_;
    double sum = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
        if (!(unsure_[i] > 0) || std::isnan(at[i])) continue;
        const double there = at[i];
        at[i] = unknown;
        if (!std::isnan(value_at(at))) {  // it does not depend on it
            at[i] = there;
            continue;
        }
        double low = there - unsure_[i], high = there + unsure_[i], most = 0;
        if (i < signals_.size()) {  // the box holds it inside of its range
            low = std::clamp(signals_[i].min, low, there);
            high = std::clamp(signals_[i].max, there, high);
        }
        // Over a wide range curves have tops and valleys.
        const int places = unsure_[i] > 1 ? 32 : 4;
        for (int place = 0; place <= places; ++place) {
            at[i] = low + (high - low) * place / places;
            most = std::max(most, std::fabs(value_at(at) - value));
        }
        at[i] = there;
        sum += 1.2 * most;
    }
    return sum;
}

judged_number reference_box::judged_sum(const std::vector<function> &outputs) const {
    const auto sum_at = [&outputs](const values &at) {
        double sum = 0;
        for (const function &output : outputs) sum += output(at);
        return sum;
    };
    const double sum = sum_at(used_);
    if (std::isnan(sum)) return {unknown, 0};
    double near = 2e-3;
    for (const function &output : outputs) near += 2e-5 * std::fabs(output(used_));
    return {sum, near + most_change(sum, sum_at)};
}

judged_number reference_box::judged_slope(std::size_t channel, const std::string &by) const {
    constexpr double apart_mm = 0.01;
    const std::size_t x = place_of(by);
    // A reversal goes on with the way.
    const auto sum_at = [this, channel, x](values at, double way_mm) {
        at[x] += way_mm;
        for (const play &one : plays_)
            if (one.of == x && std::fabs(at[one.to]) < 1) at[one.to] += 2 * way_mm / one.width;
        return sum_of(channel, at);
    };
    const auto slope_at = [&sum_at](const values &at, double from_mm, double to_mm) {
        return -(sum_at(at, to_mm) - sum_at(at, from_mm)) / (to_mm - from_mm);
    };
    const double slope = slope_at(used_, -apart_mm, apart_mm);
    if (std::isnan(slope)) return {unknown, 0};
    // At a corner it is that of one of the two sides.
    const auto at_corner = [&slope_at](const values &at, double value) {
        return std::max(std::fabs(slope_at(at, -apart_mm, 0) - value),
                        std::fabs(slope_at(at, 0, apart_mm) - value));
    };
    const double near = 1e-5 + 1e-3 * std::fabs(slope) + at_corner(used_, slope);
    return {slope, near + most_change(0, [&](const values &at) { return at_corner(at, slope); })};
}

judged_number reference_box::judged_place(const std::string &of) const {
    const std::size_t x = place_of(of);
    return {used_[x], unsure_[x]};
}

judged_number reference_box::judged_um(std::size_t channel) const {
    const judged_number sum = judged_sum(sums_[channel]);
    return {-sum.value, sum.near};
}

std::vector<reference_box::function> reference_box::functions_of(
    const std::vector<std::string> &outputs) const {
    std::vector<function> found;
    for (const std::string &name : outputs) found.push_back(outputs_.at(name));
    return found;
}

judged_number reference_box::judged(const std::vector<std::string> &outputs) const {
    return judged_sum(functions_of(outputs));
}

std::optional<double> reference_box::newest(const std::string &name, time_ns at) const {
    const signal &of = signals_[place_of(name)];
    if (!of.known || of.at_ns != at || of.doubt > 0) return std::nullopt;
    return of.value;
}

}  // namespace compbox::world
