// SPDX-License-Identifier: MIT
// Faults of the PLC, its operator, its sensors, other clients and the cable.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "tests/world/faults.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

constexpr time_ns lie_period = 40 * ms;

enum lie_way { not_a_number, stuck, jump, out_of_range, noise, drift, at_bound, lie_ways };

// Words of a number that a register of this format can hold, but the sensor never means.
std::vector<std::uint16_t> odd_words(const fakeplc::number_format &format, dice &chance) {
    static const std::vector<std::vector<std::uint16_t>> odd_floats = {
        {0x7FC0, 0}, {0x7F80, 0},      {0xFF80, 0},      {0x7F80, 0}, {0xFF80, 0},
        {0x0000, 1}, {0x7F7F, 0xFFFF}, {0xFFFF, 0xFFFF}, {0x8000, 0}};
    static const std::vector<std::uint16_t> odd = {0x0000, 0x7FFF, 0x8000, 0xFFFF};
    if (format.what == fakeplc::number_format::kind::floating) return chance.one_of(odd_floats);
    std::vector<std::uint16_t> words;
    for (int i = 0; i < format.registers; ++i) words.push_back(chance.one_of(odd));
    return words;
}

}  // namespace

// ---- operator

void fault_injector::plan_operator() {
    repeat(fault_kind::enable, 8 * second, [this] {
        dice &drawn = chance(fault_kind::enable);
        const bool on = drawn.one_in(2);
        fakeplc::fake_plc &control = of_.plc.control;
        of_.plc.catch_up();
        switch (drawn.below(5)) {
            case 0:
                set_references(on);
                break;
            case 1:
                note(fault_kind::enable, on ? "permit resume on" : "permit resume off");
                control.set_permit(on);
                break;
            case 2:
                note(fault_kind::enable, "reset");
                of_.plc.hold_reset(
                    of_.time.now() +
                    (on ? static_cast<time_ns>(drawn.log_between(1e9, 20e9)) : time_ns{0}));
                break;
            default:
                note(fault_kind::enable, on ? "enable on" : "enable off");
                control.set_enable(on);
                if (on) control.press_reset();
        }
    });
    repeat(fault_kind::reset, 20 * second, [this] {
        note(fault_kind::reset, "the PLC resets its connections");
        of_.plc.close_all();
    });
    repeat(fault_kind::reset, 40 * second, [this] {
        const auto lasts = static_cast<time_ns>(chance(fault_kind::reset).log_between(1e9, 60e9));
        note(fault_kind::reset, fmt::format("each third write is reset for {} ms", lasts / ms));
        resets_until_ = of_.time.now() + lasts;
    });
    repeat(fault_kind::exception, 20 * second, [this] {
        static const std::vector<int> functions = {3, 16, 23};
        dice &drawn = chance(fault_kind::exception);
        refused_function_ = drawn.one_of(functions);
        refused_code_ = static_cast<int>(1 + drawn.below(6));
        const auto lasts = static_cast<time_ns>(drawn.log_between(50e6, 20e9));
        refuses_until_ = of_.time.now() + lasts;
        note(fault_kind::exception, fmt::format("function {} gives exception {} for {} ms",
                                                refused_function_, refused_code_, lasts / ms));
    });
    repeat(fault_kind::exception, 20 * second, [this] { hide_block(); });
}

// While the NC stands, enable goes off or has just gone: in HOLD, or while the outputs are on their
// way to zero. It may be back before the NC is.
void fault_injector::lose_while_off() {
    dice own(of_.options.seed + static_cast<std::uint64_t>(of_.time.now()), "lose while off");
    if (!own.one_in(2)) return;
    note(fault_kind::plc_stop, "enable goes off while the NC stands, or just before");
    const time_ns noticed = of_.box_machine.heartbeat_timeout_us * us;
    const bool in_hold = own.one_in(2);
    const time_ns stands = in_hold ? 0 : own.time_between(0, 300 * ms);
    const time_ns off = in_hold ? noticed + own.time_between(20 * ms, 300 * ms) : 0;
    const time_ns known = std::max(stands + noticed, off);
    fakeplc::fake_plc &control = of_.plc.control;
    later(stands, [this, &control] {
        if (active_) control.freeze_nc(true);
    });
    later(off, [this, &control] {
        if (active_) control.set_enable(false);
    });
    later(known + own.time_between(50 * ms, 500 * ms), [this, &control] {
        if (active_) control.set_enable(true);  // else the operator does, when a file was taken
    });
    later(known + own.time_between(200 * ms, 800 * ms), [&control] { control.freeze_nc(false); });
}

