// SPDX-License-Identifier: MIT
#include "tests/world/machine.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host-tools/formats/json_type.h"

namespace compbox::world {

namespace {

constexpr int write_start = 100;
constexpr double longest_way_s = 40;  // of a slow channel from its limit to zero

// Rounded, so that the file shows what the invariants compare with.
double rounded(double value) {
    return std::stod(fmt::format("{:.4g}", value));
}

std::vector<std::string> axis_signals() {
    return {"X", "Y", "Z"};
}

struct draft {
    dice &chance;
    json root;
    machine &made;
    std::vector<std::string> outputs;  // of terms, for sums
    std::vector<std::string> lags;     // and sensors on wires of their own: other inputs
    int read_next = 8, write_next = write_start + 4;

    std::string profile() const { return made.profile.name; }
    bool is(const char *name) const { return made.profile.name == name; }

    void draw_plc() {
        const std::uint64_t drawn = chance.below(10);
        made.profile = *fakeplc::plc_profile::find(drawn < 5   ? "generic"
                                                   : drawn < 8 ? "sinumerik-840d"
                                                               : "fanuc");
        made.fc23 = !is("sinumerik-840d") && chance.one_in(2);
        const double period_ms = chance.one_in(2) ? 30.0 : rounded(chance.log_between(10, 100));
        made.period_us = std::llround(period_ms * 1000);
        made.port = 502;
        root["format"] = "compbox/1";
        root["revision"] = 1;
        root["machine"] = {{"name", "world"}, {"axes", axis_signals()}};
        root["cycle"]["period_ms"] = period_ms;
        if (chance.one_in(3))
            root["cycle"]["lead_ms"] = "measured";
        else if (chance.one_in(2))
            root["cycle"]["lead_ms"] = static_cast<double>(chance.below(100)) + part_of_ms();
        json &plc = root["plc"];
        plc["profile"] = profile();
        draw_transport(plc["transport"]);
        plc["exchange"] = made.fc23 ? "fc23" : "fc3+fc16";
        plc["control"] = 2;
        plc["plc_heartbeat"] = 1;
        plc["status"] = write_start + 1;
        plc["box_heartbeat"] = write_start + 2;
        if (chance.one_in(2)) plc["detail"] = write_start + 3;
        const auto timeout_ms = static_cast<std::uint64_t>(std::max(200.0, 4 * period_ms));
        plc["heartbeat_timeout_ms"] = timeout_ms;
        made.heartbeat_timeout_us = static_cast<std::int64_t>(timeout_ms) * 1000;
        if (chance.one_in(3)) plc["referenced_bits"] = {1u, 4u, 5u};
        if (is("fanuc") && chance.one_in(2)) plc["handshake"] = 3;
        if (is("fanuc") && chance.one_in(3)) plc["axes_at_once"] = true;
        dice own(made.twin.seed, "deadband");
        if (own.one_in(4)) plc["deadband_um"] = rounded(own.log_between(0.05, 5));
        if (!is("fanuc") && chance.one_in(4))
            plc["interpolate_ms"] = rounded(period_ms * std::min(chance.between(0.5, 1.2), 1.0));
    }

    // With dice of its own. out: 0 or less than 1
    double part_of_ms() const {
        dice own(made.twin.seed, "part of a ms");
        return own.one_in(2) ? rounded(own.between(0.001, 0.999)) : 0;
    }

    // A serial line needs a period that its exchange fits into.
    void draw_transport(json &transport) {
        if (made.period_us < 30000 || !chance.one_in(4)) {
            transport["tcp"] = {{"host", chance.one_in(4) ? "fd00::1" : "192.168.0.1"},
                                {"port", made.port}};
            return;
        }
        made.plc_device = "/dev/ttyS0";
        transport["rtu"] = {{"device", made.plc_device},
                            {"baud", made.period_us < 60000 ? 460800 : 230400}};
        if (chance.one_in(2)) transport["rtu"]["parity"] = "none";
    }

    // Modules on the box's own bus, and CANopen nodes.
    void draw_sensors() {
        for (std::uint64_t i = 0, count = chance.one_in(2) ? 1 + chance.below(3) : 0; i < count;
             ++i) {
            const std::string name = fmt::format("B{}", i + 1);
            root["signals"].push_back({{"name", name},
                                       {"unit", "degC"},
                                       {"bus", "pt100"},
                                       {"unit_id", first_module + i},
                                       {"register", 0},
                                       {"type", "int16"},
                                       {"scale", 0.1},
                                       {"min", -10},
                                       {"max", 90},
                                       {"max_age_ms", 5000}});
            made.modules.push_back(fmt::format("{}=20.0", first_module + i));
            lags.push_back(name);
        }
        if (!made.modules.empty())
            root["buses"].push_back({{"name", "pt100"},
                                     {"rtu", {{"device", "/dev/ttyS1"}, {"baud", 38400}}},
                                     {"every_ms", 200 + chance.below(500)}});
        for (std::uint64_t i = 0, count = chance.one_in(2) ? 1 + chance.below(3) : 0; i < count;
             ++i)
            draw_node(static_cast<int>(i) + 1);
    }

    void draw_node(int number) {
        can_node node;
        node.number = number;
        node.starts_itself = chance.one_in(2);
        node.every = chance.time_between(50, 500) * ms;
        draw_identifiers(node);
        made.nodes.push_back(node);
        const std::string name = fmt::format("C{}", number);
        root["signals"].push_back({{"name", name},
                                   {"unit", "degC"},
                                   {"can", node.id_text(false)},
                                   {"type", "int16le"},
                                   {"scale", 0.1},
                                   {"min", -10},
                                   {"max", 90}});
        const bool start = !node.starts_itself || chance.one_in(2);
        json entry = {{"node", number}, {"start", start}};
        if (!start || chance.one_in(2)) entry["heartbeat_timeout_ms"] = 1000;
        made.nodes.back().supervised = start && entry.contains("heartbeat_timeout_ms");
        made.nodes.back().watched = entry.contains("heartbeat_timeout_ms");
        dice beats(made.twin.seed + static_cast<std::uint64_t>(number), "heartbeats");
        if (!made.nodes.back().watched && beats.one_in(2)) made.nodes.back().heartbeat = 0;
        root["can"]["nodes"].push_back(entry);
        lags.push_back(name);
    }

    // With dice of its own: the other draws stay what they are.
    void draw_identifiers(can_node &node) const {
        dice own(made.twin.seed + static_cast<std::uint64_t>(node.number), "CAN identifiers");
        using id_format = can_node::id_format;
        if (own.one_in(2)) return;
        node.format =
            own.one_of(std::vector{id_format::bits_11, id_format::bits_29, id_format::any_source});
        node.has_double = node.format != id_format::any_source;
    }

    // Blocks end behind what was laid out; their counters are the first and the last register.
    void close_blocks(bool read_counters, bool write_counters) {
        json &plc = root["plc"];
        plc["read"] = {{"start", 0}, {"count", read_next + 1}, {"counters", read_counters}};
        plc["write"] = {{"start", write_start},
                        {"count", write_next - write_start + 1},
                        {"counters", write_counters}};
    }

    void widen_block(const char *name, int next) {
        json &block = root["plc"][name];
        block["count"] = next - block["start"].get<int>() + 1;
    }

    int next_read(int registers) { return std::exchange(read_next, read_next + registers); }
    int next_write(int registers) { return std::exchange(write_next, write_next + registers); }

    void draw_axes() {
        for (std::size_t a = 0; a < 3; ++a) {
            twin::twin_axis &axis = made.twin.axes[a];
            axis.present = true;
            axis.max_mm = std::round(chance.log_between(300, 10000));
            axis.max_velocity_mm_per_s = rounded(chance.log_between(50, 1000));
            axis.acceleration_mm_per_s2 = 2 * axis.max_velocity_mm_per_s;
            made.twin.start_mm[a] = axis.max_mm / 2;
            json signal = {{"name", axis_signals()[a]}, {"unit", "mm"}};
            const bool real = chance.one_in(3);
            signal["plc"] = next_read(2);
            signal["type"] = real ? "float32" : "int32";
            if (!real) signal["scale"] = 0.0001;
            signal["min"] = -10;
            signal["max"] = axis.max_mm + 10;
            root["signals"].push_back(signal);
        }
    }

    void draw_temperatures() {
        for (std::uint64_t i = 0, count = 1 + chance.below(4); i < count; ++i) {
            const std::string name = fmt::format("T{}", i + 1);
            json signal = {{"name", name},        {"unit", "degC"},
                           {"plc", next_read(1)}, {"type", "int16"},
                           {"scale", 0.1},        {"min", -10},
                           {"max", 90},           {"essential", chance.one_in(4)}};
            if (chance.one_in(3)) {
                signal["max_rate_per_s"] = 5;
                made.rated.push_back(name);
            }
            if (chance.one_in(3)) signal["max_age_ms"] = 1000 + chance.below(5000);
            root["signals"].push_back(signal);
            made.temperatures.push_back(name);
            made.twin.signals[name] = rounded(chance.between(15, 30));
            if (!chance.one_in(2)) continue;
            root["signals"].push_back({{"name", name + "_lag"},
                                       {"unit", "degC"},
                                       {"lag_of", name},
                                       {"tau_s", rounded(chance.log_between(5, 3000))}});
            dice own(made.twin.seed + lags.size(), "short lag");
            if (own.one_in(3)) root["signals"].back()["tau_s"] = rounded(own.log_between(0.005, 5));
            lags.push_back(name + "_lag");
        }
    }

    static std::vector<double> values_of(dice &from, std::size_t count, double most) {
        std::vector<double> drawn;
        for (std::size_t i = 0; i < count; ++i) drawn.push_back(rounded(from.between(-most, most)));
        return drawn;
    }
    std::vector<double> values(std::size_t count, double most) {
        return values_of(chance, count, most);
    }

