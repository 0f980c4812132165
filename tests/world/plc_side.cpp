// SPDX-License-Identifier: MIT
#include "tests/world/plc_side.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace compbox::world {

namespace {

constexpr time_ns operator_period = 500 * ms;
constexpr unsigned alarm_bit = 1u << 15;       // of the handshake register
constexpr time_ns longest_idle = 20 * second;  // of a connection, when another one needs its place

// A PLC may follow by this time (docs/faults.md, reason 13), less what reading and writing take.
time_ns lateness(const machine &of, std::uint64_t seed) {
    dice chance(seed, "applies late");
    if (of.profile.name == "fanuc" || !chance.one_in(4)) return 0;
    return chance.time_between(100 * ms, second - 4 * of.period_us * us - 30 * ms);
}

}  // namespace

plc_side::plc_side(const machine &of, network &net, std::uint64_t seed)
    : control(of.twin, of.map, of.profile, net.box.time.now() / us),
      permits_resume(!dice(seed, "permit resume").one_in(3)),
      applies_late_ns(lateness(of, seed)),
      machine_(of),
      net_(net),
      chance_(seed, "plc side"),
      acknowledges_(dice(seed, "acknowledges").one_in(2)),
      tries_enable_(dice(seed, "tries enable").one_in(2)),
      jams_(dice(seed, "jams").one_in(3)),
      temperatures_(of.twin.signals),
      warmth_(seed, "warmth"),
      prober_(seed, "prober"),
      scatter_(seed, "scatter"),
      late_copies_(seed, "late copies"),
      passing_(seed, "passes 65535"),
      tarrying_(seed, "tarrying"),
      tarries_(tarrying_.one_in(4)) {
    control.leave_truth_out();
    control.set_permit(permits_resume);
    dice beat(seed, "beat");  // which passes 65535 soon
    if (beat.one_in(3)) heartbeat_offset = static_cast<std::uint16_t>(65535 - beat.below(4000));
    dice count(seed, "count of probes");
    if (count.one_in(2)) probes_ = static_cast<std::uint16_t>(65535 - count.below(20));
    if (!machine_.map.probes.empty()) count_others();
    move_axes();
}

// A probe that measures, lies, repeats itself or counts without measuring, each for some seconds.
void plc_side::probe() {
    enum {
        measures,
        no_number,
        at_limits,
        runs,
        replays,
        alternates,
        elsewhere,
        far_off,
        silent,
        ways
    };
    if (machine_.map.probes.empty()) return;
    if (prober_.one_in(20)) {
        probing_ = prober_.below(ways);
        place_um_ = prober_.between(-60, 60);
    }
    if (probing_ == silent || !prober_.one_in(2)) return;
    const bool high = prober_.one_in(2);
    if (probing_ == measures) probed_um_ = prober_.between(-20, 20);
    if (probing_ == elsewhere) probed_um_ = place_um_ + prober_.between(-10, 10);
    if (probing_ == no_number) probed_um_ = std::nan("");
    if (probing_ == at_limits) probed_um_ = high ? 500 : -500;
    if (probing_ == alternates)
        probed_um_ = (probed_um_ > 0 ? -1 : 1) * std::abs(place_um_) + scatter_.between(-3, 3);
    if (probing_ == far_off) probed_um_ = high ? 1e7 : -1e7;
    if (probing_ == replays && std::isnan(probed_um_)) probed_um_ = 0;
    probes_ = static_cast<std::uint16_t>(
        probes_ + (probing_ == runs ? prober_.below(65536) : std::uint64_t{1}));
    for (const auto &probe : machine_.map.probes) {
        control.force_signal(probe.value, probed_um_);
        control.force_signal(probe.count, probes_);
    }
    count_others();
}

void plc_side::count_others() {
    control.force_signal(other_probe_count, static_cast<std::uint16_t>(probes_ + 5000));
}