// An axis may lose its reference alone.
void fault_injector::set_references(bool on) {
    dice &drawn = chance(fault_kind::enable);
    std::vector<std::uint16_t> bits;
    for (unsigned bit = 1; bit <= of_.box_machine.map.referenced_mask; bit *= 2)
        if (of_.box_machine.map.referenced_mask & bit)
            bits.push_back(static_cast<std::uint16_t>(bit));
    const bool alone = !on && bits.size() > 1 && drawn.one_in(2);
    of_.plc.unreferenced = alone ? drawn.one_of(bits) : std::uint16_t{0};
    of_.plc.control.set_referenced(on || alone);
    if (!on && drawn.one_in(2))
        later(static_cast<time_ns>(drawn.log_between(100e6, 10e9)), [this] {
            of_.plc.unreferenced = 0;
            of_.plc.control.set_referenced(true);
        });
    note(fault_kind::enable, alone ? "one axis not referenced"
                             : on  ? "referenced"
                                   : "not referenced");
}

// A PLC that answers readings all the time.
void fault_injector::plan_muteness() {
    repeat(fault_kind::mute, 15 * second, [this] {
        dice &drawn = chance(fault_kind::mute);
        const auto lasts = static_cast<time_ns>(drawn.log_between(200e6, 30e9));
        const time_ns until = of_.time.now() + lasts;
        const std::uint64_t way = drawn.below(4);
        if (way != 0) no_writes_until_ = until;
        if (way <= 2) no_read_backs_until_ = until;
        garbles_ = drawn.one_in(2);
        note(fault_kind::mute, fmt::format("no {} has a{} reply for {} ms",
                                           way == 0   ? "read-back"
                                           : way <= 2 ? "write and no read-back"
                                                      : "write",
                                           garbles_ ? " valid" : "", lasts / ms));
    });
    repeat(fault_kind::mute, 15 * second, [this] { mute_while_it_stands(); });
}

// For some periods in which the heartbeat stands neither writes nor read-backs have a reply. What
// the PLC holds then is the box's own, and no restart.
void fault_injector::mute_while_it_stands() {
    dice &drawn = chance(fault_kind::mute);
    const time_ns lasts = drawn.time_between(3, 16) * of_.box_machine.period_us * us;
    note(fault_kind::mute,
         fmt::format("for {} ms nothing but readings has a reply, and the NC coupling is frozen",
                     lasts / ms));
    no_writes_until_ = no_read_backs_until_ = of_.time.now() + lasts;
    fakeplc::fake_plc &control = of_.plc.control;
    control.freeze_nc(true);
    later(lasts + drawn.time_between(0, 2 * second), [&control] { control.freeze_nc(false); });
}

// Its server is silent for some periods, and then returns the block that the box reads alone.
void fault_injector::hide_block() {
    dice &drawn = chance(fault_kind::exception);
    const std::int64_t silent = drawn.time_between(0, 20);
    const auto lasts = static_cast<time_ns>(drawn.log_between(100e6, 20e9));
    const time_ns silent_ns = silent * of_.box_machine.period_us * us;
    note(fault_kind::exception,
         fmt::format("the PLC is silent for {} periods and refuses to return the write block for "
                     "{} ms",
                     silent, lasts / ms));
    hides_block_until_ = of_.time.now() + silent_ns + lasts;
    silent_until_ = of_.time.now() + silent_ns;
}

// ---- PLC