    std::string random_axis() { return axis_signals()[chance.below(3)]; }
    double travel_of(const std::string &axis) const {
        return made.twin.axes[static_cast<std::size_t>(twin::axis_index(axis[0]))].max_mm;
    }
    std::string any_temperature() {
        if (!lags.empty() && chance.one_in(2)) return chance.one_of(lags);
        return chance.one_of(made.temperatures);
    }

    void add_term(json term) {
        outputs.push_back(term["name"]);
        root["terms"].push_back(std::move(term));
    }

    void add_polyline(const std::string &name) {
        const std::string axis = random_axis();
        const std::size_t points = 2 + chance.below(20);
        std::vector<double> positions;
        for (std::size_t i = 0; i < points; ++i)
            positions.push_back(rounded(travel_of(axis) * static_cast<double>(i) /
                                        static_cast<double>(points - 1)));
        json term = {{"name", name},
                     {"type", "polyline"},
                     {"signal", axis},
                     {"positions", positions},
                     {"values", values(points, 30)}};
        if (chance.one_in(3)) {
            term["backward"] = {{"positions", positions}, {"values", values(points, 30)}};
            // Some so wide that an axis is within it for a while.
            const double times = dice(made.twin.seed, "reversal " + name).one_in(3) ? 20 : 1;
            term["reversal_mm"] = rounded(times * chance.log_between(0.01, 10));
        }
        add_term(term);
    }

    // Over an axis, or over a temperature, which may be missing while the box is ACTIVE.
    void add_bspline(const std::string &name) {
        constexpr double warmest = 50;
        dice own(made.twin.seed, "spline " + name);
        const std::string axis = random_axis();
        const bool by_warmth = own.one_in(4);
        const std::string signal = by_warmth ? own.one_of(made.temperatures) : axis;
        const double end = by_warmth ? warmest : travel_of(axis);
        const std::size_t count = 4 + chance.below(10);
        std::vector<double> knots(4, 0.0);
        for (std::size_t i = 1; i + 3 < count; ++i)
            knots.push_back(rounded(end * static_cast<double>(i) / static_cast<double>(count - 3)));
        knots.insert(knots.end(), 4, end);
        add_term({{"name", name},
                  {"type", "bspline"},
                  {"signal", signal},
                  {"degree", 3},
                  {"knots", knots},
                  {"control_points", values(count, 30)}});
    }

    // The same temperature twice makes a bank: of lags, or of the temperature and its square.
    void add_linear(const std::string &name, double most) {
        std::vector<std::string> inputs = {any_temperature()};
        const std::string other = any_temperature();
        if (other != inputs[0]) inputs.push_back(other);
        const std::vector<double> weights = values(inputs.size(), most);
        const double constant = rounded(chance.between(-most, most));
        if (inputs.size() == 1) return add_bank(name, inputs[0], weights[0], constant);
        add_term({{"name", name},
                  {"type", "linear"},
                  {"inputs", inputs},
                  {"weights", weights},
                  {"constant", constant}});
    }

    std::vector<double> taus_of_bank() {
        dice own(made.twin.seed + outputs.size(), "taus");
        if (own.one_in(2)) return {0, 20, 900};
        return {0, rounded(own.log_between(0.02, 2)), rounded(own.log_between(3, 60))};
    }

    void add_bank(const std::string &name, const std::string &input, double weight, double bias) {
        const bool lagged = name.back() % 2 == 0;
        const std::vector<double> taus = lagged ? taus_of_bank() : std::vector<double>{0};
        std::vector<double> row(taus.size(), weight / static_cast<double>(taus.size()));
        row.insert(row.end(), taus.size(), weight * 1e-3);
        json term = {{"name", name},
                     {"type", "linear"},
                     {"bank",
                      {{"inputs", json::array({input})},
                       {"powers", {{input, json::array({1, 2})}}},
                       {"tau_s", taus},
                       {"weights", json::array({row})},
                       {"bias", json::array({bias})}}}};
        if (weight > 0) {  // its sigma, along the weights and along each column alike
            dice own(made.twin.seed + outputs.size(), "floor");
            term["sigma"] = {
                {"floor_um", json::array({rounded(own.log_between(0.3, 300))})},
                {"along_um", json::array({std::fabs(weight)})},
                {"offsets", json::array({-0.5, bias})},
                {"directions", json::array({row, std::vector<double>(row.size(), 0.1)})}};
        }
        add_term(term);
    }

    void add_product(const std::string &name) {
        const std::string axis = random_axis();
        add_linear(name + "_tan", 5.0 / travel_of(axis));
        const std::string slope = outputs.back();
        outputs.pop_back();  // µm/mm is not for a sum
        add_term({{"name", name},
                  {"type", "product"},
                  {"signal", axis},
                  {"term", slope},
                  {"origin", std::round(travel_of(axis) / 2)}});
    }

    void add_network(const std::string &name) {
        const std::string axis = random_axis();
        const std::size_t hidden = 1 + chance.below(6);
        std::vector<std::vector<double>> rows;
        for (std::size_t i = 0; i < hidden; ++i) rows.push_back(values(2, 2));
        add_term({{"name", name},
                  {"type", "bpnet"},
                  {"outputs", {name}},
                  {"inputs", {axis, made.temperatures[0]}},
                  {"activation", chance.one_in(2) ? "tansig" : "logsig"},
                  {"hidden_weights", rows},
                  {"hidden_bias", values(hidden, 1)},
                  {"output_weights", std::vector<std::vector<double>>{values(hidden, 10)}},
                  {"output_bias", values(1, 10)},
                  {"input_center", {travel_of(axis) / 2, 22}},
                  {"input_scale", {travel_of(axis) / 2, 10}},
                  {"input_min", {0, 12}},
                  {"input_max", {travel_of(axis), 35}}});
        root["terms"].back().erase("name");
        root["terms"].back()["name"] = name + "_net";
    }

    void draw_terms() {
        const std::uint64_t count = 1 + chance.below(6);
        for (std::uint64_t i = 0; i < count; ++i) {
            const std::string name = fmt::format("E{}", i);
            switch (chance.below(5)) {
                case 0:
                    add_polyline(name);
                    break;
                case 1:
                    add_bspline(name);
                    break;
                case 2:
                    add_linear(name, 2);
                    break;
                case 3:
                    add_product(name);
                    break;
                default:
                    add_network(name);
                    break;
            }
        }
    }

    std::string channel_type() {
        const std::uint64_t drawn = chance.below(3);
        if (is("fanuc")) return drawn == 0 ? "int16" : "int32";
        return drawn == 0 ? "int16" : drawn == 1 ? "int32" : "float32";
    }

    // in : share of a register's range. out: scale of the channel, µm
    double channel_scale(const std::string &type, double limit_um) {
        if (is("fanuc")) return limit_um < 90 ? 0.01 : 0.1;
        if (type == "int16") return limit_um < 300 ? 0.01 : 0.1;
        return type == "float32" ? 1.0 : chance.one_in(2) ? 0.01 : 0.001;
    }

    json channel(const std::string &name, const std::string &type, double limit_um) {
        channel_facts facts;
        facts.name = name;
        facts.limit_um = limit_um;
        const double scale = channel_scale(type, limit_um);
        facts.unit_um = type == "float32" ? 0 : scale;
        const double least =
            std::max(made.ramp_um_per_s, 1.5e6 * scale / static_cast<double>(made.period_us));
        facts.slew_um_per_s = rounded(least * chance.log_between(1, 20));
        json made_channel = {
            {"name", name},
            {"limit_um", limit_um},
            {"error_um", made.demands_fit ? 1e5 : rounded(limit_um * chance.log_between(1.01, 5))},
            {"slew_um_per_s", facts.slew_um_per_s},
            {"plc", next_write(type == "int16" ? 1 : 2)},
            {"type", type},
            {"scale", scale}};
        if (chance.one_in(3)) made_channel["deadband_um"] = rounded(limit_um * 0.01);
        if (chance.one_in(2)) made_channel["sign"] = facts.sign = -1;
        for (const auto &output : outputs) {
            if (made_channel.contains("sum") && !chance.one_in(2)) continue;
            made_channel["sum"].push_back(output);
        }
        facts.error_um = made_channel["error_um"];
        made.channels.push_back(facts);
        return made_channel;
    }

    void add_applied(json &entry) {
        made.channels.back().has_applied = true;
        entry["applied"] = next_read(entry["type"] == "int16" ? 1 : 2);
    }

    void add_tangent(json &entry, const std::string &axis) {
        const double limit = rounded(chance.log_between(1e-5, 1e-3));
        entry["tangent"] = {{"signal", axis},
                            {"slope_plc", next_write(2)},
                            {"slope_type", "int32"},
                            {"slope_scale", 1e-9},
                            {"slope_limit", limit},
                            {"slope_slew_per_s", rounded(limit * chance.between(1, 10))},
                            {"reference_plc", next_write(2)},
                            {"reference_type", "int32"},
                            {"reference_scale", 0.001}};
    }

    void draw_pair() {
        const std::string type = channel_type();
        const double limit_um = rounded(chance.log_between(20, 300));
        const bool applied = !chance.one_in(3);
        for (const char *name : {"Y1", "Y2"}) {
            json entry = channel(name, type, limit_um);
            if (applied) add_applied(entry);
            root["channels"].push_back(entry);
            made.twin.channels[name] = 'Y';
        }
        const double most = rounded(
            std::max(2.5 * made.channels.back().unit_um, limit_um * chance.log_between(0.02, 1)));
        const std::size_t last = made.channels.size() - 1;
        made.pairs.push_back({last - 1, last, most});
        dice own(made.twin.seed, "limits of a pair");
        const std::size_t lower = last - own.below(2);
        if (own.one_in(3)) {
            const double lower_um = rounded(limit_um * own.between(0.2, 0.9));
            made.channels[lower].limit_um = lower_um;
            root["channels"][lower]["limit_um"] = lower_um;
        }
        root["pairs"].push_back({{"channels", {"Y1", "Y2"}}, {"max_difference_um", most}});
    }

