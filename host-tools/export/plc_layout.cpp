// SPDX-License-Identifier: MIT
#include "host-tools/export/plc_layout.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "host-tools/formats/csv.h"

namespace compbox::exports {

namespace {

fakeplc::number_format word() {
    return fakeplc::number_format::parse("uint16").value();
}

// A name that every control takes: letters, digits and underscores.
std::string plain(const std::string &name) {
    std::string text = name;
    for (char &c : text) {
        if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
    }
    return text;
}

class layout {
  public:
    explicit layout(const fakeplc::register_map &map) : map_(map) {}

    void add(int address, const fakeplc::number_format &format, const std::string &name,
             const std::string &meaning) {
        for (auto &other : all_) {
            if (other.address != address) continue;
            other.meaning += "; " + meaning;
            return;
        }
        const bool written = address >= map_.write.start && address < map_.write.end();
        all_.push_back({address, format, unique(plain(name)), meaning, written});
    }
    void add_word(int address, const std::string &name, const std::string &meaning) {
        add(address, word(), name, meaning);
    }
    std::vector<laid_register> by_address() {
        std::sort(all_.begin(), all_.end(),
                  [](const auto &a, const auto &b) { return a.address < b.address; });
        return all_;
    }

  private:
    bool taken(const std::string &name) const {
        return std::any_of(all_.begin(), all_.end(),
                           [&name](const auto &other) { return other.name == name; });
    }
    std::string unique(const std::string &name) const {
        std::string result = name;
        for (int i = 2; taken(result); ++i) result = fmt::format("{}_{}", name, i);
        return result;
    }

    const fakeplc::register_map &map_;
    std::vector<laid_register> all_;
};

std::string scaled(double scale, const char *unit) {
    return fmt::format("in {}{}", scale, *unit ? std::string(" ") + unit : "");
}

void add_counters(layout &to, const fakeplc::register_block &block, const std::string &name,
                  const std::string &who) {
    if (!block.counters) return;
    to.add_word(
        block.start, name + "_count_first",
        who + " increments it by one per update; consistent block: equal to the last register");
    to.add_word(
        block.end() - 1, name + "_count_last",
        who + " increments it by one per update; consistent block: equal to the first register");
}

void add_signal(layout &to, const fakeplc::shown_signal &signal) {
    std::string meaning = fmt::format("signal {} {}", signal.name, scaled(signal.scale, ""));
    if (signal.zero != 0.0) meaning += fmt::format(", 0 is {}", signal.zero);
    to.add(signal.address, signal.format, "signal_" + signal.name, meaning);
}

std::string size_of(const fakeplc::taken_channel &channel,
                    const std::map<std::string, double> &least_um, double ahead_mm) {
    const auto found = least_um.find(channel.name);
    if (found == least_um.end()) return "";
    const std::string ahead =
        channel.tangent ? fmt::format(" with AHEAD_MM {}", ahead_mm) : std::string();
    return fmt::format("; largest offset in the PLC program: at least {} um{}", found->second,
                       ahead);
}

// Adds the channel's value, and its applied value, slope and reference where it has them.
void add_channel(layout &to, const fakeplc::taken_channel &channel,
                 const std::map<std::string, double> &least_um, double ahead_mm) {
    const std::string scale = scaled(channel.scale_um, "um");
    to.add(channel.address, channel.format, "value_" + channel.name,
           fmt::format("compensation of {} {}{}", channel.name, scale,
                       size_of(channel, least_um, ahead_mm)));
    if (channel.applied_address) {
        to.add(*channel.applied_address, channel.format, "applied_" + channel.name,
               fmt::format("what the PLC applies of {} {}", channel.name, scale));
    }
    if (!channel.tangent) return;
    to.add(channel.tangent->slope_address, channel.tangent->slope_format, "slope_" + channel.name,
           "tan beta of " + channel.name + " " + scaled(channel.tangent->slope_scale, ""));
    to.add(channel.tangent->reference_address, channel.tangent->reference_format,
           "reference_" + channel.name,
           "P0 of " + channel.name + " " + scaled(channel.tangent->reference_scale_mm, "mm"));
}

}  // namespace

double usual_ahead_mm(std::size_t channels) {
    return std::ceil(40.0 / 3.0 * static_cast<double>(std::max<std::size_t>(channels, 3)) - 1e-6);
}

std::string number_type(const fakeplc::number_format &format) {
    const bool integer = format.what == fakeplc::number_format::kind::signed_integer;
    const std::string base = format.what == fakeplc::number_format::kind::floating ? "float"
                             : integer                                             ? "int"
                                                                                   : "uint";
    const std::string order = format.bytes == fakeplc::number_format::order::cdab   ? "cdab"
                              : format.bytes == fakeplc::number_format::order::dcba ? "le"
                                                                                    : "";
    return fmt::format("{}{}{}", base, 16 * format.registers, order);
}

std::map<std::string, double> least_sizes_um(const json &file) {
    const auto number = [](const json &of, const char *key) {
        return of.is_object() && of.contains(key) && of.at(key).is_number()
                   ? std::optional(of.at(key).get<double>())
                   : std::nullopt;
    };
    std::map<std::string, double> least_um;
    const json channels = file.value("channels", json::array());
    const double ahead_mm = usual_ahead_mm(channels.size());
    for (const auto &channel : channels) {
        const auto limit_um = number(channel, "limit_um");
        if (!limit_um || !channel.contains("name") || !channel.at("name").is_string()) continue;
        const json tangent = channel.value("tangent", json::object());
        const double ahead_um = 1e3 * number(tangent, "slope_limit").value_or(0.0) * ahead_mm;
        least_um[channel.at("name").get<std::string>()] = *limit_um + ahead_um;
    }
    return least_um;
}

std::vector<laid_register> lay_out(const fakeplc::register_map &map,
                                   const std::map<std::string, double> &least_sizes_um) {
    layout all(map);
    all.add_word(map.control, "control",
                 fmt::format("bits 0 enable, 2 reset, 3 permit resume; referenced: mask {}",
                             map.referenced_mask));
    all.add_word(map.plc_heartbeat, "plc_heartbeat", "counts up with fresh positions");
    if (map.handshake) all.add_word(*map.handshake, "handshake", "of the PLC with the NC");
    all.add_word(map.status, "status", "low byte mode, high byte reason");
    all.add_word(map.box_heartbeat, "box_heartbeat", "counts up with each cycle of the box");
    if (map.request) all.add_word(*map.request, "request", "bit 0: please probe again");
    if (map.detail) all.add_word(*map.detail, "detail", "high byte cause, low byte 1 + index");
    add_counters(all, map.read, "read", "PLC");
    add_counters(all, map.write, "write", "box");
    for (const auto &signal : map.signals) add_signal(all, signal);
    for (const auto &channel : map.channels) {
        add_channel(all, channel, least_sizes_um, usual_ahead_mm(map.channels.size()));
    }
    return all.by_address();
}

}  // namespace compbox::exports
