// SPDX-License-Identifier: MIT
// A PLC that is nothing but holding registers, in virtual time, behind the box's own cycle: a test
// brings it to life by `update` and `written`.
#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "host-tools/simulation/virtual_hal.h"

namespace compbox {

class virtual_registers : public simulation::virtual_hal {
  public:
    virtual_registers(std::int64_t period_us, std::int64_t start_us)
        : virtual_hal({[this](std::int64_t now_us) { catch_up(now_us); },
                       [this](const fakeplc::byte_string &request) { return answer(request); }},
                      period_us, {}, start_us) {
        bank_.now.resize(65536);  // the whole address space of Modbus
    }

    // The world up to now_us: called whenever time passes, always before a request sees registers.
    std::function<void(std::int64_t now_us)> update;
    // A write arrived at now_us.
    std::function<void(std::int64_t now_us)> written;

    std::uint32_t watchdog_fed = 0, reads = 0, writes = 0;  // how often
    bool stop = false;                                      // answers stop_requested()
    std::vector<cb_sample> samples;                         // waiting to be fetched, oldest first
    std::uint16_t *registers() { return bank_.now.data(); }

    cb_hal hal() {
        cb_hal hal = operations();
        hal.samples = [](void *here, cb_sample *to, std::size_t max) {
            auto &waiting = self(here).samples;
            const auto count = std::min(waiting.size(), max);
            const auto end = waiting.begin() + static_cast<std::ptrdiff_t>(count);
            std::copy(waiting.begin(), end, to);
            waiting.erase(waiting.begin(), end);
            return count;
        };
        hal.feed_watchdog = [](void *here) { ++self(here).watchdog_fed; };
        hal.stop_requested = [](void *here) { return self(here).stop; };
        return hal;
    }

  private:
    static virtual_registers &self(void *here) {
        return static_cast<virtual_registers &>(*static_cast<virtual_hal *>(here));
    }
    void catch_up(std::int64_t now_us) {
        if (update) update(now_us);
    }
    fakeplc::byte_string answer(const fakeplc::byte_string &request) {
        static const fakeplc::plc_profile generic = fakeplc::plc_profile::find("generic").value();
        const fakeplc::byte_string reply = fakeplc::modbus::answer(request, generic, bank_);
        if (reply.at(0) != request.at(0)) return reply;
        reads += fakeplc::modbus::reads(request[0]);
        writes += fakeplc::modbus::writes(request[0]);
        if (fakeplc::modbus::writes(request[0]) && written) written(now_us());
        return reply;
    }

    fakeplc::modbus::bank bank_;
};

}  // namespace compbox