    void draw_channels(bool counters) {
        made.ramp_um_per_s = rounded(chance.log_between(20, 500));
        made.demands_fit = !chance.one_in(4);
        made.hold_us = static_cast<std::int64_t>(chance.below(3000)) * 1000;
        root["safety"] = {{"hold_ms", made.hold_us / 1000}, {"ramp_um_per_s", made.ramp_um_per_s}};
        for (const char *name : {"X", "Z"}) {
            if (name[0] == 'Z' && chance.one_in(3)) continue;
            const double largest = made.demands_fit ? 500 : 60;  // some demands are far beyond
            json entry =
                channel(name, channel_type(), rounded(chance.log_between(largest / 25, largest)));
            if (!chance.one_in(3)) add_applied(entry);
            const bool follows = counters && !is("fanuc");
            if (follows && !chance.one_in(4)) add_tangent(entry, name);
            root["channels"].push_back(entry);
        }
        if (chance.one_in(2)) draw_pair();
    }

    // Drawn behind all else: the machines that it leaves alone stay as they are. Slew rates below
    // the ramp, as far as a step still moves units.
    void draw_slow_channels() {
        dice own(made.twin.seed, "slow channels");
        if (!own.one_in(4)) return;
        for (std::size_t c = 0; c < made.channels.size(); ++c) {
            channel_facts &facts = made.channels[c];
            const double least = 1.5e6 * facts.unit_um / static_cast<double>(made.period_us);
            facts.slew_um_per_s =
                rounded(std::max({least, facts.limit_um / longest_way_s,
                                  made.ramp_um_per_s * own.log_between(0.02, 1.0)}));
            root["channels"][c]["slew_um_per_s"] = facts.slew_um_per_s;
        }
    }

    // Likewise: a control that takes small steps alone. A full way still has its time.
    void draw_largest_step() {
        if (!is("fanuc")) return;
        dice own(made.twin.seed, "largest steps");
        constexpr double most = 9998;
        double least = 5e6 / static_cast<double>(made.period_us);
        for (const channel_facts &channel : made.channels)
            least = std::max(least, 3 * channel.limit_um / channel.unit_um / longest_way_s);
        made.step_units = most;
        if (!own.one_in(2) || least > most) return;
        made.step_units = std::floor(own.log_between(least, most));
        root["plc"]["max_step_units"] = std::llround(made.step_units);
    }

    // Likewise: an axis without a position takes its terms and slopes away, and the others go on.
    void draw_spare_axes() {
        dice own(made.twin.seed, "spare axes");
        if (!own.one_in(3)) return;
        std::set<std::string> followed;
        for (const json &channel : root["channels"])
            if (channel.contains("tangent")) followed.insert(channel["tangent"]["signal"]);
        for (json &signal : root["signals"])
            if (signal.contains("plc") && signal["unit"] == "mm" &&
                (followed.count(signal["name"]) > 0 || own.one_in(2)))
                signal["essential"] = false;
    }

    // Likewise: temperatures of most machines hardly move within a run. Some show what lags and
    // models make of those that do.
    void draw_wandering() {
        dice own(made.twin.seed, "wandering");
        if (!own.one_in(3)) return;
        made.models_fade = true;
        made.wanders_k = own.log_between(0.1, 2);
    }

    // Likewise: a cold hall, with temperatures on both sides of zero and far from all training.
    void draw_cold() {
        dice own(made.twin.seed, "cold");
        if (!own.one_in(6)) return;
        made.models_fade = made.is_cold = true;
        for (const std::string &name : made.temperatures)
            made.twin.signals[name] = rounded(own.between(-4, 8));
    }

    // Likewise: channel X gets a term that adapts one of its sum, by a probe whose value may be not
    // a number.
    void draw_probe() {
        dice own(made.twin.seed, "probe");
        if (!own.one_in(4)) return;
        json &sum = root["channels"][0]["sum"];
        const std::size_t term = own.below(sum.size());
        const bool real = own.one_in(2);
        json value = {{"name", "probe_x"},
                      {"unit", "um"},
                      {"plc", next_read(2)},
                      {"min", -500},
                      {"max", 500},
                      {"type", real ? "float32" : "int32"},
                      {"scale", real ? 1.0 : 0.01}};
        json count = {{"name", "probe_x_n"}, {"unit", "1"},     {"plc", next_read(1)}, {"min", 0},
                      {"max", 65535},        {"type", "uint16"}};
        root["signals"].push_back(value);
        root["signals"].push_back(count);
        count["name"] = other_probe_count;
        count["plc"] = next_read(1);
        root["signals"].push_back(count);
        root["terms"].push_back({{"name", "adapted"},
                                 {"type", "adapt"},
                                 {"of", sum[term]},
                                 {"probe", {{"value", "probe_x"}, {"count", "probe_x_n"}}},
                                 {"bias_max_um", rounded(own.log_between(1, 50))},
                                 {"gain_max", rounded(own.between(0, 1))},
                                 {"step_max_um", rounded(own.log_between(0.1, 50))},
                                 {"drift_um_per_sqrt_h", rounded(own.log_between(0.1, 1000))},
                                 {"gain_drift_per_sqrt_h", rounded(own.log_between(0.01, 10))},
                                 {"sigma_um", rounded(own.log_between(0.1, 20))},
                                 {"min_interval_s", own.one_in(2) ? 0.0 : own.between(0, 60)}});
        if (own.one_in(3)) root["terms"].back()["measures"] = "whole";
        sum[term] = "adapted";
        root["plc"]["request"] = next_write(1);
        widen_block("read", read_next);
        widen_block("write", write_next);
    }

    // Likewise: networks whose training range is a part of the travel, so that both inputs are
    // beyond it at times, by other margins and fades.
    void draw_narrow_ranges() {
        dice own(made.twin.seed, "narrow ranges");
        for (auto &term : root["terms"]) {
            if (term["type"] != "bpnet" || !own.one_in(3)) continue;
            made.models_fade = true;
            const double travel = travel_of(term["inputs"][0]);
            term["input_min"] = {rounded(0.3 * travel), rounded(own.between(15, 22))};
            term["input_max"] = {rounded(0.6 * travel),
                                 term["input_min"][1].get<double>() + rounded(own.between(1, 5))};
            if (own.one_in(2)) term["margin"] = {rounded(0.02 * travel), 0.5};
            if (own.one_in(2)) term["fade"] = {rounded(0.4 * travel), rounded(own.between(2, 20))};
        }
    }

    // Likewise: banks with lags, whose input leaves the training range at times.
    void draw_bank_ranges() {
        dice own(made.twin.seed, "bank ranges");
        for (auto &term : root["terms"]) {
            if (!term.contains("bank") || term["bank"]["tau_s"].size() < 2 ||
                term.contains("sigma") || !own.one_in(2))
                continue;
            made.models_fade = true;
            const double least = rounded(own.between(15, 25));
            term["bank"]["input_min"] = {least};
            term["bank"]["input_max"] = {rounded(least + own.between(0.5, 5))};
            if (own.one_in(2)) term["bank"]["margin"] = {0.5};
            if (own.one_in(2)) term["bank"]["fade"] = {rounded(own.between(2, 20))};
        }
    }

    // Likewise: some positions are used for longer than the box looks ahead of them.
    void draw_position_ages() {
        dice own(made.twin.seed, "position ages");
        if (!own.one_in(4)) return;
        const double period_ms = 1e-3 * static_cast<double>(made.period_us);
        for (auto &signal : root["signals"])
            if (signal["unit"] == "mm" && signal.contains("plc"))
                signal["max_age_ms"] = std::llround(period_ms * own.log_between(4, 40));
    }

    // Likewise: networks and banks with two outputs, networks with a linear path and a scale of
    // their outputs. Another channel takes the second output.
    void draw_second_outputs() {
        dice of_most(made.twin.seed, "second outputs");
        dice of_sigma(made.twin.seed, "second outputs with sigma");
        for (auto &term : root["terms"]) {
            const bool is_net = term["type"] == "bpnet";
            dice &own = term.contains("sigma") ? of_sigma : of_most;
            if (is_net && own.one_in(3)) {
                term["linear_weights"] = {values_of(own, 2, 5)};
                term["output_center"] = values_of(own, 1, 5);
                term["output_scale"] = {rounded(own.between(0.3, 1.5))};
            }
            if (!(is_net || term.contains("bank")) || !own.one_in(2) ||
                parts_of_terms().count(term["name"]) > 0)
                continue;
            const std::string first = is_net ? term["outputs"][0] : term["name"];
            term["name"] = first + "_two";
            term["outputs"] = {first, first + "b"};
            if (is_net) {
                widen_network(term, own);
            } else {
                json &bank = term["bank"];
                json row;
                for (const double weight : bank["weights"][0])
                    row.push_back(rounded(weight * own.between(-1, 1)));
                bank["weights"].push_back(row);
                bank["bias"].push_back(rounded(own.between(-5, 5)));
            }
            if (term.contains("sigma"))
                for (const char *of : {"floor_um", "along_um"})
                    term["sigma"][of].push_back(rounded(own.log_between(0.3, 30)));
            root["channels"][own.below(root["channels"].size())]["sum"].push_back(first + "b");
        }
    }
    void widen_network(json &net, dice &own) const {
        const std::size_t hidden = net["hidden_bias"].size();
        net["output_weights"].push_back(values_of(own, hidden, 5));
        net["output_bias"].push_back(rounded(own.between(-5, 5)));
        if (!net.contains("linear_weights")) return;
        net["linear_weights"].push_back(values_of(own, 2, 5));
        net["output_center"].push_back(rounded(own.between(-5, 5)));
        net["output_scale"].push_back(rounded(own.between(0.3, 1.5)));
    }

    // out: the sensors of module and CAN bus; without any these
    std::vector<std::string> wired_or(const std::vector<std::string> &others) const {
        std::vector<std::string> names;
        for (const std::string &name : lags)
            if (name[0] == 'B' || name[0] == 'C') names.push_back(name);
        return names.empty() ? others : names;
    }