void fault_injector::plan_plc() {
    repeat(fault_kind::plc_stop, 15 * second, [this] {
        dice &drawn = chance(fault_kind::plc_stop);
        // Now and then for a break.
        const auto lasts = static_cast<time_ns>(drawn.one_in(8) ? drawn.log_between(30e9, 600e9)
                                                                : drawn.log_between(20e6, 30e9));
        const std::string end = fmt::format(" for {} ms", lasts / ms);
        plc_side &plc = of_.plc;
        plc.catch_up();
        switch (drawn.below(6)) {
            case 0:
                note(fault_kind::plc_stop, "the PLC does not answer" + end);
                plc.serves = false;
                later(lasts, [&plc] { plc.serves = true; });
                break;
            case 1:
                note(fault_kind::plc_stop, "the PLC program stops" + end);
                plc.stop_program(true);
                later(lasts, [&plc] { plc.stop_program(false); });
                break;
            case 2:
                note(fault_kind::plc_stop, "the cable is unplugged" + end);
                of_.net.plugged = false;
                later(lasts, [this] { of_.net.plugged = true; });
                if (!drawn.one_in(2)) break;
                later(lasts / 2, [this, &plc] {
                    if (active_) plc.stop_program(true);  // it stands when it is back
                });
                later(lasts + drawn.time_between(100 * ms, 2 * second),
                      [&plc] { plc.stop_program(false); });
                break;
            case 3:
                lose_while_off();
                note(fault_kind::plc_stop, "the NC coupling freezes" + end);
                plc.control.freeze_nc(true);
                later(lasts, [&plc] { plc.control.freeze_nc(false); });
                break;
            default: {
                const bool keeps = drawn.one_in(2);
                note(fault_kind::plc_stop,
                     std::string("the PLC restarts with ") +
                         (keeps ? "the box's registers kept" : "registers zero") + end);
                plc.restart(keeps, lasts);
                if (drawn.one_in(2))
                    plc.heartbeat_offset = static_cast<std::uint16_t>(drawn.next());
            }
        }
    });
    repeat(fault_kind::plc_stop, 15 * second, [this] { lose_while_off(); });
    if (!has(fault_kind::boundary)) return;
    // Soon after the start of the run the PLC's heartbeat passes 65535.
    of_.plc.heartbeat_offset =
        static_cast<std::uint16_t>(65535 - chance(fault_kind::boundary).below(2000));
}

// ---- other clients

void fault_injector::plan_foreign() {
    repeat(fault_kind::foreign, 8 * second, [this] {
        dice &drawn = chance(fault_kind::foreign);
        const fakeplc::register_map &map = of_.box_machine.map;
        const auto lasts = static_cast<time_ns>(drawn.log_between(20e6, 20e9));
        of_.plc.catch_up();
        switch (drawn.below(7)) {
            case 0: {
                const int taken = static_cast<int>(1 + drawn.below(8));
                note(fault_kind::foreign,
                     fmt::format("{} other clients are connected for {} ms", taken, lasts / ms));
                of_.plc.foreign_clients = taken;
                later(lasts, [this] { of_.plc.foreign_clients = 0; });
                break;
            }
            case 1: {
                note(fault_kind::foreign, "another client writes zeros");
                of_.plc.write_foreign(
                    map.write.start,
                    std::vector<std::uint16_t>(static_cast<std::size_t>(map.write.count)));
                break;
            }
            case 2: {
                const fakeplc::taken_channel &channel = drawn.one_of(map.channels);
                note(fault_kind::foreign, "another client writes channel " + channel.name);
                of_.plc.write_foreign(channel.address, odd_words(channel.format, drawn));
                break;
            }
            case 3:
                write_again_and_again(drawn);
                break;
            case 4:
            case 5:
                write_back_late(drawn);
                break;
            default: {
                const int at =
                    map.write.start +
                    static_cast<int>(drawn.below(static_cast<std::uint64_t>(map.write.count)));
                const auto word = static_cast<std::uint16_t>(drawn.next());
                note(fault_kind::foreign,
                     fmt::format("another client writes {} to register {}", word, at));
                of_.plc.write_foreign(at, {word});
            }
        }
    });
    repeat(fault_kind::foreign, 8 * second,
           [this] { lie_about_applied(chance(fault_kind::foreign)); });
}

// A client that reads, thinks, and writes back what is old meanwhile: a channel or all of them.
// While it has the server, others may have no replies.
void fault_injector::write_back_late(dice &drawn) {
    const fakeplc::register_map &map = of_.box_machine.map;
    if (!of_.box_machine.pairs.empty() && drawn.one_in(2)) {
        tear_pair(of_.time.now() + 60 * second, std::nan(""), std::nan(""));
        return;
    }
    const fakeplc::taken_channel &channel = drawn.one_of(map.channels);
    const bool all = drawn.one_in(4);
    const int at = all ? map.write.start : channel.address;
    const auto words = of_.plc.registers(at, all ? map.write.count : channel.format.registers);
    const auto pause = static_cast<time_ns>(drawn.log_between(50e6, 5e9));
    note(fault_kind::foreign, fmt::format("another client reads {}, and writes it back after {} ms",
                                          all ? "the write block" : channel.name, pause / ms));
    if (drawn.chance(0.75))
        no_writes_until_ = no_read_backs_until_ = of_.time.now() + pause + 100 * ms;
    later(pause, [this, at, words] {
        if (!active_) return;
        of_.plc.catch_up();
        of_.plc.write_foreign(at, words);
    });
}

