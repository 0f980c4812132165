// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/profile_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "host-tools/coefficients/load.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config/config.h"
#include "firmware/config/profile.h"
}

namespace compbox::coefficients {

namespace {

// out: six digits of a float
double tidy(double value) {
    return std::stod(fmt::format("{:.6g}", value));
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

// out: limits of the channel in the control's units and in µm, rounded for reading; the largest
//      step only where the control has one
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

// out: the smallest lead, without the exchange, ms
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
    return fmt::format(
        "the NC takes {}, about {:.6g} ms each: an axis is updated every {:.6g} ms\n",
        config.plc.axes_at_once ? "all values in one handshake" : "one value after the other",
        figures["handshake_ms"].get<double>(), figures["update_ms"].get<double>());
}

// in : channel_figures' object. out: its line for reading
std::string channel_text(const std::string &name, const json &channel) {
    std::string text =
        fmt::format("channel {}: ±{:.6g} units", name, channel["limit_units"].get<double>());
    if (channel.contains("most_units"))
        text += fmt::format(" of ±{:.6g}", channel["most_units"].get<double>());
    text += fmt::format(", at most {:.6g} µm/s: {:.6g} µm in a period, {:.6g} µm in an update",
                        channel["slew_um_per_s"].get<double>(),
                        channel["step_um_per_period"].get<double>(),
                        channel["step_um_per_update"].get<double>());
    if (channel.contains("largest_step_um")) {
        text += fmt::format(
            " (the NC takes {:.6g} µm at once; a slew above {:.6g} µm/s is lowered)",
            channel["largest_step_um"].get<double>(), channel["slew_most_um_per_s"].get<double>());
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
    std::string text = fmt::format(
        "{}: function codes {}; {} reads {} of at most {} registers and writes {} of {}",
        figures["profile"].get<std::string>(), joined(figures["functions"]),
        figures["exchange"].get<std::string>(), figures["read_registers"].dump(),
        figures["read_most"].dump(), figures["write_registers"].dump(),
        figures["write_most"].dump());
    if (figures.contains("clients")) text += "; one client at a time";
    text += "\n" + update_text(config, figures);
    for (const auto &[name, channel] : figures["channels"].items()) {
        text += channel_text(name, channel);
    }
    text += fmt::format("lead: at least {:.6g} ms and the exchange; ",
                        figures["least_lead_ms"].get<double>());
    const json &lead = figures["lead_ms"];
    return text +
           (lead.is_string() ? "measured by the box"
                             : fmt::format("the file has {:.6g} ms", lead.get<double>())) +
           "\n";
}

std::vector<std::string> profile_remarks(const cb_config &config) {
    std::vector<std::string> remarks;
    for (unsigned i = 0; i < config.channels_count; ++i) {
        const cb_channel_config &channel = config.channels[i];
        const double step_um = tidy(config.plc.step_units * channel.scale);
        if (step_um == 0.0 || channel.has_applied || 2.0 * tidy(channel.limit_um) <= step_um)
            continue;
        remarks.push_back(fmt::format(
            "channel {}: that the NC never sees a change above {:.6g} µm at once holds only while "
            "it takes a value every {:.6g} s; give the channel an applied register, or a limit_um "
            "of {:.6g} at most",
            channel.name, step_um, cb_profile_step_window_us(&config) * 1e-6, step_um / 2));
    }
    return remarks;
}

}  // namespace compbox::coefficients
