// SPDX-License-Identifier: MIT
#include "host-tools/commission/live.h"

#include <sched.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstring>

#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/box/box.h"
#include "firmware/config/rtu_budget.h"
#include "firmware/wire/modbus.h"
#include "hal/cycle.h"
#include "hal/linux/box_hal.h"
#include "hal/linux/clock.h"
#include "hal/linux/peer.h"
}

namespace compbox::commission {

namespace {

volatile std::sig_atomic_t interrupted = 0;

static_assert(static_cast<int>(CB_TCP_EXCEPTIONS) == static_cast<int>(CB_RTU_EXCEPTIONS));
constexpr std::int64_t before_tick_us = 6000;  // no reading between cycles begins later than this

}  // namespace

void prepare_process() {
    struct sigaction action = {};
    action.sa_handler = [](int) { interrupted = 1; };
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
    ::signal(SIGPIPE, SIG_IGN);
    const sched_param before_others = {20};
    ::sched_setscheduler(0, SCHED_FIFO, &before_others);  // EPERM: as a normal process
}

struct live_box::inside {
    live_box *owner = nullptr;
    cb_box box;
    cb_cycle cycle;
    cb_linux target;
    cb_hal linux_hal, hal;
    std::vector<double> offsets_um;
    std::vector<std::size_t> offset_signal;
    bool stopped = false, confirmed = false, moved = false;
    std::int64_t active_us = 0, answered_us = 0;
    read_back found = read_back::unanswered;
    std::array<std::uint32_t, CB_TCP_EXCEPTIONS> read_back_exceptions{};  // by their code

    static inside &of(void *context) { return *static_cast<inside *>(context); }
    std::int64_t now_us() const { return linux_hal.now_us(linux_hal.context); }

    // Passes a complete reading to on_reading.
    void report(cb_transfer result, std::int64_t requested_us, const std::uint16_t *registers) {
        if (result != CB_TRANSFER_OK || !owner->on_reading) return;
        const std::uint16_t count = box.config.plc.read.count;
        owner->on_reading({requested_us, now_us(), {registers, registers + count}});
    }

    bool on_serial_line() const { return target.transport == CB_TRANSPORT_RTU; }
    const std::uint32_t *exceptions_by_code() const {
        return on_serial_line() ? target.rtu.counters.exceptions_by_code
                                : target.tcp.counters.exceptions_by_code;
    }

    // Result of the read-back; counts its exceptions apart from those of the cycle.
    void note_read_back(cb_transfer result, const std::uint32_t *before) {
        const std::uint32_t *now = exceptions_by_code();
        for (std::size_t code = 0; code < read_back_exceptions.size(); ++code)
            read_back_exceptions[code] += now[code] - before[code];
        if (result == CB_TRANSFER_OK) found = read_back::answered;
        if (result == CB_TRANSFER_REFUSED) found = read_back::refused;
    }

    // Reads as often as possible before the next tick.
    void read_until_tick() {
        const cb_tick &tick = target.tick;
        const std::int64_t next_us =
            (tick.start_ns + (tick.index + 1) * tick.period_ns - cb_clock_ns(CLOCK_MONOTONIC)) /
                1000 +
            now_us();
        while (next_us - now_us() > before_tick_us) {
            const cb_block_config &block = box.config.plc.read;
            std::uint16_t registers[CB_MAX_READ_REGISTERS];
            read(this, block.start, block.count, registers, next_us - before_tick_us / 2);
            const struct timespec pause = {0, 500000};
            ::nanosleep(&pause, nullptr);
        }
    }

    template <typename transfer>
    cb_transfer written(transfer send) {
        box_write write;
        for (unsigned c = 0; c < box.config.channels_count; ++c) {
            write.output_um.push_back(cycle.out.channel_um[c]);
            moved = moved || cycle.out.channel_um[c] != 0.0f;
        }
        write.sent_us = now_us();
        const cb_transfer result = send();
        write.done_us = now_us();
        write.confirmed = result == CB_TRANSFER_OK;
        if (owner->on_write) owner->on_write(write);
        return result;
    }

    // This thread opens a serial device itself: before the first cycle nothing moves that could
    // wait for it. Throws input_error where the PLC's host is no address.
    void start_wire() {
        const cb_plc_config &plc = box.config.plc;
        std::memset(&target, 0, sizeof target);
        target.transport = plc.transport;
        if (on_serial_line()) {
            const cb_rtu_manners manners = cb_rtu_manners_of(&plc);
            return cb_rtu_start(&target.rtu, &plc.serial, &manners, nullptr);
        }
        if (!cb_tcp_start(&target.tcp, plc.host, plc.port, plc.unit)) {
            throw input_error(fmt::format("plc.transport.tcp.host: {} is no address", plc.host));
        }
    }

