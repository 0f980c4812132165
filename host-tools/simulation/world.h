// SPDX-License-Identifier: MIT
// The engine of every scenario: the box's own cycle (hal/cycle.h) on virtual_hal.h, and fakeplc
// with the machine at the other end. Between the two pass the bytes of Modbus and nothing else; the
// wire alone is missing. A scenario moves the axes and watches, by `hooks`.
#pragma once

#include <memory>

#include "host-tools/fakeplc/plc.h"
#include "host-tools/simulation/virtual_hal.h"

extern "C" {
#include "hal/cycle.h"
}

namespace compbox::simulation {

class world {
  public:
    // The PLC is switched on and the box started at time 0. The machine's own program is left out:
    // the scenario moves the axes. Throws input_error for a profile or a channel that fakeplc
    // lacks.
    world(const cb_config &config, const twin::twin_config &machine,
          const fakeplc::register_map &map, const wire_times &wire = {});

    // Callbacks of a scenario; each may be empty.
    struct {
        std::function<void()> after_nc_cycle, after_box_cycle;
        std::function<void(const fakeplc::plc_state &)> after_scan;
    } hooks;

    // One cycle of the box.
    void cycle();
    // Cycles until the box is ACTIVE. Throws input_error after a minute.
    void wait_until_active();

    std::int64_t now_us() const { return hal_.now_us(); }
    fakeplc::fake_plc &plc() { return plc_; }
    const cb_box &box() const { return *box_; }
    const cb_outputs &outputs() const { return cycle_.out; }
    bool is_active() const { return box_->mode.mode == CB_MODE_ACTIVE; }
    double lead_ms() const;  // lead of the box

    // Throws input_error: "FILE: the box WHAT (it is in MODE: REASON)".
    [[noreturn]] void refuse(const std::string &what) const;

  private:
    fakeplc::fake_plc plc_;
    virtual_hal hal_;
    cb_hal operations_;
    std::unique_ptr<cb_box> box_;
    cb_cycle cycle_;
};

}  // namespace compbox::simulation
