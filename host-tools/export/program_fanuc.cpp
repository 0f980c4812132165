// SPDX-License-Identifier: MIT
// PMC ladder of a FANUC control.
#include <algorithm>
#include <cmath>

#include "host-tools/export/program_parts.h"
#include "host-tools/formats/template.h"

namespace compbox::exports {

namespace {

const char *const ladder_text =
#include "host-tools/export/fanuc.txt.in"
    ;

using kind = fakeplc::number_format::kind;
using order = fakeplc::number_format::order;

// Internal relays: targets, values in the NC, and what the control shows, 4 bytes each.
constexpr std::size_t most_axes = 8;  // bits of a byte
constexpr int first_target = 130, first_held = 180, first_signal = 200;
constexpr int first_shift = 0x31;  // EA: axis 1, machine zero-point shift
constexpr double most_units = 9999.0;
constexpr int scans_of_handshake = 4;

std::string text_of(const std::string &letter, int number) {
    return fmt::format("{}{}", letter, number);
}

class ladder {
  public:
    ladder(const program_parts &parts, int base)
        : parts_(parts),
          base_(base),
          n_(parts.channels.size()),
          scale_um_(parts.channels[0].own.scale_um),
          scan_ms_(parts.file.at("plc").value("scan_ms", 8.0)) {
        check();
    }

    // out: the ladder
    std::string text() const {
        const auto &map = parts_.map;
        json values = {{"source", parts_.source},
                       {"scan_ms", plain_number(scan_ms_)},
                       {"increment_um", plain_number(scale_um_)},
                       {"watchdog_ms", plain_number(parts_.watchdog_ms)},
                       {"watchdog_scans", std::lround(std::ceil(parts_.watchdog_ms / scan_ms_))},
                       {"slope", increments_of(parts_.slope_um_per_s)},
                       {"slope_um_per_s", plain_number(parts_.slope_um_per_s)},
                       {"ramp", increments_of(parts_.ramp_um_per_s)},
                       {"ramp_um_per_s", plain_number(parts_.ramp_um_per_s)},
                       {"status", d(map.status)},
                       {"box_heartbeat", d(map.box_heartbeat)},
                       {"plc_heartbeat", d(map.plc_heartbeat)},
                       {"control", d(map.control)},
                       {"referenced", referenced_bits()},
                       {"read_counters", map.read.counters},
                       {"count_first", d(map.read.start)},
                       {"count_last", d(map.read.end() - 1)},
                       {"handshake", map.handshake.has_value()},
                       {"handshake_low", d(map.handshake.value_or(0))},
                       {"handshake_high", d(map.handshake.value_or(0), 1)}};
        for (const char *list : {"channels", "others", "applied", "signals", "probes"})
            values[list] = json::array();
        for (std::size_t c = 0; c < n_; ++c) add_channel(values, c);
        for (std::size_t s = 0; s < parts_.signals.size(); ++s)
            values["signals"].push_back(signal(s));
        for (std::size_t p = 0; p < parts_.probes.size(); ++p) values["probes"].push_back(probe(p));
        values["probed"] = !parts_.probes.empty();
        values["request"] = map.request.has_value() && !parts_.probes.empty();
        values["request_bit"] = d(map.request.value_or(0)) + ".0";
        return formats::expanded(ladder_text, values);
    }