double fault_injector::in_plc_um(const fakeplc::taken_channel &channel) const {
    const auto words = of_.plc.registers(channel.address, channel.format.registers);
    return channel.scale_um * channel.format.decode(words.data());
}

// Waits until two motors of a stage move at the limit of their difference. Then the one behind is
// put back to where it is now, at the end of an outage in which both move on a little.
void fault_injector::tear_pair(time_ns until, double first_um, double second_um) {
    if (!active_ || of_.time.now() >= until) return;
    const machine &facts = of_.box_machine;
    const pair_facts &pair = facts.pairs.front();
    const auto &one = facts.map.channels[pair.first], &other = facts.map.channels[pair.second];
    of_.plc.catch_up();
    const double a_um = facts.channels[pair.first].sign * in_plc_um(one);
    const double b_um = facts.channels[pair.second].sign * in_plc_um(other);
    const double way_um = a_um - first_um;
    const time_ns period_ns = facts.period_us * us;
    const double unit_um =
        std::max(facts.channels[pair.first].unit_um, facts.channels[pair.second].unit_um);
    const double far_um = std::max(3 * unit_um, 0.01 * pair.most_um);
    const bool moves = way_um * (b_um - second_um) > 0 && std::fabs(way_um) > far_um &&
                       std::fabs(b_um - second_um) > far_um;
    if (moves && std::fabs(a_um - b_um) > pair.most_um - 2 * unit_um - 1e-3) {
        note(fault_kind::foreign, "another client tears a pair apart");
        write_back((way_um > 0) == (a_um < b_um) ? one : other,
                   chance(fault_kind::foreign).time_between(6 * period_ns, 20 * period_ns));
        return;
    }
    later(period_ns, [this, until, a_um, b_um] { tear_pair(until, a_um, b_um); });
}

// Without replies until then, and a moment longer. What the PLC applies stays there.
void fault_injector::write_back(const fakeplc::taken_channel &channel, time_ns pause) {
    const auto words = of_.plc.registers(channel.address, channel.format.registers);
    no_writes_until_ = no_read_backs_until_ = of_.time.now() + pause + 100 * ms;
    if (const auto at = channel.applied_address) {
        of_.plc.show(*at, words);
        later(pause + 300 * ms, [this, at] { of_.plc.show(*at, {}); });
    }
    later(pause, [this, at = channel.address, words] {
        if (!active_) return;
        of_.plc.catch_up();
        of_.plc.write_foreign(at, words);
    });
}

// A second writer of one channel, for seconds.
void fault_injector::write_again_and_again(dice &drawn) {
    const fakeplc::taken_channel &channel = drawn.one_of(of_.box_machine.map.channels);
    const double value_um = drawn.between(-300, 300);
    const time_ns until = of_.time.now() + static_cast<time_ns>(drawn.log_between(100e6, 10e9));
    const time_ns pause = drawn.time_between(5 * ms, 100 * ms);
    note(fault_kind::foreign,
         fmt::format("another client writes {} µm to {} each {} ms for {} ms", value_um,
                     channel.name, pause / ms, (until - of_.time.now()) / ms));
    write_each(pause, until, channel.address, channel.format.encode(value_um / channel.scale_um));
}

void fault_injector::write_each(time_ns pause, time_ns until, int at,
                                const std::vector<std::uint16_t> &words) {
    if (!active_ || of_.time.now() >= until) return;
    of_.plc.catch_up();
    of_.plc.write_foreign(at, words);
    later(pause, [this, pause, until, at, words] { write_each(pause, until, at, words); });
}

// out: a value beyond the channel's error_um, often by less than the channel has
double fault_injector::beyond_error(std::size_t c, dice &drawn) {
    const fakeplc::taken_channel &channel = of_.box_machine.map.channels[c];
    const double error_um = of_.box_machine.channels[c].error_um, part = drawn.log_between(0.1, 9);
    const auto words = of_.plc.registers(channel.address, channel.format.registers);
    const double held_um = std::fabs(channel.scale_um * channel.format.decode(words.data()));
    if (part < 1 && held_um > 0.05 * error_um) return error_um + held_um * (1 + part) / 2;
    return error_um * (1 + part);
}