    // Likewise: curves whose breaks are not uniform. A span is computed where each break is near
    // its uniform place, and searched for otherwise.
    void draw_uneven_breaks() {
        dice own(made.twin.seed, "uneven breaks");
        for (auto &term : root["terms"]) {
            if (own.one_in(2)) continue;
            if (term["type"] == "bspline") shift_breaks(term["knots"], own);
            if (term["type"] != "polyline" || term["name"] == "by_hand") continue;
            shift_breaks(term["positions"], own);
            if (term.contains("backward")) shift_breaks(term["backward"]["positions"], own);
        }
    }
    // in : uniform breaks from 0 on, the ends any number of times
    static void shift_breaks(json &breaks, dice &own) {
        const double end = breaks.back();
        const std::set<double> all(breaks.begin(), breaks.end());
        const double apart = end / static_cast<double>(all.size() - 1);
        const bool is_near = own.one_in(2);
        // The middle of the others is a quarter of all off, or about one or two places.
        const double spans = static_cast<double>(all.size() - 1), few = own.between(0.8, 2.2);
        const double off = own.one_in(2) ? std::min(few, spans / 5) : -spans / 4;
        for (json &one : breaks) {
            const double at = one;
            if (!(at > 0 && at < end)) continue;
            const double bend = off * 4 * at * (end - at) / (end * end);
            one = rounded(at + apart * (is_near ? own.between(-0.45, 0.45) : bend));
        }
    }

    // Likewise: more networks and banks over an axis whose tangent the PLC follows, with ranges
    // that it leaves.
    void draw_followed_models() {
        dice own(made.twin.seed, "followed models");
        for (auto &channel : root["channels"]) {
            if (!channel.contains("tangent")) continue;
            const std::string axis = channel["tangent"]["signal"];
            if (own.one_in(3)) draw_bank_along(channel, axis, own);
            for (auto &term : root["terms"]) {
                if (term.contains("fade") || !own.one_in(2)) continue;
                if (term["type"] == "bpnet" && term["inputs"][0] == axis)
                    narrow_by_axis(term, own);
                else if (term.contains("bank") && !term.contains("sigma") &&
                         !term["bank"].contains("input_min") &&
                         !term["bank"]["powers"].contains(axis) &&
                         parts_of_terms().count(term["name"]) == 0) {
                    widen_bank_by_axis(term["bank"], axis, own);
                    add_to_sum(channel, outputs_of(term)[0]);
                }
            }
        }
    }
    void draw_bank_along(json &channel, const std::string &axis, dice &own) {
        const std::string name = "along_" + channel["name"].get<std::string>();
        const std::string input = own.one_of(wired_or(made.temperatures));
        const std::vector<double> taus = taus_of_bank();
        const std::vector<double> row(taus.size(), rounded(own.between(-0.3, 0.3)));
        json bank = {{"inputs", json::array({input})},
                     {"powers", {{input, json::array({1})}}},
                     {"tau_s", taus},
                     {"weights", json::array({row})},
                     {"bias", json::array({rounded(own.between(-5, 5))})}};
        widen_bank_by_axis(bank, axis, own);
        root["terms"].push_back({{"name", name}, {"type", "linear"}, {"bank", bank}});
        add_to_sum(channel, name);
    }
    static void add_to_sum(json &channel, const json &output) {
        json &sum = channel["sum"];
        if (std::find(sum.begin(), sum.end(), output) == sum.end()) sum.push_back(output);
    }
    void narrow_by_axis(json &net, dice &own) {
        const double travel = travel_of(net["inputs"][0]);
        made.models_fade = true;
        net["input_min"][0] = rounded(travel * own.between(0.1, 0.4));
        net["input_max"][0] = rounded(travel * own.between(0.5, 0.8));
        net["fade"] = {rounded(travel * own.between(0.1, 0.5)), rounded(own.between(2, 20))};
    }

    // Likewise: two banks with the same input and time constants, trained in other ranges.
    void draw_twin_banks() {
        dice own(made.twin.seed, "twin banks");
        for (const auto &term : root["terms"]) {
            if (!term.contains("bank") || term.contains("outputs") || term.contains("sigma") ||
                term["bank"]["tau_s"].size() < 2 || !own.one_in(3))
                continue;
            json twin = term;
            twin["name"] = term["name"].get<std::string>() + "_twin";
            json &bank = twin["bank"];
            const double least = rounded(own.between(5, 25));
            bank["input_min"] = bank["input_max"] = json::array();
            for (std::size_t i = 0; i < bank["inputs"].size(); ++i) {
                bank["input_min"].push_back(least);
                bank["input_max"].push_back(rounded(least + own.between(0.5, 5)));
            }
            for (const char *key : {"margin", "fade"}) bank.erase(key);
            bank["fade"] = json(bank["inputs"].size(), 40);
            made.models_fade = true;
            root["channels"][own.below(root["channels"].size())]["sum"].push_back(twin["name"]);
            root["terms"].push_back(twin);
            return;
        }
    }

    // Likewise: banks with another temperature, before or behind their own.
    void draw_wide_banks() {
        dice own(made.twin.seed, "wide banks");
        for (auto &term : root["terms"]) {
            if (!term.contains("bank") || term.contains("sigma") || !own.one_in(2)) continue;
            json &bank = term["bank"];
            // A sensor on a wire of its own has no value for a while.
            const std::string other = own.one_in(2) ? own.one_of(made.temperatures)
                                                    : own.one_of(wired_or(made.temperatures));
            if (other == bank["inputs"][0] || bank.contains("input_min")) continue;
            if (own.one_in(3) && parts_of_terms().count(term["name"]) == 0) {
                widen_bank_by_axis(bank, own.one_of(axis_signals()), own);
            } else {
                const bool before = own.one_in(2);
                widen_bank(bank, other, {rounded(own.between(-0.3, 0.3))}, before);
            }
        }
    }
    // Its slope has a part of each power.
    void widen_bank_by_axis(json &bank, const std::string &axis, dice &own) const {
        const double travel = travel_of(axis);
        const bool before = own.one_in(2);
        widen_bank(
            bank, axis,
            {rounded(own.between(-5, 5) / travel), rounded(own.between(-5, 5) / (travel * travel))},
            before);
    }
    // in : a weight for each power from 1 on, the same for each time constant
    static void widen_bank(json &bank, const std::string &input, const std::vector<double> &weights,
                           bool before) {
        bank["inputs"].insert(before ? bank["inputs"].begin() : bank["inputs"].end(), input);
        json columns;
        for (std::size_t power = 1; power <= weights.size(); ++power) {
            bank["powers"][input].push_back(power);
            for (std::size_t i = 0; i < bank["tau_s"].size(); ++i)
                columns.push_back(weights[power - 1]);
        }
        for (json &row : bank["weights"])
            row.insert(before ? row.begin() : row.end(), columns.begin(), columns.end());
    }
    // Terms that another term uses: for a product, where the output is µm/mm, or to adapt it.
    std::set<std::string> parts_of_terms() const {
        std::set<std::string> names;
        for (const auto &term : root["terms"])
            for (const char *key : {"term", "of"})
                if (term.contains(key)) names.insert(term[key].get<std::string>());
        return names;
    }

    // Likewise: polylines over the axis of a tangent. Some end within its travel, some differ by
    // direction.
    void draw_curves_of_tangents() {
        dice own(made.twin.seed, "curves of tangents");
        for (const auto &channel : root["channels"]) {
            if (!channel.contains("tangent") || !own.one_in(2)) continue;
            const json &sum = channel["sum"];
            for (auto &term : root["terms"])
                if (term["type"] == "polyline" && term["name"] != "by_hand" &&
                    std::find(sum.begin(), sum.end(), term["name"]) != sum.end())
                    lay_along(term, channel["tangent"]["signal"], own);
        }
    }
    void lay_along(json &term, const std::string &axis, dice &own) const {
        const double from = own.one_in(2) ? 0.0 : own.between(0.1, 0.4),
                     to = own.one_in(2) ? 1.0 : own.between(0.6, 0.9);
        std::vector<double> positions = term["positions"];
        const auto parts = static_cast<double>(positions.size() - 1);
        for (std::size_t i = 0; i < positions.size(); ++i)
            positions[i] =
                rounded(travel_of(axis) * (from + (to - from) * static_cast<double>(i) / parts));
        term["positions"] = positions;
        term["signal"] = axis;
        if (!own.one_in(3)) {
            term["backward"]["values"] = values_of(own, positions.size(), 30);
            term["reversal_mm"] = rounded(own.log_between(0.05, 20));
        }
        if (term.contains("backward")) term["backward"]["positions"] = positions;
    }

    // Likewise: two polylines with few breaks, the same but for the last. The box keeps breaks that
    // are the same once.
    void draw_shared_breaks() {
        dice own(made.twin.seed, "shared breaks");
        const auto is_curve = [](const json &term) {
            return term["type"] == "polyline" && term["name"] != "by_hand";
        };
        for (std::size_t i = 0; i < root["terms"].size(); ++i) {
            json &term = root["terms"][i];
            if (!is_curve(term) || !own.one_in(2)) continue;
            for (std::size_t k = 0; k < i; ++k) {
                json &other = root["terms"][k];
                if (!is_curve(other) || other["signal"] != term["signal"]) continue;
                const std::vector<double> all = other["positions"];
                if (all.size() < 6) continue;
                std::vector<double> breaks = {all.front(), all[all.size() / 3], all[all.size() / 2],
                                              all.back()};
                set_breaks(other, breaks, own);
                breaks.back() =
                    rounded(breaks[2] + own.between(0.2, 0.8) * (breaks[3] - breaks[2]));
                set_breaks(term, breaks, own);
                break;
            }
        }
    }
    static void set_breaks(json &term, const std::vector<double> &breaks, dice &own) {
        term["positions"] = breaks;
        term["values"] = values_of(own, breaks.size(), 30);
        if (!term.contains("backward")) return;
        term["backward"]["positions"] = breaks;
        term["backward"]["values"] = values_of(own, breaks.size(), 30);
    }

