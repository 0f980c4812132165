// SPDX-License-Identifier: MIT
#include "host-tools/commission/checks.h"

#include <algorithm>
#include <cmath>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/box/box.h"
#include "firmware/config/profile.h"
#include "firmware/signals/plausible.h"
#include "firmware/wire/number.h"
}

namespace compbox::commission {

namespace {

constexpr double looking_s = 1.5;   // at the read block
constexpr double enabling_s = 5.0;  // for enable and referenced
constexpr double applying_s = 5.0;
constexpr double returning_s = 3.0;  // to ACTIVE, after a loss

std::string registers_of(const cb_block_config &block) {
    return fmt::format("registers {} to {}", block.start, block.start + block.count - 1);
}

std::string exception_words(int code) {
    if (code == 0) return "";
    static const char *const words[] = {"", ": it does not know the function code",
                                        ": it has no such registers", ": it refuses the length"};
    return fmt::format(" (exception {}{})", code, code < 4 ? words[code] : "");
}

// out: "register N" for an index in the read block
std::string register_name(const live_box &live, unsigned index) {
    return fmt::format("register {}", live.config().plc.read.start + index);
}

bool is_own(const box_setup &setup, unsigned signal) {
    return std::count(setup.offset_signal.begin(), setup.offset_signal.end(), signal) > 0;
}

double value_of(const live_box &live, const cb_signal_config &signal) {
    const auto type = static_cast<cb_number_type>(signal.type);
    const float raw = cb_number_decode(type, live.registers() + signal.reg);
    return static_cast<double>(raw) * signal.scale + signal.zero;
}

std::string out_of_range(const live_box &live, const cb_signal_config &signal) {
    return fmt::format(
        "signals.{}: {} gives {:.7g} {}, outside {:.7g} to {:.7g}; look at its address, type (word "
        "order) and scale, or at min and max",
        signal.name, register_name(live, signal.reg), value_of(live, signal), signal.unit,
        signal.min, signal.max);
}

// Reads until the signal has been in range for a second; throws input_error otherwise.
void check_signals(live_box &live, const box_setup &setup, json &found) {
    const cb_config &config = live.config();
    for (unsigned i = 0; i < config.signals_count; ++i) {
        const cb_signal_config &signal = config.signals[i];
        if (is_own(setup, i)) continue;
        const double value = value_of(live, signal);
        if (!cb_signal_in_range(&signal, static_cast<float>(value))) {
            throw input_error(out_of_range(live, signal));
        }
        found["signals"][signal.name] = value;
    }
}

void must_answer(live_box &live) {
    const cb_plc_config &plc = live.config().plc;
    if (live.cycle_until(looking_s, [&] { return live.read_ok(); })) return;
    const int code = live.last_exception();
    if (code > 0) {
        throw input_error(fmt::format("plc.read: {} refuses to read {}{}", live.peer(),
                                      registers_of(plc.read), exception_words(code)));
    }
    throw input_error(live.no_reply());
}

// The heartbeat over some seconds; out: ms from one count to the next.
double count_heartbeat(live_box &live) {
    const cb_plc_config &plc = live.config().plc;
    unsigned first = live.registers()[plc.plc_heartbeat], last = first;
    const std::int64_t first_us = live.read_us();
    std::int64_t last_us = first_us;
    long long beats = 0;
    int readings = 0;
    live.cycle_until(4.0 * looking_s, [&] {
        if (!live.read_ok()) return false;
        const unsigned now = live.registers()[plc.plc_heartbeat];
        const auto counted = static_cast<std::uint16_t>(now - last);
        if (counted > 0x7FFF) {
            throw input_error(
                fmt::format("plc.plc_heartbeat: {} goes back from {} to {}; the PLC program has to "
                            "count it up by one, from 65535 to 0",
                            register_name(live, plc.plc_heartbeat), last, now));
        }
        beats += counted;
        last = now;
        last_us = live.read_us();
        ++readings;
        return readings >= 20 && static_cast<double>(last_us - first_us) > 1e6 * looking_s;
    });
    if (readings < 20)
        throw input_error("plc.read: readings fail again and again; is the line busy?");
    if (beats == 0) {
        throw input_error(
            fmt::format("plc.plc_heartbeat: {} stays at {}; the PLC program has to count it up "
                        "when fresh positions came from the NC",
                        register_name(live, plc.plc_heartbeat), first));
    }
    return static_cast<double>(last_us - first_us) / 1000.0 / static_cast<double>(beats);
}

// Throws input_error where the PLC refuses the box's writes, does not confirm them, or does not
// answer the read-back; the sentence names the registers and the remedy.
void must_accept_writes(live_box &live) {
    const cb_plc_config &plc = live.config().plc;
    const bool refused = live.writes_refused() > 0;
    const bool mute = live.reason() == CB_REASON_UNCONFIRMED;
    const int code = refused ? live.last_exception() : 0;
    if (!refused && !mute) return;
    if (live.found_read_back() == read_back::unanswered) {
        throw input_error(fmt::format(
            "plc.write: the PLC does not answer when {} are read back (function 3), and the box "
            "writes nothing before; let its server answer readings of the write block",
            registers_of(plc.write)));
    }
    throw input_error(fmt::format(
        "plc.write: the PLC {} writes to {}{}; {}", refused ? "refuses" : "does not confirm",
        registers_of(plc.write), exception_words(code),
        code == 1 ? live.write_remedy()
                  : "look at address, count and access rights of its server"));
}

// out: cause of a missing permission at the start
std::string pending_by_read_back(const live_box &live) {
    if (live.found_read_back() != read_back::refused) return "";
    return fmt::format(
        "; the PLC refuses the read-back of {}{}, so each start counts as a loss: let its server "
        "answer readings of the write block",
        registers_of(live.config().plc.write), exception_words(live.read_back_exception()));
}

// out: cause of a mode other than ACTIVE
std::string why(const live_box &live) {
    const cb_plc_config &plc = live.config().plc;
    const unsigned control = live.registers()[plc.control];
    const std::string word =
        fmt::format(": {} is 0x{:04x}; ", register_name(live, plc.control), control);
    switch (live.reason()) {
        case CB_REASON_NOT_ENABLED:
            return fmt::format(
                "plc.control: the PLC has not set enable (bit 0){}release the compensation on the "
                "control",
                word);
        case CB_REASON_NOT_REFERENCED:
            return fmt::format(
                "plc.control: an axis is not referenced (bits 0x{:04x}){}reference the axes",
                plc.referenced_mask, word);
        case CB_REASON_WAIT_ENABLE:
            return fmt::format(
                "plc.control: after a loss the box waits for permit resume (bit 3) or a new edge "
                "of enable{}set one{}",
                word, pending_by_read_back(live));
        case CB_REASON_OVERRUN:
        case CB_REASON_CLOCK:
            return "this computer is too busy for the period of the file; end other programs, or "
                   "run "
                   "as root";
        default:
            break;
    }
    return fmt::format("{} (docs/faults.md, reason {})",
                       cb_reason_text(static_cast<std::uint8_t>(live.reason())), live.reason());
}

// out: largest difference of an applied value from the written one, µm
double tolerance_um(const live_box &live, std::size_t channel) {
    return live.config().plc.deadband_um + 1.01 * live.config().channels[channel].scale;
}

bool is_member(const test_axis &axis, std::size_t channel) {
    return std::count(axis.channels.begin(), axis.channels.end(), channel) > 0;
}

// out: a channel that differs from its target; nothing: none
std::optional<std::size_t> not_applied(const live_box &live, const test_axis &axis,
                                       double offset_um) {
    for (std::size_t c = 0; c < live.config().channels_count; ++c) {
        const double wanted_um = is_member(axis, c) ? offset_um : 0.0;
        const double off_um = live.applied_um(c).value_or(wanted_um) - wanted_um;
        if (!(std::abs(off_um) <= tolerance_um(live, c))) return c;
    }
    return std::nullopt;
}

// in : a channel whose applied value differs from the offset, in µm
// Throws input_error that distinguishes exchanged registers from a value that was not applied.
[[noreturn]] void refuse_applied(const live_box &live, const test_axis &axis, std::size_t channel,
                                 double offset_um) {
    const cb_channel_config &of = live.config().channels[channel];
    const std::string place = fmt::format("channels.{}.applied: ", of.name);
    const std::string shows = fmt::format("{} shows {:.7g} µm", register_name(live, of.applied_reg),
                                          *live.applied_um(channel));
    if (!is_member(axis, channel)) {
        throw input_error(fmt::format(
            "{}{} though only {} was given an offset; registers of two channels are mixed up",
            place, shows, axis.name));
    }
    throw input_error(
        fmt::format("{}{} where {:.7g} µm were written; the PLC does not take the value over, or "
                    "address, type or scale differ",
                    place, shows, offset_um));
}

}  // namespace

json check_registers(live_box &live, const box_setup &setup) {
    json found = {{"signals", json::object()}};
    must_answer(live);
    const double update_ms = count_heartbeat(live);
    must_accept_writes(live);
    if (!live.cycle_until(1.0, [&] { return live.read_ok(); })) must_answer(live);
    check_signals(live, setup, found);
    if (live.reads_torn() > 10) {
        throw input_error(
            "plc.read.counters: first and last register of the block differ again "
            "and again; the PLC has to write both in each update");
    }
    found["control"] = live.registers()[live.config().plc.control];
    found["exchange"] = live.config().plc.exchange == CB_EXCHANGE_FC23 ? "fc23" : "fc3+fc16";
    found["update_ms"] = update_ms;
    found["read_back"] = live.found_read_back() == read_back::refused ? "refused" : "answered";
    return found;
}

std::string read_back_remark(const live_box &live) {
    if (live.found_read_back() != read_back::refused) return "";
    return fmt::format(
        "the PLC refuses the read-back of {}{}; at each start outputs begin at applied, or at zero "
        "for a channel without it, and the box waits for permit resume or a new edge of enable, "
        "unless its state file (compboxd --state) says STOPPED; let the PLC's server answer "
        "readings (function 3) of the write block",
        registers_of(live.config().plc.write), exception_words(live.read_back_exception()));
}

void must_be_active(const live_box &live) {
    const bool fault = live.mode() == CB_MODE_FAULT;
    const bool withdrawn =
        live.reason() == CB_REASON_NOT_ENABLED || live.reason() == CB_REASON_NOT_REFERENCED;
    if (live.mode() == CB_MODE_ACTIVE) return;
    if (fault || withdrawn || live.inactive_s() > returning_s) throw input_error(why(live));
}

void become_active(live_box &live) {
    if (!live.cycle_until(enabling_s, [&] { return live.mode() == CB_MODE_ACTIVE; })) {
        throw input_error(why(live));
    }
}

void go_to(live_box &live, const test_axis &axis, double offset_um) {
    for (const std::size_t channel : axis.channels) live.set_offset_um(channel, offset_um);
    const auto there = [&] {
        return std::all_of(axis.channels.begin(), axis.channels.end(), [&](std::size_t c) {
            return std::abs(live.output_um(c) - offset_um) <= live.config().channels[c].scale;
        });
    };
    const auto watched = [&](const auto &done) {
        return [&live, done] {
            must_be_active(live);
            return done();
        };
    };
    double slowest_s = 0.0;
    for (const std::size_t channel : axis.channels) {
        const cb_channel_config &of = live.config().channels[channel];
        slowest_s = std::max(slowest_s, 2.0 * std::abs(offset_um) / of.slew_um_per_s +
                                            std::abs(live.output_um(channel)) / of.slew_um_per_s);
    }
    if (!live.cycle_until(2.0 + slowest_s, watched(there))) {
        throw input_error(fmt::format(
            "axis {}: the box does not reach {:.7g} µm; is limit_um or max_difference_um below it?",
            axis.name, offset_um));
    }
    const auto applied = [&] { return live.read_ok() && !not_applied(live, axis, offset_um); };
    if (live.cycle_until(applying_s, watched(applied))) return;
    refuse_applied(live, axis, not_applied(live, axis, offset_um).value_or(axis.channels.front()),
                   offset_um);
}

void stay_active(live_box &live, double seconds) {
    live.cycle_until(seconds, [&] {
        must_be_active(live);
        return false;
    });
}

}  // namespace compbox::commission
