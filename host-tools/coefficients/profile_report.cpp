// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/profile_report.h"

#include <algorithm>
#include <cmath>

#include "host-tools/coefficients/load.h"
#include "host-tools/formats/json.h"
#include "host-tools/formats/numbers.h"

extern "C" {
#include "firmware/config/profile.h"
}

namespace compbox::coefficients {

namespace {

std::string text_of(double value) {
    return formatted("%.6g", value);
}

// Six digits of a float, without those that only its binary form has.
double tidy(double value) {
    return std::stod(text_of(value));
}

json functions_of(const cb_profile_facts &facts) {
    json codes = json::array();
    for (int code = 1; code < 32; ++code) {
        if ((facts.functions >> code & 1u) != 0) codes.push_back(code);
    }
    return codes;
}

// The PLC's update of the NC, or the box's period where that is longer or there is no handshake.
double update_ms(const cb_config &config) {
    return std::max(cb_profile_update_us(&config), config.period_us) / 1000.0;
}

json channel_figures(const cb_config &config, const cb_channel_config &channel) {
    const cb_profile_facts &facts = *cb_profile_of(config.plc.profile);
    const double period_s = config.period_us * 1e-6;
    json figures = {{"limit_units", tidy(channel.limit_um / channel.scale)},
                    {"slew_um_per_s", tidy(channel.slew_um_per_s)},
                    {"step_um_per_period", tidy(channel.slew_um_per_s * period_s)},
                    {"step_um_per_update", tidy(channel.slew_um_per_s * update_ms(config) / 1000)}};
    const float most = cb_profile_slew_most(&config, &channel);
    if (facts.value_most > 0) figures["most_units"] = tidy(facts.value_most);
    if (config.plc.step_units > 0) {
        figures["largest_step_um"] = tidy(config.plc.step_units * channel.scale);
        figures["slew_most_um_per_s"] = tidy(most);
    }
    return figures;
}

// What the lead is at least, before any exchange is counted.
double least_lead_ms(const cb_config &config) {
    const uint32_t held_us = (config.period_us + config.plc.interpolate_us) / 2;
    return (held_us + cb_profile_lead_us(&config)) / 1000.0;
}

std::string joined(const json &numbers) {
    std::string text;
    for (const auto &number : numbers) text += (text.empty() ? "" : ", ") + number.dump();
    return text;
}

std::string update_text(const cb_config &config, const json &figures) {
    if (!figures.contains("handshake_ms")) return "";
    return "the NC takes " +
           std::string(config.plc.axes_at_once ? "all values in one handshake"
                                               : "one value after the other") +
           ", about " + text_of(figures["handshake_ms"]) + " ms each: an axis is updated every " +
           text_of(figures["update_ms"]) + " ms\n";
}

std::string channel_text(const std::string &name, const json &channel) {
    std::string text = "channel " + name + ": ±" + text_of(channel["limit_units"]) + " units";
    if (channel.contains("most_units")) text += " of ±" + text_of(channel["most_units"]);
    text += ", at most " + text_of(channel["slew_um_per_s"]) +
            " µm/s: " + text_of(channel["step_um_per_period"]) + " µm in a period, " +
            text_of(channel["step_um_per_update"]) + " µm in an update";
    if (channel.contains("largest_step_um")) {
        text += " (the NC takes " + text_of(channel["largest_step_um"]) +
                " µm at once; a slew above " + text_of(channel["slew_most_um_per_s"]) +
                " µm/s is lowered)";
    }
    return text + "\n";
}

}  // namespace

json profile_figures(const cb_config &config) {
    const cb_profile_facts &facts = *cb_profile_of(config.plc.profile);
    const auto exchange = static_cast<cb_exchange>(config.plc.exchange);
    json figures = {
        {"profile", facts.name},
        {"functions", functions_of(facts)},
        {"exchange", exchange == CB_EXCHANGE_FC23 ? "fc23" : "fc3+fc16"},
        {"read_registers", config.plc.read.count},
        {"read_most", cb_profile_read_most(&facts, exchange)},
        {"write_registers", config.plc.write.count},
        {"write_most",
         std::min<unsigned>(cb_profile_write_most(&facts, exchange), CB_MAX_WRITE_REGISTERS)},
        {"update_ms", update_ms(config)},
        {"deadband_um", tidy(config.plc.deadband_um)},
        {"least_lead_ms", least_lead_ms(config)},
        {"lead_ms", config.lead_measured ? json("measured") : json(config.lead_us / 1000.0)}};
    if (config.plc.interpolate_us > 0)
        figures["interpolate_ms"] = config.plc.interpolate_us / 1000.0;
    if (cb_profile_handshake_us(&config) > 0) {
        figures["handshake_ms"] = cb_profile_handshake_us(&config) / 1000.0;
        figures["axes_at_once"] = config.plc.axes_at_once;
    }
    if (facts.clients > 0) figures["clients"] = facts.clients;
    for (unsigned i = 0; i < config.channels_count; ++i) {
        figures["channels"][config.channels[i].name] = channel_figures(config, config.channels[i]);
    }
    return figures;
}

std::string profile_text(const cb_config &config) {
    const json figures = profile_figures(config);
    std::string text = figures["profile"].get<std::string>() + ": function codes " +
                       joined(figures["functions"]) + "; " +
                       figures["exchange"].get<std::string>() + " reads " +
                       figures["read_registers"].dump() + " of at most " +
                       figures["read_most"].dump() + " registers and writes " +
                       figures["write_registers"].dump() + " of " + figures["write_most"].dump();
    if (figures.contains("clients")) text += "; one client at a time";
    text += "\n" + update_text(config, figures);
    for (const auto &[name, channel] : figures["channels"].items()) {
        text += channel_text(name, channel);
    }
    text += "lead: at least " + text_of(figures["least_lead_ms"]) + " ms and the exchange; ";
    const json &lead = figures["lead_ms"];
    return text +
           (lead.is_string() ? "measured by the box" : "the file has " + text_of(lead) + " ms") +
           "\n";
}

std::vector<std::string> profile_remarks(const cb_config &config) {
    std::vector<std::string> remarks;
    for (unsigned i = 0; i < config.channels_count; ++i) {
        const cb_channel_config &channel = config.channels[i];
        const double step_um = tidy(config.plc.step_units * channel.scale);
        if (step_um == 0.0 || channel.has_applied || 2.0 * tidy(channel.limit_um) <= step_um)
            continue;
        remarks.push_back("channel " + std::string(channel.name) +
                          ": that the NC never sees a change above " + text_of(step_um) +
                          " µm at once holds only while it takes a value every " +
                          text_of(cb_profile_step_window_us(&config) * 1e-6) +
                          " s; give the channel an applied register, or a limit_um of " +
                          text_of(step_um / 2) + " at most");
    }
    return remarks;
}

}  // namespace compbox::coefficients