void plc_side::catch_up() {
    const std::int64_t now_us = net_.box.time.now() / us;
    if (stopped_) return;
    control.run_to(now_us, [this](const fakeplc::plc_state &state) {
        if (scanned) scanned(state);
        remember_applied(state);
    });
}

void plc_side::remember_applied(const fakeplc::plc_state &state) {
    if (applies_late_ns == 0) return;
    const double then_s = state.time_s - 1e-9 * static_cast<double>(applies_late_ns);
    applied_.push_back({state.time_s, state.applied_um});
    while (applied_.size() > 1 && applied_[1].time_s <= then_s) applied_.pop_front();
}

// After some seconds of reason 7, enable goes off for one look.
void plc_side::permit_by_enable() {
    constexpr unsigned reason_wait = 7;
    constexpr int patience = 8;
    if (permits_resume || stopped_ || put_right_) return;
    const unsigned reason = registers(machine_.map.status, 1)[0] >> 8;
    if (waits_ == patience) control.set_enable(true);
    waits_ = reason == reason_wait && waits_ < patience ? waits_ + 1 : 0;
    if (waits_ == patience) control.set_enable(false);
}

void plc_side::hold_reset(time_ns until) {
    constexpr time_ns again = 250 * ms;  // sooner than fakeplc lets go
    const time_ns now = net_.box.time.now();
    catch_up();
    control.press_reset();
    jammed_ns_ = std::max(jammed_ns_, until);
    if (now < until && !put_right_)
        net_.box.time.at(now + again, [this, until] { hold_reset(until); });
}

// Some operators press reset after some seconds of FAULT, whatever its cause, and some of them have
// switched enable off and on before. A key that jams may still be down at the next FAULT.
void plc_side::acknowledge_fault() {
    constexpr int patience = 6;
    const time_ns now = net_.box.time.now();
    if (!acknowledges_ || stopped_ || now < jammed_ns_) return;
    const unsigned mode = registers(machine_.map.status, 1)[0] & 0xFFu;
    fault_looks_ = mode == fakeplc::box_mode::fault ? fault_looks_ + 1 : 0;
    if (is_off_ && !put_right_) control.set_enable(true);
    const bool is_on = (registers(machine_.map.control, 1)[0] & 1u) != 0;
    is_off_ = tries_enable_ && !put_right_ && is_on && fault_looks_ % patience == 1;
    if (is_off_) control.set_enable(false);
    if (fault_looks_ % patience == patience - 1)
        hold_reset(jams_ ? now + chance_.time_between(5, 60) * second : now);
}

// The operator's part: now and then another move, and temperatures that wander. It also keeps the
// PLC's program in time while no request comes.
void plc_side::move_axes() {
    catch_up();
    if (!control.moving() && chance_.one_in(4)) {
        twin::twin_step step;
        for (std::size_t a = 0; a < 3; ++a) {
            if (chance_.one_in(2)) continue;
            step.target_mm[a] = chance_.between(0, machine_.twin.axes[a].max_mm);
        }
        step.feed_mm_per_s = chance_.log_between(5, 500);
        control.move(step);
    }
    const double coldest = machine_.is_cold ? -8 : 5;
    for (auto &temperature : temperatures_) {
        const bool rated = std::find(machine_.rated.begin(), machine_.rated.end(),
                                     temperature.first) != machine_.rated.end();
        const double most = rated ? machine::calm_k : machine_.wanders_k;  // within its rate
        temperature.second =
            std::clamp(temperature.second + chance_.between(-most, most), coldest, 45.0);
        control.force_signal(temperature.first, temperature.second);
    }
    if (warmth_.one_in(20)) warms_by_ = warmth_.one_in(2) ? 0 : warmth_.between(-0.1, 0.1);
    warm_ = std::clamp(warm_ + warms_by_, -8.0, 15.0);
    show_redundant();
    probe();
    permit_by_enable();
    acknowledge_fault();
    net_.box.time.at(net_.box.time.now() + operator_period, [this] { move_axes(); });
}