// The PLC shows another value as applied than the box wrote: somewhere, beyond error_um, or none.
void fault_injector::lie_about_applied(dice &drawn) {
    const auto &channels = of_.box_machine.map.channels;
    std::vector<std::size_t> shown;
    for (std::size_t c = 0; c < channels.size(); ++c) {
        if (channels[c].applied_address) shown.push_back(c);
    }
    if (shown.empty()) return;
    const std::size_t c = drawn.one_of(shown);
    const fakeplc::taken_channel &channel = channels[c];
    const double far_um = beyond_error(c, drawn);
    const double value_um = drawn.one_in(2)   ? drawn.between(-300, 300)
                            : drawn.one_in(2) ? far_um
                                              : -far_um;
    const bool real = channel.format.what == fakeplc::number_format::kind::floating;
    const auto words = drawn.one_in(real ? 2 : 6)
                           ? odd_words(channel.format, drawn)
                           : channel.format.encode(value_um / channel.scale_um);
    const auto lasts = static_cast<time_ns>(drawn.log_between(20e6, 20e9));
    note(fault_kind::foreign,
         fmt::format("the PLC applies {} µm to {} for {} ms", value_um, channel.name, lasts / ms));
    show_applied(c, words, lasts);
    dice own(of_.options.seed + static_cast<std::uint64_t>(of_.time.now()), "second lie");
    if (shown.size() > 1 && own.one_in(3)) lie_about_another(own.one_of(shown), lasts, own);
}

// Meanwhile a second one is beyond its error_um.
void fault_injector::lie_about_another(std::size_t c, time_ns lasts, dice &drawn) {
    const fakeplc::taken_channel &channel = of_.box_machine.map.channels[c];
    const double far_um = beyond_error(c, drawn);
    later(drawn.time_between(0, lasts), [this, c, &channel, far_um, lasts] {
        if (!active_) return;
        note(fault_kind::foreign, fmt::format("it applies {} µm to {}", far_um, channel.name));
        show_applied(c, channel.format.encode(far_um / channel.scale_um), lasts);
    });
}

// Shows it all the time, or comes and goes: for three quarters of the time, or for about a reading,
// and then a value within error_um.
void fault_injector::show_applied(std::size_t c, const std::vector<std::uint16_t> &words,
                                  time_ns lasts) {
    const fakeplc::taken_channel &channel = of_.box_machine.map.channels[c];
    const int at = *channel.applied_address;
    const time_ns now = of_.time.now(), period = of_.box_machine.period_us * us;
    dice own(of_.options.seed + static_cast<std::uint64_t>(++lies_), "flicker");
    if (own.one_in(3)) {
        const time_ns quarter = period * 3 / 2;
        return show_in_turn(at, {{{words, 3 * quarter}, {{}, quarter}}}, now + lasts + 5 * second);
    }
    if (own.one_in(3)) {
        const double um = own.between(-0.9, 0.9) * of_.box_machine.channels[c].error_um;
        const auto bounded = channel.format.encode(um / channel.scale_um);
        return show_in_turn(at, {{{words, period}, {bounded, period}}}, now + lasts);
    }
    of_.plc.show(at, words);
    later(lasts, [this, at] { of_.plc.show(at, {}); });
}

void fault_injector::show_in_turn(int at, std::array<shown_words, 2> turns, time_ns until) {
    if (!active_ || of_.time.now() >= until) return of_.plc.show(at, {});
    of_.plc.show(at, turns[0].words);
    const time_ns lasts = turns[0].lasts;
    std::swap(turns[0], turns[1]);
    later(lasts, [this, at, turns, until] { show_in_turn(at, turns, until); });
}

// What the first contact finds: an operator who stops the service again, a value of another client,
// or a PLC that keeps its registers to itself.
void fault_injector::meddle_before_start() {
    dice own(of_.options.seed + of_.starts(), "before a start");
    const fakeplc::register_map &map = of_.box_machine.map;
    if (has(fault_kind::exception) && own.one_in(3)) {
        hides_block_until_ = of_.time.now() + static_cast<time_ns>(own.log_between(1e9, 60e9));
        note(fault_kind::exception, "the PLC refuses to return the write block");
    }
    if (has(fault_kind::restart) && own.one_in(4)) {
        note(fault_kind::restart, "SIGTERM soon after the start");
        const bool at_once = own.one_in(2);  // while it reads its files
        later(own.time_between(0, at_once ? ms : second), [this, start = of_.starts()] {
            if (active_ && of_.starts() == start + 1 && of_.box.runs()) of_.stop_daemon();
        });
    }
    dice soon(of_.options.seed + of_.starts(), "kill soon after a start");
    if (has(fault_kind::kill) && soon.one_in(3))
        later(static_cast<time_ns>(soon.log_between(0.1e9, 5e9)), [this, start = of_.starts()] {
            if (!active_ || of_.starts() != start + 1 || !of_.box.runs()) return;
            note(fault_kind::kill, "soon after the start");
            lethal_power_ = false;
            die();
        });
    if (has(fault_kind::mute) && own.one_in(3)) {
        no_read_backs_until_ = of_.time.now() + static_cast<time_ns>(own.log_between(100e6, 30e9));
        note(fault_kind::mute, "no read-back has a reply");
    }
    if (!has(fault_kind::foreign) || !own.one_in(2)) return;
    lie_about_applied(own);
    const fakeplc::taken_channel &channel = own.one_of(map.channels);
    if (own.one_in(2)) of_.plc.write_foreign(channel.address, odd_words(channel.format, own));
}

