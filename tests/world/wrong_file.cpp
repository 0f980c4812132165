// SPDX-License-Identifier: MIT
#include "tests/world/wrong_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>
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

}  // namespace

std::string wrong_file(const std::string &good, dice &chance) {
    json root = json::parse(good);
    while (!mistakes[chance.below(std::size(mistakes))](root)) continue;
    return root.dump(1);
}

}  // namespace compbox::world
