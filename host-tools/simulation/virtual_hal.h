// SPDX-License-Identifier: MIT
// The box's hardware in virtual time: its clock, its ticks, and requests that a PLC in the same
// process answers. Nothing here reads a clock: the same calls give the same results.
#pragma once

#include <functional>

#include "host-tools/fakeplc/modbus.h"

extern "C" {
#include "firmware/wire/modbus.h"
#include "hal/hal.h"
}

namespace compbox::simulation {

// What a reading and a writing take on the wire, an FC23 as long as the longer of the two. The PLC
// sees a request in the middle of it.
struct wire_times {
    std::int64_t read_us = 0, write_us = 0;
};

// The PLC at the other end of the wire: it runs to a time, which never goes backward, and answers
// the PDU of a request by that of its reply.
struct virtual_peer {
    std::function<void(std::int64_t now_us)> run_to;
    std::function<fakeplc::byte_string(const fakeplc::byte_string &)> answer;
};

class virtual_hal {
  public:
    // Ticks are whole periods after start_us.
    virtual_hal(virtual_peer peer, std::int64_t period_us, const wire_times &on_wire,
                std::int64_t start_us = 0);
    virtual_hal(const virtual_hal &) = delete;
    virtual_hal &operator=(const virtual_hal &) = delete;

    wire_times wire;  // from the next request on

    // The operations of hal.h on this object, without sensors and without a stop request. Time
    // passes in wait_tick and in requests; a request that cannot end by its deadline is not sent.
    cb_hal operations();

    std::int64_t now_us() const { return now_us_; }
    // Advances the time; a time before now changes nothing.
    void pass(std::int64_t until_us);

  private:
    std::uint32_t wait_tick();
    std::int64_t duration_us(std::uint8_t function) const;
    cb_transfer exchange(const cb_modbus_request &request, std::uint16_t *registers,
                         std::int64_t deadline_us);

    virtual_peer peer_;
    std::int64_t period_us_, now_us_, tick_us_;
};

}  // namespace compbox::simulation