void fault_injector::plan_slowness() {
    repeat(fault_kind::stray, 20 * second, [this] {
        const auto lasts = static_cast<time_ns>(chance(fault_kind::stray).log_between(100e6, 20e9));
        gateway_until_ = of_.time.now() + lasts;
        note(fault_kind::stray, fmt::format("another device answers writes for {} ms", lasts / ms));
    });
    repeat(fault_kind::slow, 20 * second, [this] {
        dice &drawn = chance(fault_kind::slow);
        const auto lasts = static_cast<time_ns>(drawn.log_between(100e6, 20e9));
        slow_until_ = of_.time.now() + lasts;
        slow_ns_ = static_cast<time_ns>(drawn.between(0.3, 0.8) *
                                        static_cast<double>(of_.box_machine.period_us * us));
        note(fault_kind::slow,
             fmt::format("the PLC takes {} µs a request for {} ms", slow_ns_ / us, lasts / ms));
    });
}

// ---- sensors

void fault_injector::plan_sensors() {
    repeat(fault_kind::sensors, 4 * second, [this] {
        if (of_.box_machine.map.signals.empty()) return;
        lie_about(chance(fault_kind::sensors).one_of(of_.box_machine.map.signals));
    });
    plan_long_silence();
    repeat(fault_kind::sensors, 4 * second, [this] {
        dice own(of_.options.seed + static_cast<std::uint64_t>(of_.time.now()), "too early");
        if (own.one_in(6)) enable_too_early(own);
        lose_position();
    });
    for (const fakeplc::shown_signal &signal : of_.box_machine.map.signals)
        if (!signal.velocity_of.empty())
            repeat(fault_kind::sensors, 4 * second, [this, &signal] { lose_velocity(signal); });
    if (!of_.box_machine.redundant.empty())
        repeat(fault_kind::sensors, 12 * second, [this] { disturb_redundant(); });
    if (!of_.box_machine.map.handshake) return;
    repeat(fault_kind::sensors, 15 * second, [this] {
        const auto lasts =
            static_cast<time_ns>(chance(fault_kind::sensors).log_between(100e6, 10e9));
        note(fault_kind::sensors, fmt::format("the NC is in alarm for {} ms", lasts / ms));
        of_.plc.nc_alarm = true;
        later(lasts, [this] { of_.plc.nc_alarm = false; });
        dice own(of_.options.seed + static_cast<std::uint64_t>(of_.time.now()), "alarm");
        if (!has(fault_kind::reload) || !own.one_in(2)) return;
        later(own.time_between(0, lasts), [this] {  // perhaps one that knows no alarm
            if (active_) put_another_file();
        });
    });
}

// Sensors that check each other are off, at once or more and more, and then less or right again.
void fault_injector::disturb_redundant() {
    constexpr int steps = 8;
    dice &drawn = chance(fault_kind::sensors);
    const auto lasts = static_cast<time_ns>(drawn.log_between(300e6, 20e9));
    lie_together(dice(of_.options.seed + static_cast<std::uint64_t>(lasts), "two sensors"));
    for (int more = drawn.one_in(4) ? 2 : 1; more > 0; --more) {
        const auto &sensor = drawn.one_of(of_.box_machine.redundant);
        const double size = sensor.contradicts * drawn.log_between(0.3, 10);
        const double off = drawn.one_in(2) ? -size : size;
        const bool drifts = drawn.one_in(3), stays = drawn.one_in(3);
        note(fault_kind::sensors, fmt::format("{} {} off by {:.3g} K for {} ms", sensor.name,
                                              drifts ? "drifts" : "is", off, lasts / ms));
        for (int step = drifts ? 1 : steps; step <= steps; ++step)
            be_off(sensor.name, off * step / steps, drifts ? lasts * (step - 1) / steps : 0);
        be_off(sensor.name, stays ? std::copysign(0.75 * sensor.contradicts, off) : 0, lasts);
    }
}