  private:
    std::string d(int address, int byte = 0) const {
        return text_of("D", base_ + 2 * address + byte);
    }
    // Throws input_error where the ladder cannot have a number of the file.
    void check() const {
        if (n_ > most_axes) {
            parts_.refuse("the ladder has room for {} channels, and the file has {}", most_axes,
                          n_);
        }
        if (parts_.map.axes_at_once) {
            parts_.refuse("plc.axes_at_once: the ladder hands over one axis after the other");
        }
        if (!(scan_ms_ > 0.0)) parts_.refuse("plc.scan_ms: must be above 0");
        for (const auto &one : parts_.channels) {
            const auto &format = one.own.format;
            if (format.what != kind::signed_integer || format.registers != 1 ||
                format.bytes == order::dcba) {
                parts_.refuse("channel {}: the ladder takes offsets of int16", one.own.name);
            }
            if (units_of(one) > most_units) {
                parts_.refuse(
                    "channel {}: its largest offset, {:.9g} um, is beyond {:.9g} increments of "
                    "{:.9g} um",
                    one.own.name, one.size_um, most_units, scale_um_);
            }
        }
        if (parts_.probes.size() > most_axes) {
            parts_.refuse("the ladder has room for {} probes, and the file has {}", most_axes,
                          parts_.probes.size());
        }
        for (const auto &probe : parts_.probes) {
            if (probe.value.format.registers == 1) continue;
            parts_.refuse("signal {}: the ladder takes a probe's value of int16", probe.value.name);
        }
        for (const auto &signal : parts_.signals) {
            if (signal.format.bytes != order::dcba) continue;
            parts_.refuse("signal {}: a PMC has no number of the types le", signal.name);
        }
    }
    double units_of(const program_channel &one) const {
        return std::floor(one.size_um / scale_um_ + 1e-6);
    }
    // A speed as increments in a scan: at least one, and in a round of all axes no step that the NC
    // answers with an alarm.
    long increments_of(double um_per_s) const {
        const double most = most_units / static_cast<double>(scans_of_handshake * (n_ + 1));
        return std::lround(
            std::clamp(um_per_s * 1e-3 * scan_ms_ / scale_um_, 1.0, std::floor(most)));
    }
    json referenced_bits() const {
        json bits = json::array();
        for (int bit = 0; bit < 16; ++bit) {
            if ((parts_.map.referenced_mask >> bit & 1) == 0) continue;
            bits.push_back(
                {{"bit", fmt::format("{}.{}", d(parts_.map.control, bit / 8), bit % 8)}});
        }
        return bits;
    }
    // The others whose turn it may be before an axis, and for each the axes between them.
    json before(std::size_t c) const {
        json all = json::array(), over = json::array();
        for (std::size_t back = 1; back < n_; ++back) {
            const std::size_t other = (c + n_ - back) % n_;
            over.insert(over.begin(), json{{"b", other}});
            all.push_back({{"next", other}, {"over", over}});
        }
        return all;
    }
    // Adds channel c to the template's lists: channels, others but for the first, applied.
    void add_channel(json &values, std::size_t c) const {
        const program_channel &one = parts_.channels[c];
        const int i = static_cast<int>(c);
        json item = {{"i", i + 1},
                     {"b", i},
                     {"name", one.own.name},
                     {"value", d(one.own.address)},
                     {"target", text_of("R", first_target + 2 * i)},
                     {"held", text_of("R", first_held + 2 * i)},
                     {"size", std::lround(units_of(one))},
                     {"size_um", plain_number(one.size_um)},
                     {"ea", first_shift + i},
                     {"after", (c + 1) % n_ + 1},
                     {"before", before(c)}};
        values["channels"].push_back(item);
        if (c > 0) values["others"].push_back(item);
        if (!one.own.applied_address) return;
        item["applied"] = d(*one.own.applied_address);
        values["applied"].push_back(item);
    }
    // The source of a probe's value is an internal relay like that of a signal; its registers are
    // written by [probe] alone.
    json probe(std::size_t p) const {
        const program_probe &one = parts_.probes[p];
        std::size_t s = 0;
        while (parts_.signals[s].address != one.value.address) ++s;
        return {{"b", p},
                {"axis", one.axis},
                {"source_r", text_of("R", first_signal + 4 * static_cast<int>(s))},
                {"value", d(one.value.address)},
                {"count", d(one.count.address)}};
    }
    // A 4-byte number of the PMC has its low word first; one with the high word first goes by
    // words.
    json signal(std::size_t s) const {
        const fakeplc::shown_signal &one = parts_.signals[s];
        const int from = first_signal + 4 * static_cast<int>(s);
        const bool large = one.format.registers == 2;
        json moves = json::array();
        const auto move = [&](const char *instruction, int offset, int byte) {
            moves.push_back({{"move", fmt::format("{}R{} {}", instruction, from + offset,
                                                  d(one.address, byte))}});
        };
        if (!large && !parts_.probe_of(one)) move("SUB 44  MOVW 2 ", 0, 0);
        if (large && one.format.bytes == order::cdab) move("SUB 47  MOVD 4 ", 0, 0);
        if (large && one.format.bytes == order::abcd) {
            move("SUB 44  MOVW 2 ", 2, 0);
            move("SUB 44  MOVW 2 ", 0, 2);
        }
        return {{"name", one.name},
                {"source_r", text_of("R", from)},
                {"bytes", 2 * one.format.registers},
                {"meaning", "in " + plain_number(one.scale)},
                {"moves", moves}};
    }

    const program_parts &parts_;
    int base_;
    std::size_t n_;
    double scale_um_, scan_ms_;
};

}  // namespace

std::string program_fanuc(const program_parts &parts, int pmc_base) {
    return ladder(parts, pmc_base).text();
}

}  // namespace compbox::exports
