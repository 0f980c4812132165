// SPDX-License-Identifier: MIT
#include "host-tools/simulation/virtual_hal.h"

#include <algorithm>

namespace compbox::simulation {

virtual_hal::virtual_hal(virtual_peer peer, std::int64_t period_us, const wire_times &on_wire,
                         std::int64_t start_us)
    : wire(on_wire),
      peer_(std::move(peer)),
      period_us_(period_us),
      now_us_(start_us),
      tick_us_(start_us) {}

void virtual_hal::pass(std::int64_t until_us) {
    now_us_ = std::max(now_us_, until_us);
    peer_.run_to(now_us_);
}

// To the first tick after now. out: how many lie between it and the last one
std::uint32_t virtual_hal::wait_tick() {
    const std::int64_t missed = (now_us_ - tick_us_) / period_us_;
    tick_us_ += (missed + 1) * period_us_;
    pass(tick_us_);
    return static_cast<std::uint32_t>(missed);
}

std::int64_t virtual_hal::duration_us(std::uint8_t function) const {
    if (function == CB_MODBUS_READ) return wire.read_us;
    if (function == CB_MODBUS_WRITE) return wire.write_us;
    return std::max(wire.read_us, wire.write_us);
}

// in : request within the ranges of firmware/wire/modbus.h
// out: as the operations of hal.h: registers unchanged unless CB_TRANSFER_OK
cb_transfer virtual_hal::exchange(const cb_modbus_request &request, std::uint16_t *registers,
                                  std::int64_t deadline_us) {
    const std::int64_t start_us = now_us_, takes_us = duration_us(request.function);
    if (start_us + takes_us > deadline_us) return CB_TRANSFER_FAILED;
    fakeplc::byte_string pdu(CB_MODBUS_MAX_PDU);
    pdu.resize(cb_modbus_encode(&request, pdu.data()));
    pass(start_us + takes_us / 2);
    const fakeplc::byte_string reply = peer_.answer(pdu);
    pass(start_us + takes_us);
    std::uint8_t exception = 0;
    switch (cb_modbus_decode(&request, reply.data(), reply.size(), registers, &exception)) {
        case CB_MODBUS_OK:
            return CB_TRANSFER_OK;
        case CB_MODBUS_EXCEPTION:
            return CB_TRANSFER_REFUSED;
        case CB_MODBUS_INVALID:
            break;
    }
    return CB_TRANSFER_UNKNOWN;
}

// Each operation finds this object behind its context.
cb_hal virtual_hal::operations() {
    using self = virtual_hal *;
    cb_hal hal = {};
    hal.context = this;
    hal.now_us = [](void *here) { return self(here)->now_us_; };
    hal.wait_tick = [](void *here) { return self(here)->wait_tick(); };
    hal.read = [](void *here, uint16_t start, uint16_t count, uint16_t *registers,
                  int64_t deadline_us) {
        return self(here)->exchange(cb_modbus_read(start, count), registers, deadline_us);
    };
    hal.write = [](void *here, uint16_t start, uint16_t count, const uint16_t *registers,
                   int64_t deadline_us) {
        return self(here)->exchange(cb_modbus_write(start, count, registers), nullptr, deadline_us);
    };
    hal.write_read = [](void *here, uint16_t write_start, uint16_t write_count,
                        const uint16_t *write_registers, uint16_t read_start, uint16_t read_count,
                        uint16_t *read_registers, int64_t deadline_us) {
        return self(here)->exchange(
            cb_modbus_write_read(write_start, write_count, write_registers, read_start, read_count),
            read_registers, deadline_us);
    };
    hal.samples = [](void *, cb_sample *, std::size_t) { return std::size_t{0}; };
    hal.feed_watchdog = [](void *) {};
    hal.stop_requested = [](void *) { return false; };
    return hal;
}

}  // namespace compbox::simulation