    // Likewise: some polylines become polynomials that end within the travel.
    void draw_polynomials() {
        dice own(made.twin.seed, "polynomials");
        for (auto &term : root["terms"]) {
            if (term["type"] != "polyline" || term.contains("backward") || !own.one_in(3)) continue;
            const double half = travel_of(term["signal"]) / 2;
            json made_term = {{"name", term["name"]},     {"type", "polynomial"},
                              {"signal", term["signal"]}, {"center", half},
                              {"half_range", half},       {"from", rounded(0.3 * half)},
                              {"to", rounded(1.6 * half)}};
            for (int k = 0; k < 5; ++k)
                made_term["coefficients"].push_back(rounded(own.between(-10, 10)));
            // Without an end it goes on as far as its signal.
            dice ends(made.twin.seed, term["name"].get<std::string>() + " ends");
            for (const char *end : {"from", "to"})
                if (ends.one_in(4)) made_term.erase(end);
            term = made_term;
        }
    }

    // Likewise: three errors of axes, brought to the tool tip by a volumetric term.
    void draw_volumetric() {
        dice own(made.twin.seed, "volumetric");
        if (!own.one_in(3)) return;
        static const std::vector<std::string> kinds = {"X", "Y", "Z", "A", "B", "C"};
        static const std::vector<std::string> chains = {"fXYZ", "YfXZ", "XYfZ", "ZfYX"};
        json term = {{"name", "volumetric"},
                     {"type", "volumetric"},
                     {"outputs", {"VX", "VY", "VZ"}},
                     {"chain", own.one_of(chains)},
                     {"tool_length_mm", std::round(own.between(0, 500))},
                     {"tool_offset_mm", {std::round(own.between(-500, 500)), 0, 100}},
                     {"squareness_urad",
                      {{"C0Y", rounded(own.between(-2, 2))},
                       {"B0Z", rounded(own.between(-2, 2))},
                       {"A0Z", rounded(own.between(-2, 2))}}}};
        for (const std::string &axis : axis_signals()) {
            const std::string error = "E" + own.one_of(kinds) + axis;
            json values;
            // Some are so large that their slopes count.
            const double most = dice(made.twin.seed, error + " size").one_in(3) ? 60 : 3;
            for (int k = 0; k < 3; ++k) values.push_back(rounded(own.between(-most, most)));
            const bool by_warmth = dice(made.twin.seed, error).one_in(4);  // which may be missing
            const double end = by_warmth ? 50 : travel_of(axis);
            root["terms"].push_back({{"name", error},
                                     {"type", "polyline"},
                                     {"signal", by_warmth ? made.temperatures[0] : axis},
                                     {"positions", {0, rounded(end / 2), end}},
                                     {"values", values}});
            term["errors"].push_back(error);
            term["reference_points_mm"][axis] = {0, std::round(own.between(-1000, 1000)), 0};
        }
        if (dice(made.twin.seed, "tool").one_in(2)) add_tool(term);
        root["terms"].push_back(term);
        for (auto &entry : root["channels"]) {
            const std::string name = entry["name"];  // X, Z, or Y1 and Y2
            entry["sum"].push_back("V" + name.substr(0, 1));
        }
    }
    // Its length by the PLC, which may be missing.
    void add_tool(json &volumetric) {
        volumetric.erase("tool_length_mm");
        volumetric["tool_length"] = "tool";
        root["signals"].push_back({{"name", "tool"},
                                   {"unit", "mm"},
                                   {"plc", next_read(1)},
                                   {"type", "int16"},
                                   {"scale", 0.1},
                                   {"min", -100},
                                   {"max", 1000},
                                   {"essential", false}});
        made.twin.signals["tool"] = 20;
        widen_block("read", read_next);
    }

    // Likewise: a term of what a person measures, and of how often.
    void draw_hand() {
        dice own(made.twin.seed, "hand");
        if (!own.one_in(4)) return;
        made.is_measured = true;
        root["signals"].push_back(
            {{"name", "H"}, {"unit", "um"}, {"hand", "H"}, {"min", -500}, {"max", 500}});
        root["signals"].push_back({{"name", "H_n"},
                                   {"unit", "1"},
                                   {"hand", "H"},
                                   {"part", "count"},
                                   {"min", 0},
                                   {"max", 65535}});
        root["terms"].push_back({{"name", "by_hand"},
                                 {"type", "linear"},
                                 {"inputs", {"H", "H_n"}},
                                 {"weights", {rounded(own.between(0.01, 0.05)), 0.1}}});
        root["channels"][0]["sum"].push_back("by_hand");
    }

    // Likewise: modules that take most of the time that the file gives them.
    void draw_slow_modules() {
        dice own(made.twin.seed, "slow modules");
        if (!root.contains("buses") || !own.one_in(3)) return;
        const std::int64_t longest_ms = own.time_between(10, 120);
        root["buses"][0]["rtu"]["slave_delay_ms"] = longest_ms;
        made.module_delay_ns = longest_ms * ms * 9 / 10;
    }

    // Likewise: modules with another thermometer, in the next register or behind a gap.
    void draw_thermometers() {
        dice own(made.twin.seed, "thermometers");
        for (std::size_t i = 0; i < made.modules.size(); ++i) {
            if (!own.one_in(3)) continue;
            const std::string name = fmt::format("B{}", i + 1);
            json other = *std::find_if(root["signals"].begin(), root["signals"].end(),
                                       [&name](const json &one) { return one["name"] == name; });
            other["name"] = name + "_2";
            other["register"] = 1 + own.below(2);
            root["signals"].push_back(other);
            made.modules[i] += ",20.0,20.0";
        }
    }

    // Likewise: modules that are read every few seconds, whose values last for three readings.
    void draw_rare_readings() {
        dice own(made.twin.seed, "rare readings");
        if (!root.contains("buses") || !own.one_in(3)) return;
        root["buses"][0]["every_ms"] = 1000 + own.below(4000);
        for (json &signal : root["signals"])
            if (signal.contains("bus")) signal.erase("max_age_ms");
    }

    // Likewise: slower and faster lines, and other parities.
    void draw_lines() {
        dice own(made.twin.seed, "lines");
        static const std::vector<unsigned> bauds = {9600, 19200, 38400, 115200};
        static const std::vector<std::string> parities = {"none", "even", "odd"};
        if (root.contains("buses") && own.one_in(2)) {
            root["buses"][0]["rtu"]["baud"] = own.one_of(bauds);
            root["buses"][0]["rtu"]["parity"] = own.one_of(parities);
        }
        json &transport = root["plc"]["transport"];
        if (transport.contains("rtu") && made.period_us >= 60000 && own.one_in(2))
            transport["rtu"]["baud"] = 115200;
    }

    // Likewise: temperatures that fall while their number rises, from a zero of their own.
    void draw_scales() {
        dice own(made.twin.seed, "scales");
        for (json &signal : root["signals"]) {
            if (!signal.contains("plc") || signal["type"] != "int16" || !own.one_in(3)) continue;
            signal["scale"] = -signal["scale"].get<double>();
            // On the grid of the finest ones, so that a least value does not lie between two
            // numbers.
            signal["zero"] = std::round(100 * own.between(-50, 50)) / 100;
        }
    }

    // Likewise: other names of the CAN interface, up to the longest one.
    void draw_interface() {
        dice own(made.twin.seed, "interface");
        static const std::vector<std::string> names = {"can1", "slcan0", "vcan.in-the-cab"};
        if (root.contains("can") && own.one_in(3)) root["can"]["interface"] = own.one_of(names);
    }

    // Likewise: a line to the PLC whose exchange takes most of its time, behind all that makes the
    // blocks longer. It has little time for repetitions, or none.
    void draw_slow_line() {
        dice own(made.twin.seed, "slow line");
        json &transport = root["plc"]["transport"];
        if (!transport.contains("rtu") || !own.one_in(2)) return;
        const int read = root["plc"]["read"]["count"], write = root["plc"]["write"]["count"];
        const double characters = 8 + 5 + 9 + 8 + 2 * std::max(read + write, read + read);
        std::vector<unsigned> fitting;
        for (const unsigned baud : {9600U, 19200U, 38400U, 57600U, 115200U, 230400U, 460800U}) {
            const double silence_s = baud > 19200 ? 1.75e-3 : 38.5 / baud;
            const double takes_s = 11 * characters / baud + 4 * silence_s + 2 * 2e-3;
            if (takes_s < 0.8e-6 * static_cast<double>(made.period_us)) fitting.push_back(baud);
        }
        if (!fitting.empty())
            transport["rtu"]["baud"] = fitting[own.one_in(2) ? 0 : own.below(fitting.size())];
    }

    // Likewise: other byte orders, of a PLC that may have any, and lags of squares.
    void draw_orders() {
        dice own(made.twin.seed, "orders");
        const bool any = is("generic") && own.one_in(3);
        const auto change = [&own](json &type) {
            const std::string name = type;
            if (name == "int32" || name == "float32") type = name + (own.one_in(2) ? "cdab" : "le");
            if (name == "int16" || name == "uint16") type = name + "le";
        };
        for (auto &signal : root["signals"]) {
            if (any && signal.contains("plc") && own.one_in(2)) change(signal["type"]);
            if (signal.contains("lag_of") && own.one_in(6)) signal["power"] = 2;
        }
        for (auto &entry : root["channels"])
            if (any && own.one_in(2)) change(entry["type"]);
    }

    // Likewise: numbers of 32 bits that have no sign, and begin below what they say. float32 has 24
    // of them.
    void draw_unsigned() {
        dice own(made.twin.seed, "unsigned");
        if (!own.one_in(4)) return;
        for (json &signal : root["signals"]) {
            const std::string type = signal.value("type", "");
            if (!signal.contains("plc") || type.rfind("int32", 0) != 0 || own.one_in(3)) continue;
            const double zero = std::floor(signal["min"].get<double>()) - 1;
            if (signal["max"].get<double>() - zero > 1.6e7 * signal.value("scale", 1.0)) continue;
            signal["type"] = "u" + type;
            signal["zero"] = zero;
        }
    }