void plc_side::show_redundant() {
    for (const auto &sensor : machine_.redundant)
        control.force_signal(sensor.name, sensor.center + warm_ + sensor_off[sensor.name] +
                                              warmth_.between(-0.03, 0.03));
}

bool plc_side::accepted(const connection_ptr &from) {
    const int most = machine_.profile.max_clients - foreign_clients;
    if (static_cast<int>(clients_.size()) >= most) drop_idle_clients(longest_idle);
    if (static_cast<int>(clients_.size()) >= most) return false;
    from->number = ++connections_made_;
    clients_[from->number] = {from, {}, net_.box.time.now()};
    return true;
}

// As keep-alives do: a box without power never closes its connections.
void plc_side::drop_idle_clients(time_ns longest) {
    const auto all = clients_;
    for (const auto &entry : all) {
        if (net_.box.time.now() - entry.second.heard_ns > longest) entry.second.link->reset();
    }
}

void plc_side::stop_program(bool stopped) {
    if (stopped_ && !stopped) control.forget_standstill(net_.box.time.now() / us);
    stopped_ = stopped;
}

void plc_side::restart(bool keeps_registers, time_ns pause) {
    catch_up();
    stop_program(true);
    serves = false;
    net_.box.time.at(net_.box.time.now() + pause, [this, keeps_registers] {
        const auto &block = machine_.map.write;
        const auto kept = registers(block.start, block.count);
        if (!stopped_) return;  // put right meanwhile
        stop_program(false);
        control.restart();
        applied_.clear();
        if (keeps_registers) write_foreign(block.start, kept);
        serves = true;
        close_all();
    });
}

void plc_side::show(int address, const std::vector<std::uint16_t> &words) {
    if (words.empty())
        shown_.erase(address);
    else
        shown_[address] = words;
}

void plc_side::put_right() {
    put_right_ = true;
    drop_idle_clients(2 * second);  // a connection that stalled holds its place
    shown_.clear();
    unreferenced = 0;
    nc_alarm = false;
    sensor_off.clear();
    foreign_clients = 0;
    control.freeze_nc(false);
    catch_up();
    control.set_referenced(true);
    control.set_permit(true);
    control.set_enable(false);
}

// Sensors that lie, axes without their reference, and counters from another start: only readings
// have them.
void plc_side::disguise(const fakeplc::byte_string &request, fakeplc::byte_string &reply) const {
    if ((request[0] != 3 && request[0] != 23) || (reply[0] & 0x80) != 0) return;
    if (shown_.empty() && applied_.empty() && heartbeat_offset == 0 && unreferenced == 0 &&
        !nc_alarm)
        return;
    const int start = fakeplc::modbus::word(request, 1),
              count = (static_cast<int>(reply.size()) - 2) / 2;
    const auto change = [&](int address, auto word_of) {
        if (address < start || address >= start + count) return;
        const auto at = static_cast<std::size_t>(2 + 2 * (address - start));
        const unsigned word = word_of(fakeplc::modbus::word(reply, at));
        reply[at] = static_cast<std::uint8_t>(word >> 8);
        reply[at + 1] = static_cast<std::uint8_t>(word);
    };
    const auto show = [&](int address, const std::vector<std::uint16_t> &words) {
        for (std::size_t i = 0; i < words.size(); ++i)
            change(address + static_cast<int>(i), [&](unsigned) { return words[i]; });
    };
    for (std::size_t c = 0; !applied_.empty() && c < machine_.map.channels.size(); ++c) {
        const fakeplc::taken_channel &channel = machine_.map.channels[c];
        if (channel.applied_address)
            show(*channel.applied_address,
                 channel.format.encode(applied_.front().um[c] / channel.scale_um));
    }
    for (const auto &entry : shown_) show(entry.first, entry.second);
    change(machine_.map.control, [this](unsigned word) { return word & ~unsigned{unreferenced}; });
    if (nc_alarm && machine_.map.handshake)
        change(*machine_.map.handshake, [](unsigned word) { return word | alarm_bit; });
    change(machine_.map.plc_heartbeat, [this](unsigned word) { return word + heartbeat_offset; });
}

