// SPDX-License-Identifier: MIT
#include "host-tools/simulation/world.h"

#include "host-tools/formats/error.h"

namespace compbox::simulation {

namespace {

constexpr std::int64_t longest_start_us = 60000000;

fakeplc::fake_plc plc_of(twin::twin_config machine, const fakeplc::register_map &map) {
    const auto profile = fakeplc::plc_profile::find(map.profile);
    if (!profile) throw input_error(map.file, 0, 0, "unknown profile '{}'", map.profile);
    machine.program.clear();
    return fakeplc::fake_plc(machine, map, *profile, 0);
}

}  // namespace

world::world(const cb_config &config, const twin::twin_config &machine,
             const fakeplc::register_map &map, const wire_times &wire)
    : plc_(plc_of(machine, map)),
      hal_({[this](std::int64_t until_us) {
                plc_.run_to(until_us, hooks.after_scan, hooks.after_nc_cycle);
            },
            [this](const fakeplc::byte_string &request) { return plc_.answer(request); }},
           config.period_us, wire),
      operations_(hal_.operations()),
      box_(std::make_unique<cb_box>()) {
    plc_.leave_truth_out();
    box_->config = config;
    cb_box_start(box_.get());
    cb_cycle_start(&cycle_);
}

void world::cycle() {
    cb_cycle_run(&cycle_, box_.get(), &operations_);
    if (hooks.after_box_cycle) hooks.after_box_cycle();
}

void world::wait_until_active() {
    while (!is_active()) {
        if (now_us() > longest_start_us) refuse("does not become ACTIVE");
        cycle();
    }
}

double world::lead_ms() const {
    return 1e-3 * cb_lead_us(&box_->config, &box_->life.lead);
}

void world::refuse(const std::string &what) const {
    throw input_error(plc_.map().file, 0, 0, "the box {} (it is in {}: {})", what,
                      cb_mode_name(box_->mode.mode), cb_reason_text(box_->mode.reason));
}

}  // namespace compbox::simulation
