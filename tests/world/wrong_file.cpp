// SPDX-License-Identifier: MIT
#include "tests/world/wrong_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "host-tools/formats/json_type.h"

namespace compbox::world {

namespace {

// Each makes its mistake. out: false: the file has no place for it, and is as before
using mistake = bool (*)(json &root);

// out: the first term with this key; nullptr: none
json *term_with(json &root, const char *key) {
    for (auto &term : root["terms"])
        if (term.contains(key)) return &term;
    return nullptr;
}

json *lag_of(json &root) {
    for (auto &signal : root["signals"])
        if (signal.contains("lag_of")) return &signal;
    return nullptr;
}

// out: whether a signal or channel has a number of two registers
bool is_wide(const json &entry) {
    return entry["type"].get<std::string>().find("16") == std::string::npos;
}

json *tangent_of(json &root) {
    for (auto &channel : root["channels"])
        if (channel.contains("tangent")) return &channel["tangent"];
    return nullptr;
}

// out: of the channel's register; 0: it has a real
double unit_um(const json &root, const json &name) {
    for (const json &channel : root["channels"])
        if (channel["name"] == name && channel["type"].get<std::string>().rfind("float", 0) != 0)
            return channel.value("scale", 1.0);
    return 0;
}

// out: whether there is something to change
template <typename change>
bool changes(json *found, change made) {
    if (found != nullptr) made(*found);
    return found != nullptr;
}

const mistake mistakes[] = {
    [](json &root) {
        json &channels = root["channels"];
        channels[0]["plc"] = channels.size() > 1 ? channels[1]["plc"] : root["plc"]["status"];
        return true;
    },
    [](json &root) {
        root["plc"]["box_heartbeat"] = root["plc"]["status"];
        return true;
    },
    [](json &root) {
        root["plc"]["plc_heartbeat"] = root["plc"]["control"];
        return true;
    },
    [](json &root) {
        root["signals"][0]["plc"] = root["plc"]["control"];
        return true;
    },
    // Only the second register of a number is another one's too.
    [](json &root) {
        json *wide = nullptr;
        for (json &signal : root["signals"]) {
            if (!signal.contains("plc")) continue;
            if (wide != nullptr) {
                signal["plc"] = (*wide)["plc"].get<int>() + 1;
                return true;
            }
            if (is_wide(signal)) wide = &signal;
        }
        return false;
    },
    // Signals may share the registers of a number, not those of two numbers.
    [](json &root) {
        for (json &one : root["signals"]) {
            for (json &other : root["signals"]) {
                if (!one.contains("plc") || !other.contains("plc") ||
                    is_wide(one) != is_wide(other) || one["name"] == other["name"])
                    continue;
                other["plc"] = one["plc"];
                other["type"] = one["type"] == "int32"    ? "float32"
                                : one["type"] == "int16"  ? "uint16"
                                : one["type"] == "uint16" ? "int16"
                                                          : "int32";
                other["scale"] = 1e-3;
                return true;
            }
        }
        return false;
    },
    [](json &root) {
        return changes(term_with(root, "probe"), [](json &term) { term["of"] = term["name"]; });
    },
    [](json &root) {
        return changes(term_with(root, "probe"),
                       [](json &term) { term["probe"]["count"] = term["probe"]["value"]; });
    },
    [](json &root) {
        for (json &channel : root["channels"]) {
            if (!channel.contains("applied")) continue;
            channel["applied"] = root["plc"]["control"];
            return true;
        }
        return false;
    },
    [](json &root) {
        for (json &channel : root["channels"]) {
            if (channel["type"] != "int16") continue;
            channel["scale"] = channel["limit_um"].get<double>() / 40000;
            return true;
        }
        return false;
    },
    [](json &root) {
        root["signals"][0]["scale"] = 0;
        return true;
    },
    [](json &root) {
        root["channels"][0]["sign"] = 0;
        return true;
    },
    [](json &root) {
        root["revision"] = -1;
        return true;
    },
    [](json &root) {
        root["channels"][0]["limit_um"] = "9";
        return true;
    },
    [](json &root) {
        json &channels = root["channels"];
        if (channels.size() < 2 || !is_wide(channels[0])) return false;
        channels[1]["plc"] = channels[0]["plc"].get<int>() + 1;
        return true;
    },
    [](json &root) {
        root["signals"][0]["plc"] = root["plc"]["read"]["start"].get<int>() + 4000;
        return true;
    },
    [](json &root) {
        json &channel = root["channels"][0];
        channel["deadband_um"] = 2 * channel["limit_um"].get<double>();
        return true;
    },
    [](json &root) {
        json &channel = root["channels"][0];
        channel["error_um"] = channel["limit_um"].get<double>() / 2;
        return true;
    },
    [](json &root) {
        root["channels"][0]["type"] = "uint16";
        return true;
    },
    [](json &root) {
        root["channels"][0]["sum"][0] = "nothing";
        return true;
    },
    [](json &root) {
        json &sum = root["channels"][0]["sum"];
        sum.push_back(sum[0]);
        return true;
    },
    [](json &root) {
        root["channels"][0]["sum"] = json::array();
        return true;
    },
    [](json &root) {
        root["channels"][0].erase("slew_um_per_s");
        return true;
    },
    [](json &root) {
        root["channels"][0]["slew"] = 1;
        return true;
    },
    [](json &root) {
        if (root["channels"].size() < 2) return false;
        root["channels"][1]["name"] = root["channels"][0]["name"];
        return true;
    },
    [](json &root) {
        root["signals"][1]["name"] = root["signals"][0]["name"];
        return true;
    },
    [](json &root) {
        std::swap(root["signals"][0]["min"], root["signals"][0]["max"]);
        return true;
    },
    [](json &root) {
        root["plc"]["heartbeat_timeout_ms"] = 1;
        return true;
    },
    [](json &root) {
        root["plc"]["read"]["count"] = 126;
        return true;
    },
    [](json &root) {
        root["plc"]["interpolate_ms"] = 2 * root["cycle"]["period_ms"].get<double>();
        return true;
    },
    [](json &root) {
        root["plc"]["referenced_bits"] = {1, 2};
        return true;
    },
    [](json &root) {
        root["format"] = "compbox/2";
        return true;
    },
    [](json &root) {
        return changes(lag_of(root), [](json &lag) { lag["lag_of"] = lag["name"]; });
    },
    [](json &root) { return changes(lag_of(root), [](json &lag) { lag["tau_s"] = 0; }); },
    [](json &root) {
        return changes(term_with(root, "positions"),
                       [](json &term) { term["positions"][1] = term["positions"][0]; });
    },
    [](json &root) {
        return changes(term_with(root, "positions"),
                       [](json &term) { term["values"].push_back(0); });
    },
    [](json &root) {
        return changes(term_with(root, "knots"), [](json &term) { term["knots"].back() = -1; });
    },
    [](json &root) {
        return changes(term_with(root, "hidden_bias"),
                       [](json &term) { term["hidden_bias"].push_back(0); });
    },
    [](json &root) {
        return changes(term_with(root, "input_max"),
                       [](json &term) { std::swap(term["input_max"], term["input_min"]); });
    },
    [](json &root) {
        return changes(term_with(root, "bank"),
                       [](json &term) { term["bank"]["weights"][0].push_back(0); });
    },
    [](json &root) {
        return changes(term_with(root, "chain"), [](json &term) { term["chain"] = "XXYf"; });
    },
    [](json &root) {
        if (!root.contains("pairs")) return false;
        json &names = root["pairs"][0]["channels"];
        names[1] = names[0];
        return true;
    },
    [](json &root) {
        if (!root.contains("pairs")) return false;
        root["pairs"].push_back(root["pairs"][0]);
        return true;
    },
    // Two values that differ by this much may be a unit of each further apart in the registers.
    [](json &root) {
        if (!root.contains("pairs")) return false;
        json &pair = root["pairs"][0];
        const double one = unit_um(root, pair["channels"][0]),
                     other = unit_um(root, pair["channels"][1]);
        if (one == 0 || other == 0) return false;
        pair["max_difference_um"] = std::max(one, other) + std::min(one, other) / 2;
        return true;
    },
    [](json &root) {
        if (!root.contains("pairs")) return false;
        root["pairs"][0]["channels"].erase(1);
        return true;
    },
    [](json &root) {
        if (!root.contains("pairs")) return false;
        const json &name = root["pairs"][0]["channels"][1];
        for (json &channel : root["channels"]) {
            if (channel["name"] != name || !channel.contains("applied")) continue;
            channel.erase("applied");
            return true;
        }
        return false;
    },
    // Two that follow each other.
    [](json &root) {
        json *const lag = lag_of(root);
        if (lag == nullptr) return false;
        json other = *lag;
        other["name"] = "circle";
        other["lag_of"] = (*lag)["name"];
        (*lag)["lag_of"] = "circle";
        root["signals"].push_back(other);
        return true;
    },
    [](json &root) {
        if (!root.contains("sensors")) return false;
        json &names = root["sensors"]["signals"];
        names[1] = names[0];
        return true;
    },
    [](json &root) {
        json *const lag = lag_of(root);
        if (lag == nullptr || !root.contains("sensors")) return false;
        root["sensors"]["signals"][0] = (*lag)["name"];
        return true;
    },
    [](json &root) {
        if (!root.contains("sensors")) return false;
        json &precision = root["sensors"]["precision"];
        precision[0][1] = precision[0][1].get<double>() + 0.5 * precision[0][0].get<double>();
        return true;
    },
    [](json &root) {
        return changes(tangent_of(root), [](json &tangent) {
            tangent["slope_slew_per_s"] = tangent["slope_limit"].get<double>() / 2;
        });
    },
    [](json &root) {
        return changes(tangent_of(root), [](json &tangent) { tangent["slope_type"] = "uint32"; });
    },
    [](json &root) {
        return changes(tangent_of(root), [](json &tangent) { tangent["signal"] = "T1"; });
    },
    [](json &root) {
        root["plc"]["transport"]["tcp"]["address"] = "127.0.0.1";
        root["plc"]["transport"]["rtu"]["device"] = "/dev/ttyS0";
        return true;
    },
    [](json &root) {
        if (!root["plc"]["transport"].contains("rtu")) return false;
        root["plc"]["transport"]["rtu"]["baud"] = 1200;
        return true;
    },
    [](json &root) {
        if (!root.contains("can")) return false;
        json &nodes = root["can"]["nodes"];
        nodes.push_back(nodes[0]);
        return true;
    },
    [](json &root) {
        if (!root.contains("buses")) return false;
        root["buses"][0]["rtu"]["device"] = "ttyS1";
        return true;
    },
};

// What the page allows and few files have. Where a file has no place for it, it stays as it is.
using rarity = void (*)(json &root);
const rarity rarities[] = {
    [](json &root) { root["safety"]["hold_ms"] = 60000; },
    [](json &root) { root["safety"]["hold_ms"] = 0; },
    [](json &root) { root["safety"]["ramp_um_per_s"] = 0.001; },
    [](json &root) { root["safety"]["ramp_um_per_s"] = 1e6; },
    [](json &root) { root["plc"]["heartbeat_timeout_ms"] = 60000; },
    [](json &root) { root["revision"] = 4294967295; },
    [](json &root) { root["revision"] = 0; },
    [](json &root) {
        for (json &channel : root["channels"]) channel["deadband_um"] = channel["limit_um"];
    },
    [](json &root) {
        for (json &channel : root["channels"]) channel["error_um"] = channel["limit_um"];
    },
    [](json &root) {
        for (json &channel : root["channels"]) channel["slew_um_per_s"] = 1e6;
    },
    [](json &root) {
        for (json &signal : root["signals"])
            if (!signal.contains("lag_of")) signal["max_age_ms"] = 86400000;
    },
    [](json &root) {
        for (json &signal : root["signals"])
            if (signal.contains("max_rate_per_s")) signal["max_rate_per_s"] = 1e9;
    },
    [](json &root) {
        for (json &term : root["terms"]) {
            if (!term.contains("probe")) continue;
            term["gain_max"] = 1;
            term["bias_max_um"] = 1000;
            term["sigma_um"] = 0.01;
            term["drift_um_per_sqrt_h"] = 1000;
            term["min_interval_s"] = 86400;
        }
    },
    [](json &root) {
        for (json &term : root["terms"]) {
            if (!term.contains("probe")) continue;
            term["gain_max"] = 0;
            term["bias_max_um"] = 0;
            term["step_max_um"] = 0.001;
            term["drift_um_per_sqrt_h"] = 0;
            term["gain_drift_per_sqrt_h"] = 0;
        }
    },
    [](json &root) {
        json *const lag = lag_of(root);
        if (lag != nullptr) (*lag)["tau_s"] = 86400;
    },
    [](json &root) {
        if (root.contains("sensors")) root["sensors"]["after_s"] = 3600;
    },
    [](json &root) {
        if (root.contains("sensors")) root["sensors"]["threshold"] = 1;
    },
    [](json &root) { root["machine"]["name"] = std::string(39, 'm'); },
    [](json &root) { root["machine"]["name"] = "Fr\xC3\xA4se \"7\" \\ \xF0\x9F\x94\xA7"; },
    [](json &root) {
        root["provenance"] = {{"by", {nullptr, true, -1.5e-7, "\xC3\xA4\n", json::object()}}};
    },
    [](json &root) {
        json turned = json::object();
        for (auto each = root.rbegin(); each != root.rend(); ++each) turned[each.key()] = *each;
        root = turned;
    },
    // The sum of both units, in the sense of float32.
    [](json &root) {
        if (!root.contains("pairs")) return;
        json &pair = root["pairs"][0];
        const double both = unit_um(root, pair["channels"][0]) + unit_um(root, pair["channels"][1]);
        if (both > 0.002) pair["max_difference_um"] = both * (1 + 1e-6);
    },
};

// Numbers of the file outside of the range that the page states.
struct number_range {
    std::vector<const char *> path;  // to the objects that have the key; "*": each of a list
    const char *key;
    double least, most;
};
const number_range ranges[] = {
    {{}, "revision", 0, 4294967295.0},
    {{"cycle"}, "period_ms", 1, 1000},
    {{"cycle"}, "lead_ms", 0, 500},
    {{"safety"}, "hold_ms", 0, 60000},
    {{"safety"}, "ramp_um_per_s", 0.001, 1e6},
    {{"plc"}, "control", 0, 65535},
    {{"plc"}, "plc_heartbeat", 0, 65535},
    {{"plc"}, "status", 0, 65535},
    {{"plc"}, "box_heartbeat", 0, 65535},
    {{"plc"}, "request", 0, 65535},
    {{"plc"}, "detail", 0, 65535},
    {{"plc"}, "handshake", 0, 65535},
    {{"plc"}, "heartbeat_timeout_ms", 1, 60000},
    {{"plc"}, "scan_ms", 0.1, 1000},
    {{"plc"}, "max_step_units", 2, 9998},
    {{"plc"}, "deadband_um", 0, 1000},
    {{"plc"}, "interpolate_ms", 0, 1000},
    {{"plc", "read"}, "start", 0, 65535},
    {{"plc", "read"}, "count", 2, 125},
    {{"plc", "write"}, "start", 0, 65535},
    {{"plc", "write"}, "count", 2, 121},
    {{"plc", "transport", "tcp"}, "port", 1, 65535},
    {{"plc", "transport", "tcp"}, "unit", 0, 255},
    {{"plc", "transport", "rtu"}, "unit", 1, 247},
    {{"plc", "transport", "rtu"}, "stop_bits", 1, 2},
    {{"plc", "transport", "rtu"}, "slave_delay_ms", 0, 1000},
    {{"buses", "*"}, "every_ms", 10, 60000},
    {{"buses", "*", "rtu"}, "stop_bits", 1, 2},
    {{"buses", "*", "rtu"}, "slave_delay_ms", 0, 1000},
    {{"can", "nodes", "*"}, "node", 1, 127},
    {{"can", "nodes", "*"}, "heartbeat_timeout_ms", 50, 600000},
    {{"signals", "*"}, "plc", 0, 65535},
    {{"signals", "*"}, "offset", 0, 7},
    {{"signals", "*"}, "unit_id", 1, 247},
    {{"signals", "*"}, "register", 0, 65535},
    {{"signals", "*"}, "scale", -1e6, 1e6},
    {{"signals", "*"}, "zero", -1e9, 1e9},
    {{"signals", "*"}, "min", -1e9, 1e9},
    {{"signals", "*"}, "max", -1e9, 1e9},
    {{"signals", "*"}, "max_rate_per_s", 1e-6, 1e9},
    {{"signals", "*"}, "max_age_ms", 1, 86400000},
    {{"signals", "*"}, "tau_s", 0.001, 86400},
    {{"signals", "*"}, "power", 1, 2},
    {{"sensors"}, "threshold", 1, 1e6},
    {{"sensors"}, "after_s", 1, 3600},
    {{"terms", "*"}, "reversal_mm", 0.001, 1000},
    {{"terms", "*"}, "degree", 1, 5},
    {{"terms", "*"}, "half_range", 1e-6, 1e9},
    {{"terms", "*"}, "from", -1e9, 1e9},
    {{"terms", "*"}, "to", -1e9, 1e9},
    {{"terms", "*"}, "constant", -1e9, 1e9},
    {{"terms", "*"}, "origin", -1e9, 1e9},
    {{"terms", "*"}, "tool_length_mm", -10000, 10000},
    {{"terms", "*", "squareness_urad"}, "C0Y", -100000, 100000},
    {{"terms", "*", "squareness_urad"}, "B0Z", -100000, 100000},
    {{"terms", "*", "squareness_urad"}, "A0Z", -100000, 100000},
    {{"terms", "*"}, "bias_max_um", 0, 1000},
    {{"terms", "*"}, "gain_max", 0, 1},
    {{"terms", "*"}, "step_max_um", 0.001, 1000},
    {{"terms", "*"}, "drift_um_per_sqrt_h", 0, 1000},
    {{"terms", "*"}, "gain_drift_per_sqrt_h", 0, 10},
    {{"terms", "*"}, "sigma_um", 0.01, 1000},
    {{"terms", "*"}, "min_interval_s", 0, 86400},
    {{"channels", "*"}, "limit_um", 0.001, 1e6},
    {{"channels", "*"}, "error_um", 0.001, 1e6},
    {{"channels", "*"}, "slew_um_per_s", 0.001, 1e6},
    {{"channels", "*"}, "deadband_um", 0, 1e6},
    {{"channels", "*"}, "plc", 0, 65535},
    {{"channels", "*"}, "applied", 0, 65535},
    {{"channels", "*"}, "scale", 1e-6, 1e6},
    {{"channels", "*", "tangent"}, "slope_plc", 0, 65535},
    {{"channels", "*", "tangent"}, "slope_scale", 1e-9, 1},
    {{"channels", "*", "tangent"}, "slope_limit", 1e-6, 0.1},
    {{"channels", "*", "tangent"}, "slope_slew_per_s", 1e-6, 10},
    {{"channels", "*", "tangent"}, "reference_plc", 0, 65535},
    {{"channels", "*", "tangent"}, "reference_scale", 1e-6, 1000},
    {{"pairs", "*"}, "max_difference_um", 0.001, 1e6},
};

// out: the objects at the end of the path
std::vector<json *> objects_at(json &root, const std::vector<const char *> &path) {
    std::vector<json *> found = {&root};
    for (const char *step : path) {
        std::vector<json *> next;
        for (json *at : found) {
            if (std::string_view(step) == "*")
                for (json &each : *at) next.push_back(&each);
            else if (at->contains(step))
                next.push_back(&(*at)[step]);
        }
        found = std::move(next);
    }
    return found;
}

// out: false: the file has no number there
bool leaves_range(json &root, dice &chance) {
    const number_range &of = ranges[chance.below(std::size(ranges))];
    std::vector<json *> found = objects_at(root, of.path);
    found.erase(std::remove_if(found.begin(), found.end(),
                               [&](const json *at) {
                                   return !at->contains(of.key) || !(*at)[of.key].is_number();
                               }),
                found.end());
    if (found.empty()) return false;
    json &number = (*found[chance.below(found.size())])[of.key];
    // Beside ±1e9 the next whole number is the same float32.
    const bool whole = number.is_number_integer() && of.most > 1 && of.most < 1e9;
    const double bound = chance.one_in(2) ? of.least : of.most;
    const double step = whole ? 1 : std::max(1e-3 * std::abs(bound), 1e-3 * of.least);
    const double beyond = bound == of.least ? bound - (step > 0 ? step : 0.001) : bound + step;
    if (whole)
        number = static_cast<std::int64_t>(beyond);
    else
        number = beyond;
    return true;
}

// Keys that each object of this kind must have.
struct required_keys {
    std::vector<const char *> path;
    std::vector<const char *> keys;
};
const required_keys required[] = {
    {{},
     {"format", "revision", "machine", "cycle", "plc", "signals", "terms", "channels", "safety"}},
    {{"machine"}, {"name"}},
    {{"cycle"}, {"period_ms"}},
    {{"safety"}, {"hold_ms", "ramp_um_per_s"}},
    {{"plc"},
     {"profile", "transport", "read", "write", "control", "plc_heartbeat", "status",
      "box_heartbeat", "heartbeat_timeout_ms"}},
    {{"plc", "transport"}, {"tcp", "rtu"}},
    {{"plc", "transport", "tcp"}, {"host"}},
    {{"plc", "transport", "rtu"}, {"device", "baud"}},
    {{"plc", "read"}, {"start", "count"}},
    {{"plc", "write"}, {"start", "count"}},
    {{"buses", "*"}, {"name", "rtu"}},
    {{"buses", "*", "rtu"}, {"device", "baud"}},
    {{"can", "nodes", "*"}, {"node"}},
    {{"signals", "*"},
     {"name", "unit", "plc", "can", "bus", "hand", "lag_of", "min", "max", "unit_id", "register",
      "tau_s"}},
    {{"sensors"}, {"signals", "center", "precision", "threshold"}},
    {{"terms", "*"},
     {"name",
      "type",
      "signal",
      "degree",
      "knots",
      "control_points",
      "positions",
      "values",
      "coefficients",
      "inputs",
      "weights",
      "bank",
      "reversal_mm",
      "term",
      "outputs",
      "activation",
      "hidden_weights",
      "hidden_bias",
      "output_weights",
      "output_bias",
      "input_min",
      "input_max",
      "chain",
      "errors",
      "of",
      "probe",
      "bias_max_um",
      "gain_max",
      "step_max_um",
      "drift_um_per_sqrt_h",
      "gain_drift_per_sqrt_h",
      "sigma_um"}},
    {{"terms", "*", "probe"}, {"value", "count"}},
    {{"terms", "*", "bank"}, {"inputs", "tau_s", "weights"}},
    {{"terms", "*", "sigma"}, {"floor_um", "along_um", "offsets", "directions"}},
    {{"channels", "*"},
     {"name", "sum", "limit_um", "error_um", "slew_um_per_s", "plc", "type", "scale"}},
    {{"channels", "*", "tangent"},
     {"signal", "slope_plc", "slope_type", "slope_scale", "slope_limit", "slope_slew_per_s",
      "reference_plc", "reference_type", "reference_scale"}},
    {{"pairs", "*"}, {"channels", "max_difference_um"}},
};

// out: false: the file has no such object, or it has not this key
bool misses_key(json &root, dice &chance) {
    const required_keys &of = required[chance.below(std::size(required))];
    const std::vector<json *> found = objects_at(root, of.path);
    if (found.empty()) return false;
    json &object = *found[chance.below(found.size())];
    const char *const key = of.keys[chance.below(of.keys.size())];
    if (!object.contains(key)) return false;
    // Three axes in X, Y, Z are the default of these; and a bank may name its outputs.
    const std::string type = object.value("type", "");
    if (type == "volumetric" && key == std::string("positions")) return false;
    if (type == "linear" && key == std::string("outputs")) return false;
    object.erase(key);
    return true;
}

// A key that no object has. out: false: the file has no such object
bool has_unknown_key(json &root, dice &chance) {
    const required_keys &of = required[chance.below(std::size(required))];
    const std::vector<json *> found = objects_at(root, of.path);
    if (found.empty()) return false;
    json &object = *found[chance.below(found.size())];
    object[chance.one_in(2) ? "note" : "limit_mm"] = 1;
    return true;
}

// out: false: a list is longer already
bool has_too_many(json &root, dice &chance) {
    static const struct {
        const char *list;
        std::size_t most;
    } lists[] = {{"signals", 64}, {"terms", 64}, {"channels", 16}};
    const auto &of = lists[chance.below(std::size(lists))];
    json &list = root[of.list];
    const json last = list.back();
    for (std::size_t i = list.size(); i <= of.most; ++i) {
        json next = last;
        next["name"] = "more" + std::to_string(i);
        if (next.contains("outputs")) return false;
        list.push_back(std::move(next));
    }
    return true;
}

using ways = bool (*)(json &root, dice &chance);
const ways by_key[] = {leaves_range, leaves_range, misses_key, has_unknown_key, has_too_many};

constexpr std::size_t most_bytes = 131040;  // of a file

// out: a text that is no file, whatever its numbers are
std::string no_file(const std::string &good, dice &chance) {
    const std::size_t end = good.rfind('}');
    const std::size_t name = good.find("\"name\": \"") + 9;
    const std::size_t number = good.find("\"revision\": ") + 12;
    const auto with = [&](std::size_t at, const char *more) {
        return good.substr(0, at) + more + good.substr(at);
    };
    switch (chance.below(16)) {
        case 0:
            return with(1, "\"format\": \"compbox/1\",");
        case 1:
            return with(end, ",");
        case 2:
            return with(1, "// a comment\n");
        case 3:
            return with(number, "0");
        case 4:
            return with(number, "+");
        case 5:
            return "\xEF\xBB\xBF" + good;
        case 6:
            return good + "}";
        case 7:
            return good.substr(0, end);
        case 8:
            return with(name, "\x01");
        case 9:
            return with(name, "\xC3");
        case 10:
            return with(name, "\\ud800");
        case 11:
            return with(name, "\\q");
        case 12:
            return with(name, "\xE2\x80\xAE");
        case 13:
            return good + std::string(most_bytes + 1 - good.size(), ' ');
        case 14:
            return with(end, ",\"provenance\": {\"a\": [1, 2}");
        default:
            return with(end, ",\"provenance\": {\"a\": 1.}");
    }
}

}  // namespace

std::string wrong_file(const std::string &good, dice &chance) {
    if (chance.one_in(8)) return no_file(good, chance);
    json root = json::parse(good);
    if (chance.one_in(2))
        while (!by_key[chance.below(std::size(by_key))](root, chance)) continue;
    else
        while (!mistakes[chance.below(std::size(mistakes))](root)) continue;
    return root.dump(1);
}

std::string rare_file(const std::string &good, dice &chance) {
    json root = json::parse(good);
    for (unsigned i = 0; i < 3; ++i) rarities[chance.below(std::size(rarities))](root);
    std::string text = root.dump(1);
    if (chance.one_in(4))
        text += std::string(most_bytes - text.size(), chance.one_in(2) ? '\n' : '\t');
    return text;
}

}  // namespace compbox::world