    // Likewise: the PLC gives the velocities of some axes, which the box uses for its lead.
    void draw_velocities() {
        dice own(made.twin.seed, "velocities");
        if (!own.one_in(3)) return;
        const bool any = is("generic");
        static const std::vector<std::string> types = {"int32", "float32", "int32cdab",
                                                       "float32le"};
        for (std::size_t a = 0; a < 3; ++a) {
            const bool per_minute = own.one_in(2), lasts = own.one_in(3);
            const std::string type = types[own.below(any ? 4 : 2)];
            const double periods = own.log_between(1, 40);
            if (own.one_in(3)) continue;
            const double most =
                rounded(1.1 * made.twin.axes[a].max_velocity_mm_per_s * (per_minute ? 60 : 1));
            json signal = {{"name", "v" + axis_signals()[a]},
                           {"unit", per_minute ? "mm/min" : "mm/s"},
                           {"plc", next_read(2)},
                           {"type", type},
                           {"min", -most},
                           {"max", most}};
            if (type[0] == 'i') signal["scale"] = 0.001;
            if (lasts)
                signal["max_age_ms"] =
                    std::llround(1 + 1e-3 * static_cast<double>(made.period_us) * periods);
            root["signals"].push_back(signal);
            for (auto &position : root["signals"])
                if (position["name"] == axis_signals()[a]) position["velocity"] = signal["name"];
        }
        widen_block("read", read_next);
    }

    // Likewise: an axis in degrees, where nothing needs millimetres.
    void draw_rotary_axis() {
        dice own(made.twin.seed, "rotary axis");
        const std::string axis = own.one_of(axis_signals());
        if (!own.one_in(3) || needs_millimetres(axis)) return;
        for (json &signal : root["signals"]) {
            const std::string unit = signal["unit"];
            if (signal["name"] == axis || signal["name"] == "v" + axis)
                signal["unit"] = "deg" + unit.substr(2);
        }
    }
    // A tangent, and a direction of travel.
    bool needs_millimetres(const std::string &axis) const {
        const auto follows = [&axis](const json &channel) {
            return channel.contains("tangent") && channel["tangent"]["signal"] == axis;
        };
        const auto has_direction = [&axis](const json &term) {
            return term.contains("backward") && term["signal"] == axis;
        };
        return std::any_of(root["channels"].begin(), root["channels"].end(), follows) ||
               std::any_of(root["terms"].begin(), root["terms"].end(), has_direction);
    }

    // Likewise: thermometers of one place that check each other, and terms that use each of them.
    // They have a common temperature and an error of their own, and the section has the precision
    // of both.
    void draw_redundant() {
        dice own(made.twin.seed, "checks");
        if (!own.one_in(3)) return;
        constexpr double common = 3;
        const double threshold = rounded(own.between(6, 12)),
                     after_s = 0.5 * static_cast<double>(2 + own.below(5));
        dice low(made.twin.seed, "least of sensors");
        // What a PLC has before its first measurement must not round to less.
        const double least = low.one_in(2) ? -10 : rounded(std::round(low.between(2, 8)) - 0.004);
        json names, centers, precision;
        std::vector<double> weights;  // 1 / variance
        double sum = 1 / (common * common);
        for (std::uint64_t i = 0, count = 3 + own.below(5); i < count; ++i) {
            const bool real = own.one_in(3);
            json signal = {{"name", fmt::format("R{}", i + 1)},
                           {"unit", "degC"},
                           {"plc", next_read(real ? 2 : 1)},
                           {"type", real ? "float32" : "int16"},
                           {"min", least},
                           {"max", 90}};
            if (!real) signal["scale"] = 0.01;
            if (own.one_in(3)) signal["max_age_ms"] = 500 + own.below(3000);
            root["signals"].push_back(signal);
            names.push_back(signal["name"]);
            centers.push_back(rounded(own.between(18, 26)));
            weights.push_back(1 / std::pow(own.between(0.12, 0.2), 2));
            sum += weights.back();
        }
        for (std::size_t j = 0; j < weights.size(); ++j) {
            std::vector<double> row;
            for (std::size_t k = 0; k < weights.size(); ++k)
                row.push_back((j == k ? weights[j] : 0) - weights[j] * weights[k] / sum);
            made.redundant.push_back({names[j], centers[j], threshold / std::sqrt(row[j])});
            precision.push_back(row);
        }
        root["sensors"] = {{"signals", names},
                           {"center", centers},
                           {"precision", precision},
                           {"threshold", threshold},
                           {"after_s", after_s}};
        root["signals"].push_back({{"name", "R1_lag"},
                                   {"unit", "degC"},
                                   {"lag_of", "R1"},
                                   {"tau_s", rounded(own.log_between(5, 300))}});
        for (std::size_t first = 0; first < 2; ++first) {
            json term = {{"name", first == 0 ? "redundant" : "redundant_too"}, {"type", "linear"}};
            double constant = 0;
            for (std::size_t j = first; j < weights.size(); j += 2) {
                term["inputs"].push_back(j == 0 ? json("R1_lag") : names[j]);
                const double size = own.between(0.2, 1);
                term["weights"].push_back(rounded(own.one_in(2) ? -size : size));
                constant -= term["weights"].back().get<double>() * centers[j].get<double>();
            }
            term["constant"] = rounded(constant);
            if (first == 1) give_bank(term);
            root["terms"].push_back(term);
            for (auto &entry : root["channels"]) {
                const std::string name = entry["name"];
                if (name == "X" || (name == "Z" && own.one_in(2)))
                    entry["sum"].push_back(term["name"]);
            }
        }
        widen_block("read", read_next);
    }

    // in : a sum of signals
    // out: at one machine in two of their lags, and perhaps of themselves
    void give_bank(json &term) {
        dice own(made.twin.seed, "bank of sensors");
        if (!own.one_in(2)) return;
        const double share = own.one_in(2) ? 1 : 0.6;  // of the lag
        json powers, weights = json::array();
        for (const json &name : term["inputs"]) powers[name.get<std::string>()] = {1};
        for (const double weight : term["weights"]) {
            if (share < 1) weights.push_back(rounded((1 - share) * weight));
            weights.push_back(rounded(share * weight));
        }
        json taus_s = json::array({rounded(own.log_between(2, 60))});
        if (share < 1) taus_s.insert(taus_s.begin(), 0.0);
        term["bank"] = {{"inputs", term["inputs"]},
                        {"powers", powers},
                        {"tau_s", taus_s},
                        {"weights", json::array({weights})},
                        {"bias", json::array({term["constant"]})}};
        for (const char *key : {"inputs", "weights", "constant"}) term.erase(key);
    }

