// SPDX-License-Identifier: MIT
#include "tests/world/blocks.h"

#include <fmt/core.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>

#include "tests/world/run.h"

namespace compbox::world {

namespace {

std::uint16_t word_in(const std::vector<std::uint16_t> &block, int address, int start) {
    return block[static_cast<std::size_t>(address - start)];
}

double number_in(const fakeplc::number_format &format, int address,
                 const std::vector<std::uint16_t> &block, int start) {
    return format.decode(&block[static_cast<std::size_t>(address - start)]);
}

}  // namespace

bool written_block::is_zero() const {
    const auto zero = [](double value) { return value == 0; };
    return std::all_of(um.begin(), um.end(), zero) && std::all_of(slope.begin(), slope.end(), zero);
}

namespace {

written_block decode(const machine &of, const std::vector<std::uint16_t> &words) {
    const fakeplc::register_map &map = of.map;
    const int start = map.write.start;
    written_block block;
    for (auto *values : {&block.um, &block.slope, &block.reference_mm})
        values->reserve(map.channels.size());
    const unsigned status = word_in(words, map.status, start);
    block.mode = status & 0xFFu;
    block.reason = status >> 8;
    block.detail = map.detail ? word_in(words, *map.detail, start) : 0u;
    block.heartbeat = word_in(words, map.box_heartbeat, start);
    block.counters_agree = !map.write.counters || words.front() == words.back();
    for (std::size_t c = 0; c < map.channels.size(); ++c) {
        const fakeplc::taken_channel &channel = map.channels[c];
        const double raw = number_in(channel.format, channel.address, words, start);
        block.um.push_back(of.channels[c].sign * channel.scale_um * raw);
        const auto &tangent = channel.tangent;
        block.slope.push_back(
            tangent ? of.channels[c].sign * tangent->slope_scale *
                          number_in(tangent->slope_format, tangent->slope_address, words, start)
                    : 0.0);
        block.reference_mm.push_back(
            tangent
                ? tangent->reference_scale_mm *
                      number_in(tangent->reference_format, tangent->reference_address, words, start)
                : 0.0);
    }
    return block;
}

}  // namespace

const written_block &block_of(const machine &of, const exchange &seen) {
    if (seen.decoded_for != &of) seen.decoded = decode(of, seen.written);
    seen.decoded_for = &of;
    return seen.decoded;
}

bool read_head::references(const machine &of) const {
    return (control & of.map.referenced_mask) == of.map.referenced_mask;
}

namespace {

// A probe of a serial line (docs/rtu.md) has the start of the read block and another length.
bool reads(const fakeplc::register_block &block, const exchange &seen) {
    return seen.read.size() == static_cast<std::size_t>(block.count) &&
           seen.read_start == block.start;
}

}  // namespace

bool is_reading(const machine &of, const exchange &seen) {
    return reads(of.map.read, seen);
}

bool is_read_back(const machine &of, const exchange &seen) {
    return reads(of.map.write, seen);
}

bool is_refused_read_back(const machine &of, const exchange &seen) {
    return seen.function == 3 && seen.exception != 0 && seen.read_start == of.map.write.start;
}

read_head head_of(const machine &of, const exchange &seen) {
    const fakeplc::register_map &map = of.map;
    read_head head;
    head.whole = !map.read.counters || seen.read.front() == seen.read.back();
    head.control = word_in(seen.read, map.control, map.read.start);
    head.heartbeat = word_in(seen.read, map.plc_heartbeat, map.read.start);
    if (map.handshake) head.handshake = word_in(seen.read, *map.handshake, map.read.start);
    head.nc_alarm = (head.handshake >> 15 & 1) != 0;
    return head;
}

double signal_in(const machine &of, const fakeplc::shown_signal &signal, const exchange &seen) {
    return number_in(signal.format, signal.address, seen.read, of.map.read.start) * signal.scale +
           signal.zero;
}

void each_signal(const machine &of, const exchange &seen,
                 const std::function<void(const std::string &, double)> &take) {
    if (seen.duration == never || !is_reading(of, seen)) return;
    for (const fakeplc::shown_signal &signal : of.map.signals)
        take(signal.name, signal_in(of, signal, seen));
}

std::optional<double> number_at(const nlohmann::json &entries, const std::string &name,
                                const char *key) {
    for (const auto &entry : entries)
        if (entry.at("name") == name && entry.at(key).is_number()) return entry.at(key);
    return std::nullopt;
}

std::string crc_of(const std::string &text) {
    const auto *bytes = reinterpret_cast<const unsigned char *>(text.data());
    return fmt::format("{:08x}", crc32(0, bytes, static_cast<unsigned>(text.size())));
}

double at_a_limit(double value) {
    return 4e-3 + 1e-6 * std::fabs(value);
}

double applied_in(const machine &of, std::size_t c, const exchange &seen) {
    const fakeplc::taken_channel &channel = of.map.channels[c];
    if (!channel.applied_address) return std::nan("");
    return of.channels[c].sign * channel.scale_um *
           number_in(channel.format, *channel.applied_address, seen.read, of.map.read.start);
}

std::vector<double> all_applied_in(const machine &of, const exchange &seen) {
    std::vector<double> all;
    for (std::size_t c = 0; c < of.channels.size(); ++c) all.push_back(applied_in(of, c, seen));
    return all;
}

bool draws(const run &of, fault_kind kind) {
    return of.options.faults.count(kind) > 0;
}

bool may_be_doubted(const run &of, const std::string &signal) {
    // In a long run temperatures may be where no sensor is expected. Another file may have ended
    // all doubts just now.
    const nlohmann::json sensors = of.box_machine.file().value("sensors", nlohmann::json::object());
    const nlohmann::json names = sensors.value("signals", nlohmann::json::array());
    return std::find(names.begin(), names.end(), signal) != names.end();
}

bool draws_any(const run &of, std::initializer_list<fault_kind> kinds) {
    return std::any_of(kinds.begin(), kinds.end(),
                       [&of](fault_kind kind) { return draws(of, kind); });
}

bool hides_exchanges(const run &of) {
    return draws_any(
        of, {fault_kind::preempt, fault_kind::delay, fault_kind::stall, fault_kind::suspend,
             fault_kind::refuse, fault_kind::slow, fault_kind::hostile, fault_kind::memory,
             fault_kind::foreign, fault_kind::mute, fault_kind::wire, fault_kind::line,
             fault_kind::reset, fault_kind::tear, fault_kind::partial, fault_kind::stray,
             fault_kind::exception, fault_kind::loss, fault_kind::plc_stop});
}

bool hears_measurements(const run &of) {
    return !draws_any(of, {fault_kind::stall, fault_kind::suspend, fault_kind::disk,
                           fault_kind::refuse, fault_kind::partial, fault_kind::clock,
                           fault_kind::boundary, fault_kind::reader, fault_kind::hostile});
}

bool is_steady(const run &of) {
    return longest_lag(of) == 0 &&
           !draws_any(of, {fault_kind::reload, fault_kind::hostile, fault_kind::memory,
                           fault_kind::partial, fault_kind::boundary});
}

bool may_lack_rows(const run &of) {
    return draws_any(of, {fault_kind::disk, fault_kind::refuse, fault_kind::links,
                          fault_kind::partial, fault_kind::reload, fault_kind::hostile});
}

time_ns ramp_ns(const machine &facts, double least_um) {
    double longest_s = 0;
    for (const channel_facts &channel : facts.channels) {
        const double per_s = std::min(channel.slew_um_per_s, facts.ramp_um_per_s);
        longest_s = std::max(longest_s, std::max(channel.limit_um, least_um) / per_s);
    }
    return static_cast<time_ns>(1e9 * std::min(longest_s, 1e6));
}

time_ns longest_lag(const run &of) {
    if (draws_any(of, {fault_kind::stall, fault_kind::suspend})) return never;
    return draws_any(of, {fault_kind::delay, fault_kind::preempt, fault_kind::disk,
                          fault_kind::refuse, fault_kind::slow})
               ? second
               : 0;
}

}  // namespace compbox::world