// One PLC in four closes its own side when it comes to it, or never.
void plc_side::closed(const connection_ptr &from, bool reset) {
    clients_.erase(from->number);
    if (reset) return;
    if (!tarries_) return from->finish();
    if (tarrying_.one_in(3)) return;
    const auto pause = static_cast<time_ns>(tarrying_.log_between(1e6, 10e9));
    net_.box.time.at(net_.box.time.now() + pause, [from] { from->finish(); });
}

void plc_side::close_all() {
    const auto all = clients_;
    for (const auto &entry : all) entry.second.link->reset();
}

void plc_side::received(const connection_ptr &from, const std::string &bytes, time_ns sent) {
    client &who = clients_[from->number];
    who.link = from;
    who.heard_ns = sent;
    who.received.insert(who.received.end(), bytes.begin(), bytes.end());
    for (;;) {
        const auto head = fakeplc::modbus::frame_at_start(who.received);
        if (head.what == fakeplc::modbus::frame_state::incomplete) return;
        if (head.what == fakeplc::modbus::frame_state::broken) {
            from->reset();
            return;
        }
        const auto end = who.received.begin() + static_cast<std::ptrdiff_t>(head.size);
        const fakeplc::byte_string frame(who.received.begin(), end);
        who.received.erase(who.received.begin(), end);
        if (asked) asked(!who.asked, who.settled_ns <= sent);
        who.asked = true;
        who.settled_ns = answer_frame(from, frame, sent);
    }
}

// The heartbeat of one PLC in three may pass 65535 while nobody reads it.
void plc_side::pass_65535() {
    const time_ns unread_ns = net_.box.time.now() - served_ns_;
    if (heartbeat_offset == 0 || unread_ns < machine_.heartbeat_timeout_us * us) return;
    constexpr unsigned most = 20000;  // beyond 32767 it would be one that has gone back
    const auto shown = static_cast<std::uint16_t>(control.state().plc_heartbeat + heartbeat_offset);
    const unsigned left = 65536U - shown;
    if (left < most && passing_.one_in(2))
        heartbeat_offset = static_cast<std::uint16_t>(heartbeat_offset + left + passing_.below(9));
}

plc_side::served plc_side::serve(const fakeplc::byte_string &request, time_ns sent) {
    const reply_fate fate = faults == nullptr ? reply_fate{} : faults->at_request(request);
    if (serves && fate.ignored && fate.stray != stray_reply::none)
        return {{request.begin(), request.begin() + 5}, ms, false, fate.stray, true, false};
    if (!serves || fate.ignored) return {};
    catch_up();
    pass_65535();
    if (!fate.lost && !fate.resets) served_ns_ = net_.box.time.now();
    fakeplc::byte_string reply = fate.exception != 0
                                     ? fakeplc::modbus::exception_reply(
                                           request[0], static_cast<std::uint8_t>(fate.exception))
                                     : control.answer(request, fate.torn);
    disguise(request, reply);
    const time_ns duration =
        fate.lost || fate.resets ? never : chance_.time_between(200 * us, 2 * ms) + fate.delay_ns;
    if (answered) answered(sent, request, reply, duration);
    if (fate.resets) return {{}, never, false, stray_reply::none, false, true};
    if (fate.lost && fate.stray == stray_reply::none) return {};
    if (fate.lost) return {reply, ms, false, fate.stray, true, false};
    return {reply, duration, fate.twice, fate.stray, false, false};
}