    // The PLC's own limits never act where the box keeps its own.
    void draw_control() {
        made.twin.machine = "world";
        made.twin.seed = chance.next();
        made.twin.nc.interpolation_s = chance.one_in(2) ? 0.004 : 0.008;
        made.twin.plc.scan_s = rounded(chance.between(0.008, 0.020));
        made.twin.plc.size_um = 2000;
        made.twin.plc.slope_um_per_s = 1e5;
        made.twin.plc.watchdog_s = std::max(0.3, 6e-6 * static_cast<double>(made.period_us));
        made.twin.plc.reference_s = chance.between(0.1, 1.0);
        made.twin.plc.enable_s = chance.between(0.1, 2.0);
    }
};

// Of the defaults that docs/coefficient-file.md states.
signal_facts facts_of_signal(const json &root, const json &entry, std::int64_t period_us) {
    const std::string unit = entry.value("unit", "");
    double age_ms = entry.contains("plc") ? 3e-3 * static_cast<double>(period_us) : 2000.0;
    if (entry.contains("bus"))  // there is one
        age_ms = std::max(age_ms, 3 * root.at("buses").at(0).at("every_ms").get<double>());
    return {entry.at("name"),
            entry.value("essential", unit == "mm" || unit == "deg"),
            std::llround(1000 * entry.value("max_age_ms", age_ms)),
            entry.value("min", 0.0),
            entry.value("max", 0.0),
            entry.contains("lag_of")};
}

}  // namespace

machine random_machine(dice &chance, unsigned revision) {
    machine made;
    draft file{chance, {}, made, {}, {}};
    made.twin.seed = dice(chance).next();  // until draw_control(), for dice of their own
    file.draw_plc();
    file.draw_axes();
    file.draw_temperatures();
    file.draw_sensors();
    file.draw_terms();
    const bool counters = chance.one_in(2);
    file.draw_channels(counters);
    file.close_blocks(chance.one_in(2), counters);
    file.draw_control();
    file.draw_slow_channels();
    file.draw_largest_step();
    file.draw_spare_axes();
    file.draw_wandering();
    file.draw_cold();
    file.draw_probe();
    file.draw_narrow_ranges();
    file.draw_bank_ranges();
    file.draw_position_ages();
    file.draw_polynomials();
    file.draw_volumetric();
    file.draw_orders();
    file.draw_lines();
    file.draw_slow_modules();
    file.draw_rare_readings();
    file.draw_hand();
    file.draw_velocities();
    file.draw_redundant();
    file.draw_second_outputs();
    file.draw_wide_banks();
    file.draw_twin_banks();
    file.draw_uneven_breaks();
    file.draw_followed_models();
    file.draw_curves_of_tangents();
    file.draw_shared_breaks();
    file.draw_interface();
    file.draw_thermometers();
    file.draw_slow_line();
    file.draw_scales();
    file.draw_unsigned();
    file.draw_rotary_axis();
    made.changes_lags = dice(made.twin.seed, "other lags").one_in(2);
    file.root["revision"] = revision;
    made.text = file.root.dump(1);
    made.map = fakeplc::register_map_of(file.root, "coefficients.json");
    for (const json &entry : file.root["signals"])
        made.signals.push_back(facts_of_signal(file.root, entry, made.period_us));
    return made;
}

machine machine_of(std::uint64_t seed) {
    static std::optional<std::pair<std::uint64_t, machine>>
        newest;  // its faults ask before its run
    if (!newest || newest->first != seed) {
        dice chance(seed, "machine");
        newest = {seed, random_machine(chance)};
    }
    return newest->second;
}

namespace {

channel_facts facts_of_channel(const json &entry) {
    channel_facts facts;
    facts.name = entry.at("name");
    facts.limit_um = entry.at("limit_um");
    facts.slew_um_per_s = entry.at("slew_um_per_s");
    const bool real = entry.value("type", "int32").rfind("float32", 0) == 0;
    facts.unit_um = real ? 0 : entry.value("scale", 1.0);
    facts.sign = entry.value("sign", 1);
    facts.has_applied = entry.contains("applied");
    facts.error_um = entry.value("error_um", 0.0);
    facts.deadband_um = entry.value("deadband_um", 0.0);
    if (!entry.contains("tangent")) return facts;
    const json &tangent = entry.at("tangent");
    facts.tangent_signal = tangent.at("signal");
    facts.slope_limit = facts.file_slope_limit = tangent.at("slope_limit");
    facts.slope_slew_per_s = tangent.at("slope_slew_per_s");
    facts.slope_unit = tangent.value("slope_scale", 1.0);
    return facts;
}

pair_facts facts_of_pair(const machine &of, const json &entry) {
    const auto index_of = [&of](const std::string &name) {
        std::size_t i = 0;
        while (i + 1 < of.channels.size() && of.channels[i].name != name) ++i;
        return i;
    };
    const json &names = entry.at("channels");
    return {index_of(names.at(0)), index_of(names.at(1)), entry.at("max_difference_um")};
}

}  // namespace

const nlohmann::json &machine::file() const {
    if (!parsed) parsed = std::make_shared<nlohmann::json>(nlohmann::json::parse(text));
    return *parsed;
}

const signal_facts *machine::signal(const std::string &name) const {
    for (const signal_facts &one : signals) {
        if (one.name == name) return &one;
    }
    return nullptr;
}

std::optional<machine> facts_of(const machine &base, const std::string &text) {
    machine made = base;
    try {
        const json root = json::parse(text);
        made.text = text;
        made.parsed.reset();
        made.revision = root.value("revision", 0u);
        made.map = fakeplc::register_map_of(root, "coefficients.json");
        made.channels.clear();
        made.pairs.clear();
        for (const auto &entry : root.at("channels"))
            made.channels.push_back(facts_of_channel(entry));
        if (root.contains("pairs")) {
            for (const auto &entry : root.at("pairs"))
                made.pairs.push_back(facts_of_pair(made, entry));
        }
        made.ramp_um_per_s = root.at("safety").value("ramp_um_per_s", made.ramp_um_per_s);
        made.hold_us = static_cast<std::int64_t>(1000 * root.at("safety").value("hold_ms", 0.0));
        made.period_us = std::llround(1000 * root.at("cycle").value("period_ms", 30.0));
        const json &plc = root.at("plc");
        made.step_units = plc.value("max_step_units", plc.at("profile") == "fanuc" ? 9998.0 : 0.0);
        made.fc23 = plc.value("exchange", "") == "fc23";
        made.heartbeat_timeout_us = std::llround(1000 * plc.value("heartbeat_timeout_ms", 200.0));
        made.signals.clear();
        for (const auto &entry : root.at("signals"))
            made.signals.push_back(facts_of_signal(root, entry, made.period_us));
    } catch (const std::exception &) {
        return std::nullopt;
    }
    return made;
}

// out: whether the later term takes an output of the earlier
bool takes_output_of(const json &later, const json &earlier) {
    std::set<std::string> taken;
    for (const char *key : {"term", "of"})
        if (later.contains(key)) taken.insert(later[key].get<std::string>());
    for (const std::string name : later.value("errors", json::array())) taken.insert(name);
    const json outputs = outputs_of(earlier);
    return std::any_of(outputs.begin(), outputs.end(),
                       [&taken](const json &name) { return taken.count(name) > 0; });
}

// Terms in another order, and inputs of banks: the box knows both by their names.
void reorder_terms(json &root, dice &order) {
    json &terms = root["terms"];
    for (std::size_t turn = 0; turn < 2 * terms.size(); ++turn) {
        const std::size_t i = 1 + order.below(terms.size());
        if (i < terms.size() && !takes_output_of(terms[i], terms[i - 1]))
            std::swap(terms[i - 1], terms[i]);
    }
    for (json &term : terms) {
        if (!term.contains("bank") || term["bank"]["inputs"].size() != 2) continue;
        json &bank = term["bank"];
        const auto first = static_cast<std::ptrdiff_t>(
            bank["powers"][bank["inputs"][0].get<std::string>()].size() * bank["tau_s"].size());
        std::swap(bank["inputs"][0], bank["inputs"][1]);
        for (json &row : bank["weights"]) std::rotate(row.begin(), row.begin() + first, row.end());
    }
}

// in : anything of a file. out: whether it names that, as a value or as a key
bool names(const json &part, const std::string &name) {
    if (part.is_string()) return part == name;
    if (part.is_object() && part.contains(name)) return true;
    return part.is_structured() && std::any_of(part.begin(), part.end(), [&name](const json &one) {
               return names(one, name);
           });
}

// out: whether the file can do without the term: no other term takes its outputs, and no channel
//      has nothing but them
bool is_spare(const json &root, const json &term) {
    for (const json &other : root["terms"])
        if (takes_output_of(other, term)) return false;
    const json outputs = outputs_of(term);
    return std::none_of(root["channels"].begin(), root["channels"].end(), [&](const json &one) {
        return std::all_of(one["sum"].begin(), one["sum"].end(),
                           [&](const json &of) { return names(outputs, of); });
    });
}

// Its channels go on without it.
void drop_term(json &root, std::size_t index) {
    const json term = root["terms"][index], outputs = outputs_of(term);
    root["terms"].erase(index);
    for (json &channel : root["channels"])
        for (std::size_t i = channel["sum"].size(); i-- > 0;)
            if (names(outputs, channel["sum"][i])) channel["sum"].erase(i);
    // Signals that nothing else has a use for are read no longer; the source of a lag behind it.
    json &signals = root["signals"];
    std::set<std::string> sources;
    for (bool again = true; std::exchange(again, false);)
        for (std::size_t i = signals.size(); i-- > 0;) {
            const json signal = signals[i];
            const std::string name = signal["name"];
            const bool was_used = names(term, name) || sources.count(name) > 0;
            if (signal.value("unit", "") == "mm" || !was_used) continue;
            json rest = root;
            rest["signals"].erase(i);
            if (names(rest, name)) continue;
            if (signal.contains("lag_of")) sources.insert(signal["lag_of"]);
            signals.erase(i);
            again = true;
        }
}

// The last sensor is neither doubted any more, nor asked about the others: what they say of each
// other without it (Schur complement; without that they would take it for one at its centre).
void check_fewer(json &sensors) {
    const std::size_t left = sensors["signals"].size() - 1;
    if (left < 3) return;
    for (const char *key : {"signals", "center"}) sensors[key].erase(left);
    json &precision = sensors["precision"];
    const std::vector<double> of_left = precision[left];
    precision.erase(left);
    for (std::size_t j = 0; j < left; ++j) {
        precision[j].erase(left);
        for (std::size_t k = 0; k < left; ++k)
            precision[j][k] =
                precision[j][k].get<double>() - of_left[j] * of_left[k] / of_left[left];
    }
}

// Nodes of CAN whose signal is read no longer.
void drop_nodes(json &root) {
    if (!root.contains("can")) return;
    json &nodes = root["can"]["nodes"];
    for (std::size_t i = nodes.size(); i-- > 0;)
        if (nodes.size() > 1 &&
            !names(root["signals"], fmt::format("C{}", nodes[i]["node"].get<int>())))
            nodes.erase(i);
}

// The box numbers its states of nodes by their place in the file.
void turn_nodes(json &root) {
    if (!root.contains("can")) return;
    json &nodes = root["can"]["nodes"];
    std::rotate(nodes.begin(), nodes.begin() + 1, nodes.end());
}

// Other time constants, and other terms in a channel's sum.
void rewire(json &root, dice &order, bool changes_lags) {
    for (json &signal : root["signals"])
        if (changes_lags && signal.contains("lag_of") && order.one_in(3))
            signal["tau_s"] = rounded(order.log_between(5, 3000));
    for (json &channel : root["channels"]) {
        json &sum = channel["sum"];
        const std::size_t i = order.below(sum.size());
        if (sum.size() > 1 && sum[i] != "adapted" && order.one_in(3)) sum.erase(i);
    }
}

std::string another_file(const machine &of, dice &chance, unsigned revision) {
    static std::pair<std::string, json> parsed;  // a run has one machine, and asks again and again
    if (parsed.first != of.text) parsed = {of.text, json::parse(of.text)};
    json root = parsed.second;
    root["revision"] = revision;
    for (auto &term : root["terms"]) {
        if (!term.contains("values")) continue;
        for (auto &value : term["values"]) value = rounded(chance.between(-30, 30));
    }
    // The box knows signals and what belongs to them by name.
    dice order(of.twin.seed + revision, "order");
    json &signals = root["signals"];
    for (std::size_t i = order.one_in(3) ? signals.size() : 0; i > 1; --i)
        std::swap(signals[i - 1], signals[order.below(i)]);
    // The other one of a node's two frames needs other filters.
    for (json &signal : signals)
        if (signal.contains("can") && order.one_in(3)) {
            const can_node &node =
                *std::find_if(of.nodes.begin(), of.nodes.end(), [&signal](const can_node &one) {
                    return signal["name"] == fmt::format("C{}", one.number);
                });
            signal["can"] = node.id_text(signal["can"] == node.id_text(false));
        }
    dice wiring(of.twin.seed + revision, "wiring");
    if (wiring.one_in(3)) reorder_terms(root, wiring);
    if (wiring.one_in(3)) rewire(root, wiring, of.changes_lags);
    // Terms that are not there, with the signals that only they have.
    dice drops(of.twin.seed + revision, "drops");
    for (std::size_t i = drops.one_in(4) ? root["terms"].size() : 0; i-- > 0;)
        if (drops.one_in(2) && root["terms"][i]["type"] != "adapt" &&
            is_spare(root, root["terms"][i]))
            drop_term(root, i);
    if (drops.one_in(2)) drop_nodes(root);
    if (dice(of.twin.seed + revision, "nodes").one_in(3)) turn_nodes(root);
    // Of a wider file the bounds grow, but stay within the registers.
    dice own(of.twin.seed + revision, "bounds");
    if (own.one_in(3)) {
        json &channel = root["channels"][own.below(root["channels"].size())];
        const bool whole = dice(of.twin.seed + revision, "limit").one_in(2);
        for (const char *key : {"limit_um", "error_um"})
            if (whole || key == std::string("error_um"))
                channel[key] = rounded(1.05 * channel[key].get<double>());
    }
    // A limit may be narrow, for example below the site's ceiling.
    dice narrow(of.twin.seed + revision, "narrow");
    if (narrow.one_in(8)) {
        json &channel = root["channels"][narrow.below(root["channels"].size())];
        channel["limit_um"] = rounded(narrow.between(0.1, 0.9) * channel["limit_um"].get<double>());
    }
    if (of.profile.name != "fanuc" && own.one_in(6)) {  // which lowers a slew rate itself
        json &channel = root["channels"][own.below(root["channels"].size())];
        channel["slew_um_per_s"] = rounded(1.5 * channel["slew_um_per_s"].get<double>());
    }
    json &sloped = root["channels"][wiring.below(root["channels"].size())];
    if (sloped.contains("tangent") && wiring.one_in(4)) {
        json &tangent = sloped["tangent"];
        if (wiring.one_in(2))
            tangent["slope_limit"] = rounded(1.05 * tangent["slope_limit"].get<double>());
        tangent["slope_slew_per_s"] = rounded(1.5 * tangent["slope_slew_per_s"].get<double>());
    }
    // Another probe of the control counts.
    const bool counts = dice(of.twin.seed + revision, "count").one_in(4);
    for (json &term : root["terms"])
        if (counts && term.contains("probe")) term["probe"]["count"] = other_probe_count;
    // What a term has learnt may be beyond its bounds in the next file.
    dice learnt(of.twin.seed + revision, "adapt");
    for (json &term : root["terms"])
        for (const char *bound : {"bias_max_um", "gain_max"})
            if (term["type"] == "adapt" && learnt.one_in(2))
                term[bound] = rounded(learnt.log_between(0.02, 1) * term[bound].get<double>());
    // Without the key a step has as many units as FANUC takes.
    if (dice(of.twin.seed + revision, "step").one_in(4)) root["plc"].erase("max_step_units");
    // Another control: no step is the largest. Its profile has no handshake.
    json &plc = root["plc"];
    if (plc["profile"] == "fanuc" && dice(of.twin.seed + revision, "profile").one_in(6)) {
        plc["profile"] = "generic";
        for (const char *key : {"max_step_units", "handshake", "axes_at_once"}) plc.erase(key);
    }
    // A model that states its sigma becomes another one, of which no probe was taken.
    dice model(of.twin.seed + revision, "model");
    for (json &term : root["terms"])
        if (term.contains("sigma") && model.one_in(3))
            for (json &bias : term["bank"]["bias"])
                bias = rounded(bias.get<double>() + model.between(-1, 1));
    // The way to zero may take longer.
    dice ramp(of.twin.seed + revision, "ramp");
    json &ramp_um_per_s = root["safety"]["ramp_um_per_s"];
    if (ramp.one_in(4))
        ramp_um_per_s = rounded(ramp.log_between(0.1, 0.9) * ramp_um_per_s.get<double>());
    // The NC is not asked any more.
    if (dice(of.twin.seed + revision, "handshake").one_in(4)) plc.erase("handshake");
    dice checks(of.twin.seed + revision, "sensors");
    if (checks.one_in(4))
        root.erase("sensors");  // nothing doubts one any more
    else if (root.contains("sensors") && checks.one_in(3))
        check_fewer(root["sensors"]);
    if (root.contains("pairs") && own.one_in(12)) root.erase("pairs");
    if (root.contains("pairs") && own.one_in(6)) {
        double most = root["pairs"][0]["max_difference_um"];
        root["pairs"][0]["max_difference_um"] = rounded(1.5 * most);
    }
    return root.dump(1);
}

std::string with_other_units(const std::string &text, dice &chance) {
    json root = json::parse(text);
    json &channel = root["channels"][chance.below(root["channels"].size())];
    if (chance.one_in(2))
        channel["scale"] = 2 * channel["scale"].get<double>();
    else
        channel["sign"] = -channel.value("sign", 1);
    return root.dump(1);
}

std::string for_another_plc(const std::string &text, dice &chance) {
    json root = json::parse(text);
    json &plc = root["plc"], &transport = plc["transport"];
    const auto move = [](json &of, const std::vector<const char *> &keys) {
        for (const char *key : keys)
            if (of.contains(key)) of[key] = of[key].get<int>() + 1;
    };
    switch (chance.below(9)) {
        case 0:
            root["cycle"]["period_ms"] = 1 + root["cycle"]["period_ms"].get<double>();
            break;
        case 1:
            move(plc["write"], {"start"});
            move(plc, {"status", "box_heartbeat", "detail", "request"});
            for (json &channel : root["channels"]) {
                move(channel, {"plc"});
                if (channel.contains("tangent"))
                    move(channel["tangent"], {"slope_plc", "reference_plc"});
            }
            break;
        case 2:
            move(plc["read"], {"count"});
            plc["read"]["counters"] = false;
            break;
        case 3:
            move(plc["write"], {"count"});
            break;
        case 4:
            move(plc["read"], {"start"});
            move(plc, {"control", "plc_heartbeat", "handshake"});
            for (json &signal : root["signals"]) move(signal, {"plc"});
            for (json &channel : root["channels"]) move(channel, {"applied"});
            break;
        case 5:
            if (!transport.contains("rtu")) {
                move(transport["tcp"], {"port"});
                break;
            }
            if (chance.one_in(2))
                transport["rtu"]["parity"] =
                    transport["rtu"].value("parity", "even") == "odd" ? "even" : "odd";
            else
                transport["rtu"]["slave_delay_ms"] =
                    transport["rtu"].value("slave_delay_ms", 2.0) / 2 + 0.01;
            break;
        case 6:
            plc["exchange"] = plc["exchange"] == "fc23" ? "fc3+fc16" : "fc23";
            break;
        case 7:
            if (transport.contains("tcp"))
                transport["tcp"]["host"] = "192.168.0.2";
            else
                transport["rtu"]["device"] = "/dev/ttyS7";
            break;
        default:
            if (transport.contains("tcp") && chance.one_in(2)) {
                move(transport["tcp"], {"port"});
                break;
            }
            for (json &of : transport) of["unit"] = 1 + of.value("unit", 1);
    }
    return root.dump(1);
}

std::optional<std::size_t> partner_of(const machine &of, std::size_t channel) {
    for (const pair_facts &pair : of.pairs) {
        if (pair.first == channel) return pair.second;
        if (pair.second == channel) return pair.first;
    }
    return std::nullopt;
}

double least_slew_um_per_s(const machine &of, const channel_facts &channel) {
    if (of.step_units == 0) return channel.slew_um_per_s;
    return std::min(0.25 * channel.slew_um_per_s, 0.4 * of.step_units * channel.unit_um);
}

time_ns longest_between_steps(const machine &of) {
    return of.period_us * us * (of.fc23 ? 8 : 5) / 5;
}

time_ns longest_late(const machine &of) {
    return (of.heartbeat_timeout_us + 2 * of.period_us) * us;
}

time_ns contact_lasts(const machine &of) {
    return 8 * of.period_us * us;
}

// out: in units; without one it is infinite
static double largest_step(const machine &of) {
    return of.step_units > 0 ? of.step_units : std::numeric_limits<double>::infinity();
}

bool is_wider(const machine &fresh, const machine &than) {
    for (std::size_t c = 0; c < std::min(fresh.channels.size(), than.channels.size()); ++c) {
        const channel_facts &is = fresh.channels[c], &was = than.channels[c];
        if (is.limit_um > was.limit_um || is.error_um > was.error_um || is.sign != was.sign ||
            is.slew_um_per_s > was.slew_um_per_s || is.file_slope_limit > was.file_slope_limit ||
            is.slope_slew_per_s > was.slope_slew_per_s ||
            fresh.map.channels[c].scale_um != than.map.channels[c].scale_um ||
            (is.has_applied && largest_step(fresh) > largest_step(than)))
            return true;
    }
    if (fresh.pairs.size() < than.pairs.size()) return true;
    for (std::size_t p = 0; p < than.pairs.size(); ++p)
        if (fresh.pairs[p].most_um > than.pairs[p].most_um) return true;
    return false;
}

bool may_be_wider(const machine &fresh, const machine &than) {
    return is_wider(fresh, than) || fresh.step_units != than.step_units ||
           fresh.map.handshake != than.map.handshake;
}

void lower_to(machine &of, const site_ceiling &ceiling) {
    for (channel_facts &channel : of.channels) {
        channel.lowered = channel.limit_um > ceiling.um || channel.slew_um_per_s > ceiling.um_per_s;
        channel.limit_um = std::min(channel.limit_um, ceiling.um);
        channel.slew_um_per_s = std::min(channel.slew_um_per_s, ceiling.um_per_s);
        channel.deadband_um = std::min(channel.deadband_um, channel.limit_um);
        channel.slope_slew_per_s = std::min(channel.slope_slew_per_s, 1e-6 * ceiling.um_per_s);
        channel.slope_limit =
            std::min({channel.slope_limit, 1e-6 * ceiling.um, channel.slope_slew_per_s});
    }
}

}  // namespace compbox::world
