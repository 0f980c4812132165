// SPDX-License-Identifier: MIT
#include "host-tools/commission/config.h"

#include <algorithm>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config/config.h"
#include "firmware/load/load.h"
}

namespace compbox::commission {

namespace {

constexpr double any_position = 1e6;
constexpr double largest_offset_um = 1e6;

// The PLC is on the network; the offsets are samples of the box's own bus.
constexpr cb_target commissioning = {"compbox commission",
                                     1u << CB_SOURCE_PLC | 1u << CB_SOURCE_CAN,
                                     1u << CB_TRANSPORT_TCP | 1u << CB_TRANSPORT_RTU, 0};

const json &list_of(const json &document, const char *key, const std::string &file) {
    const auto found = document.find(key);
    if (found == document.end() || !found->is_array() || found->empty()) {
        throw input_error(file, 0, 0,
                          std::string(key) + " is missing or no list; see compbox init");
    }
    return *found;
}

std::string offset_name(std::size_t channel) {
    return fmt::format("commission.{}", channel);
}

// Signals of the PLC, with a range where the file has none yet.
json plc_signals(const json &signals, std::vector<std::string> &remarks) {
    json kept = json::array();
    std::string open;
    for (json signal : signals) {
        if (!signal.is_object() || !signal.contains("plc")) continue;
        for (const auto &[key, end] : {std::pair{"min", -any_position}, {"max", any_position}}) {
            if (!signal.contains(key) || !signal[key].is_null()) continue;
            signal[key] = end;
            if (key[1] == 'i') open += (open.empty() ? "" : ", ") + signal.value("name", "?");
        }
        kept.push_back(signal);
    }
    if (!open.empty()) {
        remarks.push_back("no range of " + open + " in the file: every position is plausible");
    }
    return kept;
}

// One offset in µm as a signal, and as a term whose negative is the wanted displacement.
void add_offset(json &config, std::size_t channel) {
    const std::string name = offset_name(channel);
    config["signals"].push_back({{"name", name},
                                 {"unit", "um"},
                                 {"can", fmt::format("0x{}", channel + 1)},
                                 {"type", "float32le"},
                                 {"min", -largest_offset_um},
                                 {"max", largest_offset_um},
                                 {"max_age_ms", 5000}});
    config["terms"].push_back(
        {{"name", name}, {"type", "linear"}, {"inputs", {name}}, {"weights", {-1}}});
}

json test_channel(json channel, std::size_t index, double rate_um_per_s) {
    if (!channel.is_object()) return channel;
    channel["sum"] = {offset_name(index)};
    channel["deadband_um"] = 0;
    channel.erase("tangent");
    const double slew = channel.contains("slew_um_per_s") && channel["slew_um_per_s"].is_number()
                            ? channel["slew_um_per_s"].get<double>()
                            : rate_um_per_s;
    channel["slew_um_per_s"] = std::min(slew, rate_um_per_s);
    return channel;
}

// in : a machine or coefficient file, the rate that no offset exceeds
// out: a coefficient file whose channels take an offset each, without terms; remarks on what is
//      left out. Throws input_error that names the file.
json test_file(const json &document, const std::string &file, double rate_um_per_s,
               std::vector<std::string> &remarks) {
    json config;
    for (const char *key : {"format", "revision", "machine", "cycle", "plc", "safety", "pairs"}) {
        if (document.contains(key)) config[key] = document[key];
    }
    if (config.contains("cycle") && config["cycle"].is_object()) config["cycle"]["lead_ms"] = 0;
    config["safety"]["ramp_um_per_s"] = rate_um_per_s;
    config["signals"] = plc_signals(list_of(document, "signals", file), remarks);
    config["terms"] = json::array();
    config["channels"] = json::array();
    for (const json &channel : list_of(document, "channels", file)) {
        const std::size_t index = config["channels"].size();
        add_offset(config, index);
        config["channels"].push_back(test_channel(channel, index, rate_um_per_s));
    }
    return config;
}

std::unique_ptr<cb_config> load(const json &document, const std::string &file) {
    const std::string text = formats::json_text(document);
    auto config = std::make_unique<cb_config>();
    auto scratch = std::make_unique<cb_load_scratch>();
    cb_message message = {};
    if (cb_config_load(config.get(), text.data(), text.size(), &commissioning, scratch.get(),
                       &message) != CB_OK) {
        throw input_error(file, 0, 0, message.text);
    }
    return config;
}

// out: an axis for each channel; the two channels of a pair are one axis, named "X1+X2"
std::vector<test_axis> axes_of(const cb_config &config) {
    std::vector<test_axis> axes;
    for (std::size_t c = 0; c < config.channels_count; ++c) {
        test_axis axis{config.channels[c].name, {c}, 0.0};
        bool second = false;
        for (unsigned p = 0; p < config.pairs_count; ++p) {
            const std::size_t a = config.pairs[p].a, b = config.pairs[p].b;
            if (c != a && c != b) continue;
            const std::size_t other = c == a ? b : a;
            second = other < c;
            axis.name += std::string("+") + config.channels[other].name;
            axis.channels.push_back(other);
            axis.max_difference_um = config.pairs[p].max_difference_um;
        }
        if (!second) axes.push_back(axis);
    }
    return axes;
}

}  // namespace

box_setup make_box_setup(const json &document, const std::string &file, double rate_um_per_s) {
    box_setup setup;
    if (!document.is_object()) throw input_error(file, 0, 0, "must be an object {…}");
    setup.config = load(test_file(document, file, rate_um_per_s, setup.remarks), file);
    setup.axes = axes_of(*setup.config);
    for (std::size_t c = 0; c < setup.config->channels_count; ++c) {
        setup.offset_signal.push_back(setup.config->signals_count - setup.config->channels_count +
                                      c);
    }
    return setup;
}

}  // namespace compbox::commission