fakeplc::byte_string plc_side::stray_pdu(fakeplc::byte_string reply, stray_reply way) {
    if (way == stray_reply::other_registers || way == stray_reply::fewer_registers) {
        const std::size_t at = way == stray_reply::other_registers ? 2 : 4;  // start, count
        if (reply.size() > at) reply[at] ^= 1;
        return reply;
    }
    for (std::size_t i = 2; i < reply.size(); ++i) reply[i] = static_cast<std::uint8_t>(~reply[i]);
    if (way == stray_reply::other_function) reply[0] = reply[0] == 4 ? 3 : 4;
    if (way == stray_reply::shorter) {
        reply.resize(reply.size() - std::min<std::size_t>(reply.size() - 1, 2));
        if (reply.size() > 2) reply[1] = static_cast<std::uint8_t>(reply.size() - 2);
    }
    if (way == stray_reply::longer) reply.insert(reply.end(), {0, 0});
    if (way == stray_reply::miscounted && reply.size() > 2) reply[1] ^= 2;
    return reply;
}

std::string plc_side::stray_frame(fakeplc::byte_string request_frame,
                                  const fakeplc::byte_string &reply, stray_reply way) {
    constexpr std::size_t unit_at = 6;
    if (way == stray_reply::other_unit) ++request_frame[unit_at];
    const fakeplc::byte_string whole = fakeplc::modbus::frame(request_frame, stray_pdu(reply, way));
    return {whole.begin(), whole.end()};
}

time_ns plc_side::answer_frame(const connection_ptr &from, const fakeplc::byte_string &frame,
                               time_ns sent) {
    const fakeplc::byte_string request(frame.begin() + fakeplc::modbus::header_size, frame.end());
    const served done = serve(request, sent);
    const time_ns now = net_.box.time.now();
    if (done.resets) {
        from->reset();
        return never;
    }
    if (done.reply.empty()) return never;
    const fakeplc::byte_string whole = fakeplc::modbus::frame(frame, done.reply);
    const std::string bytes(whole.begin(), whole.end());
    // What is sent may end the connection, and with it the client.
    const std::string copy = std::exchange(clients_[from->number].copies[request[0]], "");
    if (!copy.empty()) from->send(copy, done.duration / 3);
    if (done.stray != stray_reply::none)
        from->send(stray_frame(frame, done.reply, done.stray), done.duration / 2);
    const time_ns settled_ns =
        now + (done.stray != stray_reply::none ? done.duration / 2 : done.duration);
    if (done.alone) return settled_ns;
    from->send(bytes, done.duration);
    if (!done.twice) return settled_ns;
    // Sent then: on its way from now on it would hold back the replies behind it.
    const time_ns period_ns = machine_.period_us * us;
    const auto who = clients_.find(from->number);
    if (late_copies_.one_in(2) && who != clients_.end()) {
        who->second.copies[request[0]] = bytes;
        return settled_ns;
    }
    const time_ns pause = done.duration + chance_.time_between(0, 2 * period_ns);
    net_.box.time.at(now + pause, [from, bytes] { from->send(bytes); });
    return settled_ns;
}

std::vector<std::uint16_t> plc_side::registers(int start, int count) {
    const auto high = [](int word) { return static_cast<std::uint8_t>(word >> 8); };
    const auto low = [](int word) { return static_cast<std::uint8_t>(word); };
    const fakeplc::byte_string reply =
        control.answer({3, high(start), low(start), high(count), low(count)});
    std::vector<std::uint16_t> words;
    for (std::size_t i = 2; i + 1 < reply.size(); i += 2)
        words.push_back(fakeplc::modbus::word(reply, i));
    return words;
}

void plc_side::write_foreign(int start, const std::vector<std::uint16_t> &values) {
    foreign_write_ns = net_.box.time.now();
    fakeplc::byte_string request = {
        16, static_cast<std::uint8_t>(start >> 8),    static_cast<std::uint8_t>(start),
        0,  static_cast<std::uint8_t>(values.size()), static_cast<std::uint8_t>(2 * values.size())};
    for (const std::uint16_t word : values) {
        request.push_back(static_cast<std::uint8_t>(word >> 8));
        request.push_back(static_cast<std::uint8_t>(word));
    }
    control.answer(request);
}

}  // namespace compbox::world