// Two of as many as the box may doubt are far off for the same time: it finds one after the other.
// The worse one is behind the other in the file, so that the detail names both in turn.
void fault_injector::lie_together(dice own) {
    const auto &all = of_.box_machine.redundant;
    if (all.size() < 6 || !own.one_in(2)) return;
    const std::size_t worse = 1 + own.below(all.size() - 1), other = own.below(worse);
    const time_ns lasts = own.time_between(5 * second, 15 * second);
    note(fault_kind::sensors, fmt::format("{} and {} are far off for {} ms", all[worse].name,
                                          all[other].name, lasts / ms));
    for (const std::size_t j : {worse, other}) {
        const double size = all[j].contradicts * own.log_between(3, 4) * (j == worse ? 3 : 1);
        be_off(all[j].name, own.one_in(2) ? -size : size, 0);
        be_off(all[j].name, 0, lasts);
    }
}

void fault_injector::be_off(const std::string &sensor, double off, time_ns pause) {
    later(pause, [this, sensor, off] {
        if (!active_) return;
        of_.plc.catch_up();
        of_.plc.sensor_off[sensor] = off;
        of_.plc.show_redundant();
    });
}

// The operator switches enable off and on while an essential signal has no valid value, and permits
// no resume: no permission for the time behind it.
void fault_injector::enable_too_early(dice own) {
    constexpr time_ns longest_age = 10 * second;
    std::vector<const fakeplc::shown_signal *> essential;
    for (const fakeplc::shown_signal &signal : of_.box_machine.map.signals) {
        const signal_facts *facts = of_.running().signal(signal.name);
        if (facts != nullptr && facts->essential && facts->max_age_us * us < longest_age)
            essential.push_back(&signal);
    }
    if (essential.empty()) return;
    const fakeplc::shown_signal &lost = *own.one_of(essential);
    const time_ns off_ns = of_.running().signal(lost.name)->max_age_us * us + second,
                  on_ns = off_ns + own.time_between(300 * ms, 2 * second),
                  back_ns = on_ns + own.time_between(second, 4 * second);
    note(fault_kind::sensors, lost.name + " has no value, and enable goes off and on meanwhile");
    of_.plc.control.set_permit(false);
    lie_on(lost, out_of_range, lost.max.value_or(1e4) + 10, of_.time.now() + back_ns);
    later(back_ns + 3 * second, [this] { of_.plc.control.set_permit(of_.plc.permits_resume); });
    for (const bool on : {false, true}) {
        later(on ? on_ns : off_ns, [this, on] {
            if (!active_) return;
            of_.plc.catch_up();
            of_.plc.control.set_enable(on);
        });
    }
}

// A position has no valid value while its axis moves, for less than its maximum age.
void fault_injector::lose_position() {
    std::vector<const fakeplc::shown_signal *> lasting;
    const time_ns period_ns = of_.box_machine.period_us * us;
    for (const fakeplc::shown_signal &signal : of_.box_machine.map.signals) {
        const signal_facts *facts = of_.running().signal(signal.name);
        if (signal.name.size() == 1 && facts != nullptr && facts->max_age_us * us > 6 * period_ns)
            lasting.push_back(&signal);
    }
    of_.plc.catch_up();
    if (lasting.empty() || !of_.plc.control.moving()) return;
    dice &drawn = chance(fault_kind::sensors);
    const fakeplc::shown_signal &lost = *drawn.one_of(lasting);
    const time_ns most_ns = of_.running().signal(lost.name)->max_age_us * us - 2 * period_ns;
    const time_ns lasts = drawn.time_between(4 * period_ns, most_ns);
    note(fault_kind::sensors, fmt::format("{} has no value for {} ms", lost.name, lasts / ms));
    lie_on(lost, out_of_range, lost.max.value_or(1e4) + 10, of_.time.now() + lasts);
}

// A velocity has no valid value while axes move, about as long as it is used.
void fault_injector::lose_velocity(const fakeplc::shown_signal &signal) {
    const signal_facts *facts = of_.running().signal(signal.name);
    of_.plc.catch_up();
    if (facts == nullptr || !of_.plc.control.moving()) return;
    dice &drawn = chance(fault_kind::sensors);
    const auto lasts = static_cast<time_ns>(static_cast<double>(facts->max_age_us * us) *
                                            drawn.log_between(0.5, 5));
    note(fault_kind::sensors, fmt::format("{} has no value for {} ms", signal.name, lasts / ms));
    lie_on(signal, out_of_range, signal.max.value_or(1e6) + 10, of_.time.now() + lasts);
}