    // Starts box, cycle and wire from the beginning; connects to nothing yet.
    void start(live_box *of_whom, const box_setup &setup) {
        owner = of_whom;
        std::memset(&box, 0, sizeof box);
        box.config = *setup.config;
        offsets_um.assign(setup.config->channels_count, 0.0);
        offset_signal = setup.offset_signal;
        start_wire();
        linux_hal = cb_linux_hal(&target);
        hal = {this,    now,     wait_tick, read,        write,  write_read,
               nullptr, samples, feed,      is_stopping, nullptr};
        cb_box_start(&box);
        cb_cycle_start(&cycle);
        cb_tick_start(&target.tick, CLOCK_MONOTONIC, box.config.period_us);
        active_us = answered_us = now_us();
    }

    // ---- hal.h, passed on; samples are the offsets

    static std::int64_t now(void *context) { return of(context).now_us(); }
    static std::uint32_t wait_tick(void *context) {
        inside &self = of(context);
        if (self.owner->reading_between_ && self.cycle.out.write) self.read_until_tick();
        return self.linux_hal.wait_tick(self.linux_hal.context);
    }
    static cb_transfer read(void *context, std::uint16_t start, std::uint16_t count,
                            std::uint16_t *registers, std::int64_t deadline_us) {
        inside &self = of(context);
        const std::int64_t requested_us = self.now_us();
        std::array<std::uint32_t, CB_TCP_EXCEPTIONS> before{};
        std::copy_n(self.exceptions_by_code(), before.size(), before.begin());
        const cb_transfer result =
            self.linux_hal.read(self.linux_hal.context, start, count, registers, deadline_us);
        const bool cyclic = start == self.box.config.plc.read.start;
        if (cyclic) self.report(result, requested_us, registers);
        if (!cyclic) self.note_read_back(result, before.data());
        return result;
    }
    static cb_transfer write(void *context, std::uint16_t start, std::uint16_t count,
                             const std::uint16_t *registers, std::int64_t deadline_us) {
        inside &self = of(context);
        return self.written([&] {
            return self.linux_hal.write(self.linux_hal.context, start, count, registers,
                                        deadline_us);
        });
    }
    static cb_transfer write_read(void *context, std::uint16_t write_start,
                                  std::uint16_t write_count, const std::uint16_t *write_registers,
                                  std::uint16_t read_start, std::uint16_t read_count,
                                  std::uint16_t *read_registers, std::int64_t deadline_us) {
        inside &self = of(context);
        const std::int64_t requested_us = self.now_us();
        const cb_transfer result = self.written([&] {
            return self.linux_hal.write_read(self.linux_hal.context, write_start, write_count,
                                             write_registers, read_start, read_count,
                                             read_registers, deadline_us);
        });
        self.report(result, requested_us, read_registers);
        return result;
    }
    static std::size_t samples(void *context, cb_sample *list, std::size_t max) {
        inside &self = of(context);
        std::size_t count = 0;
        for (; count < self.offsets_um.size() && count < max; ++count) {
            list[count] = {static_cast<std::uint8_t>(self.offset_signal[count]),
                           static_cast<float>(self.offsets_um[count]), self.now_us()};
        }
        return count;
    }
    static void feed(void *context) {
        inside &self = of(context);
        self.linux_hal.feed_watchdog(self.linux_hal.context);
    }
    static bool is_stopping(void *context) {
        inside &self = of(context);
        return self.linux_hal.stop_requested(self.linux_hal.context);
    }
};

live_box::live_box(const box_setup &setup) : inside_(std::make_unique<inside>()) {
    inside_->start(this, setup);
}

live_box::~live_box() {
    stop();
}

void live_box::cycle() {
    if (interrupted) throw input_error("interrupted; nothing was written to the file");
    cb_cycle_run(&inside_->cycle, &inside_->box, &inside_->hal);
    if (read_ok()) inside_->answered_us = read_us();
    if (mode() == CB_MODE_ACTIVE) inside_->active_us = inside_->now_us();
}

bool live_box::cycle_until(double timeout_s, const std::function<bool()> &done) {
    const std::int64_t until_us = inside_->now_us() + static_cast<std::int64_t>(timeout_s * 1e6);
    do {
        cycle();
        if (done()) return true;
    } while (inside_->now_us() < until_us);
    return false;
}

void live_box::set_offset_um(std::size_t channel, double um) {
    inside_->offsets_um.at(channel) = um;
}

bool live_box::stop() {
    inside &self = *inside_;
    if (self.stopped) return self.confirmed;
    reading_between_ = false;
    on_reading = nullptr;
    on_write = nullptr;
    self.target.stop = true;
    double longest_s = 2.0;
    for (std::size_t c = 0; c < self.offsets_um.size(); ++c) {
        const cb_channel_config &channel = self.box.config.channels[c];
        longest_s = std::max(longest_s, 2.0 + std::abs(output_um(c)) / channel.slew_um_per_s);
    }
    const std::int64_t until_us = self.now_us() + static_cast<std::int64_t>(longest_s * 1e6);
    do {
        cb_cycle_run(&self.cycle, &self.box, &self.hal);
    } while (!self.cycle.out.stopped && self.now_us() < until_us);
    cb_linux_close(&self.target);
    self.stopped = true;
    self.confirmed = self.cycle.out.stopped || !self.moved;
    return self.confirmed;
}

const cb_config &live_box::config() const {
    return inside_->box.config;
}
int live_box::mode() const {
    return inside_->box.mode.mode;
}
int live_box::reason() const {
    return inside_->box.mode.reason;
}
bool live_box::read_ok() const {
    return inside_->cycle.in.read_ok;
}
const std::uint16_t *live_box::registers() const {
    return inside_->cycle.in.registers;
}
const std::uint16_t *live_box::written() const {
    return inside_->cycle.out.registers;
}
double live_box::age_s() const {
    return static_cast<double>(inside_->now_us() - inside_->answered_us) * 1e-6;
}
double live_box::inactive_s() const {
    return static_cast<double>(inside_->now_us() - inside_->active_us) * 1e-6;
}
double live_box::output_um(std::size_t channel) const {
    return inside_->box.channels[channel].output_um;
}
std::uint32_t live_box::exchange_us() const {
    return inside_->cycle.in.exchange_us;
}
std::int64_t live_box::read_us() const {
    return inside_->cycle.in.read_us;
}
std::uint32_t live_box::writes_refused() const {
    return inside_->box.counters.writes_refused;
}
std::uint32_t live_box::reads_torn() const {
    return inside_->box.counters.reads_torn;
}
std::uint32_t live_box::handshakes() const {
    return inside_->box.counters.handshakes;
}

std::optional<double> live_box::applied_um(std::size_t channel) const {
    const cb_channel_config &of = config().channels[channel];
    if (!of.has_applied) return std::nullopt;
    return cb_channel_decode(&of, registers() + of.applied_reg);
}

std::optional<double> live_box::applied_um(std::size_t channel, const plc_reading &reading) const {
    const cb_channel_config &of = config().channels[channel];
    if (!of.has_applied) return std::nullopt;
    return cb_channel_decode(&of, reading.registers.data() + of.applied_reg);
}

int live_box::last_exception() const {
    const std::uint32_t *counts = inside_->exceptions_by_code();
    for (int code = 1; code < CB_TCP_EXCEPTIONS; ++code) {
        const auto at = static_cast<std::size_t>(code);
        if (counts[at] > inside_->read_back_exceptions[at]) return code;
    }
    return 0;
}

read_back live_box::found_read_back() const {
    return inside_->found;
}

int live_box::read_back_exception() const {
    const auto &counts = inside_->read_back_exceptions;
    const auto first = std::find_if(counts.begin(), counts.end(), [](auto n) { return n > 0; });
    return first == counts.end() ? 0 : static_cast<int>(first - counts.begin());
}

std::string live_box::write_remedy() const {
    const bool combined = config().plc.exchange == CB_EXCHANGE_FC23;
    return cb_peer_remedy(combined ? CB_MODBUS_WRITE_READ : CB_MODBUS_WRITE);
}

std::string live_box::peer() const {
    const cb_plc_config &plc = config().plc;
    return inside_->on_serial_line() ? plc.serial.device : fmt::format("{}:{}", plc.host, plc.port);
}

std::string live_box::no_reply() const {
    const cb_serial &serial = inside_->target.rtu.serial;
    if (!inside_->on_serial_line()) {
        return fmt::format(
            "plc.transport.tcp: no reply from {}: {}; check address, port, cable and the PLC's "
            "Modbus server",
            peer(), connection());
    }
    return fmt::format(
        "plc.transport.rtu: no reply on {}: {}; check device, unit, baud, parity, wires and the "
        "PLC's Modbus server",
        peer(),
        serial.fd < 0 ? cb_serial_error(serial.error_number)
                      : "the device is open, but no valid reply came");
}

// out: the cause of a TCP connection that is lost or without a valid reply
std::string live_box::connection() const {
    const cb_link &link = inside_->target.tcp.link;
    if (link.state == CB_LINK_UP) return "connected, but no valid reply came";
    switch (static_cast<cb_link_cause>(link.cause)) {
        case CB_LINK_CAUSE_ERRNO:
            return std::strerror(link.error_number);
        case CB_LINK_CAUSE_PEER:
            return "the PLC closed the connection; does it serve another client?";
        case CB_LINK_CAUSE_SILENT:
            return "the PLC does not reply";
        case CB_LINK_CAUSE_FRAMING:
            return "what replies is no Modbus/TCP server";
        case CB_LINK_CAUSE_LEFT: /* commissioning does not leave */
        case CB_LINK_CAUSE_NONE:
            break;
    }
    return "no connection yet";
}

}  // namespace compbox::commission