// Beyond 31 bits of µs, where the run is that long: a signal whose rate is limited is broken, and
// comes back.
void fault_injector::plan_long_silence() {
    constexpr time_ns silence = 2200 * second;
    const auto cycles = static_cast<time_ns>(of_.options.cycles);
    const std::vector<std::string> &rated = of_.box_machine.rated;
    if (!has(fault_kind::sensors) || rated.empty() ||
        cycles * of_.box_machine.period_us * us < silence + 60 * second)
        return;
    silent_ = rated.front();
    for (const fakeplc::shown_signal &signal : of_.box_machine.map.signals) {
        if (signal.name != silent_) continue;
        later(10 * second, [this, &signal] {
            note(fault_kind::sensors, signal.name + " is silent for 2200 s");
            lie_on(signal, out_of_range, signal.max.value_or(1e4) + 10, of_.time.now() + silence);
        });
    }
}

void fault_injector::lie_about(const fakeplc::shown_signal &signal) {
    if (signal.name == silent_) return;
    dice &drawn = chance(fault_kind::sensors);
    const auto &redundant = of_.box_machine.redundant;
    const bool checked =
        std::any_of(redundant.begin(), redundant.end(),
                    [&signal](const auto &one) { return one.name == signal.name; });
    if (checked && !drawn.one_in(8)) return;  // disturb_redundant() does more
    const auto way = static_cast<lie_way>(drawn.below(lie_ways));
    const auto lasts = static_cast<time_ns>(drawn.log_between(10e6, 20e9));
    const auto now =
        signal.format.decode(of_.plc.registers(signal.address, signal.format.registers).data()) *
            signal.scale +
        signal.zero;
    const double low = signal.min.value_or(-1e4), high = signal.max.value_or(1e4);
    note(fault_kind::sensors, fmt::format("{} lies in way {} for {} ms", signal.name,
                                          static_cast<int>(way), lasts / ms));
    if (way == not_a_number) {
        of_.plc.show(signal.address, odd_words(signal.format, drawn));
        later(lasts, [this, at = signal.address] { of_.plc.show(at, {}); });
        return;
    }
    double value = now;
    if (way == jump) value = drawn.between(low, high);
    if (way == out_of_range)
        value = drawn.one_in(2) ? low - drawn.log_between(1e-3, 1e3)
                                : high + drawn.log_between(1e-3, 1e3);
    if (way == at_bound)
        value = (drawn.one_in(2) ? low : high) +
                static_cast<double>(drawn.time_between(-1, 1)) * signal.scale;
    lie_on(signal, way, value, of_.time.now() + lasts);
}

void fault_injector::lie_on(const fakeplc::shown_signal &signal, int way, double value,
                            time_ns until) {
    if (!active_ || of_.time.now() >= until) {
        of_.plc.show(signal.address, {});
        return;
    }
    dice &drawn = chance(fault_kind::sensors);
    const double range = signal.max.value_or(1e4) - signal.min.value_or(-1e4);
    const double shown = way == noise ? value + drawn.between(-0.02, 0.02) * range : value;
    of_.plc.show(signal.address, signal.format.encode((shown - signal.zero) / signal.scale));
    const double next = way == drift ? value + 1e-4 * range : value;
    later(lie_period, [this, &signal, way, next, until] { lie_on(signal, way, next, until); });
}

// The operator puts all right: PLC, cable, permissions; enable goes off until a file that waits for
// it is taken, and on again; reset where the box shows FAULT.
void fault_injector::heal_plc() {
    plc_side &plc = of_.plc;
    refuses_until_ = resets_until_ = gateway_until_ = no_writes_until_ = no_read_backs_until_ = 0;
    of_.net.plugged = true;
    for (serial_line *line : {of_.plc_line.get(), of_.bus_line.get()}) {
        if (line == nullptr) continue;
        line->taken_until_ns = std::min(line->taken_until_ns, of_.time.now());
        if (!line->is_plugged()) line->plug(true);
    }
    plc.serves = true;
    plc.stop_program(false);
    plc.put_right();
    later(of_.rest_ns(), [&plc] {
        plc.catch_up();
        plc.control.set_referenced(true);
        plc.control.set_enable(true);
    });
    for (time_ns at = 0; at < 60 * second; at += 2 * second) {
        later(at, [&plc] {
            plc.catch_up();
            if (plc.control.duties().mode() == fakeplc::box_mode::fault ||
                !plc.control.side().alarm().empty())
                plc.control.press_reset();
        });
    }
}

}  // namespace compbox::world
