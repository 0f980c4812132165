// SPDX-License-Identifier: MIT
// Faults of serial lines and of the CAN bus.
#include <fmt/core.h>
#include <linux/can/error.h>

#include "tests/world/faults.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

can_frame error_frame(canid_t bits) {
    can_frame frame = {};
    frame.can_id = CAN_ERR_FLAG | bits;
    frame.can_dlc = CAN_ERR_DLC;
    return frame;
}

// Off the bus; the controller restarts a second later, and some only say that they are active. A
// short circuit may take the power of the nodes, too.
void go_off_the_bus(run &of) {
    if (of.time.now() < of.can->on_the_bus_ns) return;  // it is off
    of.can->put(error_frame(CAN_ERR_BUSOFF));
    can_frame back = error_frame(CAN_ERR_RESTARTED);
    if (of.options.seed % 2 == 0) {
        back = error_frame(CAN_ERR_CRTL);
        back.data[1] = CAN_ERR_CRTL_ACTIVE;
    }
    of.can->on_the_bus_ns = of.time.now() + second;
    of.time.at(of.can->on_the_bus_ns, [&of, back] { of.can->put(back); });
    if (!dice(static_cast<std::uint64_t>(of.time.now()), "short circuit").one_in(2)) return;
    of.can->reboot_all();
}

// The interface leaves, and is back by itself.
void leave(run &of, can_bus::interface_state state, time_ns duration) {
    of.can->set_interface(state);
    of.time.at(of.time.now() + duration,
               [&of] { of.can->set_interface(can_bus::interface_state::up); });
}

}  // namespace

line_fate fault_injector::at_line(bool) {
    line_fate fate;
    if (!has(fault_kind::line)) return fate;
    dice &drawn = chance(fault_kind::line);
    fate.lost = drawn.one_in(500);
    fate.flipped = drawn.one_in(300);
    fate.torn = drawn.one_in(200);
    if (fate.torn || drawn.one_in(200))
        fate.delay_ns = static_cast<time_ns>(drawn.log_between(100e3, 300e6));
    if (fate.lost || fate.flipped || fate.delay_ns > 0) count_one();
    return fate;
}

// The first starts do not reach a node that booted.
void fault_injector::be_deaf(std::size_t node, time_ns duration) {
    of_.can->nodes[node].deaf = true;
    of_.time.at(of_.time.now() + duration, [this, node] { of_.can->nodes[node].deaf = false; });
}

// A module of the bus has an exception for a reading: its sensor is broken.
void fault_injector::plan_modules() {
    if (of_.bus_line == nullptr) return;
    dice own(of_.options.seed, "silent module");
    if (has(fault_kind::sensors) && own.one_in(2)) {
        silent_unit_ = first_module + static_cast<int>(own.below(of_.box_machine.modules.size()));
        silent_from_ = own.time_between(0, 20 * second);
        silent_to_ = silent_from_ + static_cast<time_ns>(own.log_between(1e9, 300e9));
    }
    repeat(fault_kind::sensors, 10 * second, [this] {
        dice &drawn = chance(fault_kind::sensors);
        const auto lasts = static_cast<time_ns>(drawn.log_between(100e6, 15e9));
        refusing_unit_ =
            first_module + static_cast<int>(drawn.below(of_.box_machine.modules.size()));
        refusing_until_ = of_.time.now() + lasts;
        note(fault_kind::sensors,
             fmt::format("module {} has exceptions for {} ms", refusing_unit_, lasts / ms));
    });
}

bool fault_injector::module_refuses(int unit) const {
    return unit == refusing_unit_ && of_.time.now() < refusing_until_;
}

bool fault_injector::module_is_silent(int unit) const {
    const time_ns now = of_.time.now();
    return active() && unit == silent_unit_ && now >= silent_from_ && now < silent_to_;
}

void fault_injector::plan_wires() {
    plan_modules();
    const auto plugs = std::make_shared<dice>(of_.options.seed, "plugs");
    repeat(fault_kind::line, 40 * second, [this, plugs] {
        serial_line *const line =
            chance(fault_kind::line).one_in(2) ? of_.plc_line.get() : of_.bus_line.get();
        if (line == nullptr) return;
        note(fault_kind::line, "a serial adapter is unplugged");
        line->plug(false);
        time_ns back = chance(fault_kind::line).time_between(0, 5 * second);
        if (plugs->one_in(6)) back *= 4;
        const time_ns taken = plugs->one_in(4) ? plugs->time_between(0, 40 * second) : 0;
        of_.time.at(of_.time.now() + back, [this, line, taken] {
            if (active_ || !line->is_plugged()) line->plug(true);
            if (!active_ || taken == 0) return;
            note(fault_kind::line, fmt::format("another program takes it for {} ms", taken / ms));
            line->taken_until_ns = of_.time.now() + taken;
        });
    });
    repeat(fault_kind::can, 6 * second, [this] {
        if (of_.can == nullptr) return;
        dice &drawn = chance(fault_kind::can);
        const std::size_t node = drawn.below(of_.can->nodes.size());
        const time_ns duration = drawn.time_between(0, 10 * second), now = of_.time.now();
        dice own(of_.options.seed + static_cast<std::uint64_t>(now), "full queue");
        if (own.one_in(4)) {
            of_.can->full_until_ns = now + duration + own.time_between(0, 2 * second);
            note(fault_kind::can, fmt::format("no frame can be sent for {} ms",
                                              (of_.can->full_until_ns - now) / ms));
        }
        switch (drawn.below(6)) {
            case 0:
                // A bus without its power: the nodes boot while nobody hears them.
                note(fault_kind::can, "the interface goes down, and all nodes boot");
                leave(of_, can_bus::interface_state::down, duration);
                of_.can->reboot_all();
                break;
            case 1:
                note(fault_kind::can, "the interface goes away");
                leave(of_, can_bus::interface_state::gone, duration);
                break;
            case 2:
                note(fault_kind::can, "bus off");
                go_off_the_bus(of_);
                break;
            case 3:
                note(fault_kind::can, "a node boots");
                if (of_.can->nodes[node].supervised) be_deaf(node, duration);
                of_.can->reboot(node);
                break;
            case 4:
                note(fault_kind::can, "a node falls silent");
                of_.can->nodes[node].silent = true;
                of_.time.at(of_.time.now() + duration,
                            [this, node] { of_.can->nodes[node].silent = false; });
                break;
            default: {
                note(fault_kind::can, "a flood of frames");
                of_.can->flooded_ns = of_.time.now();
                can_frame frame = {};
                frame.can_id = of_.can->nodes[node].value_id(false);
                frame.can_dlc = static_cast<std::uint8_t>(drawn.below(9));
                for (std::uint64_t i = drawn.below(2000); i > 0; --i) of_.can->put(frame);
                break;
            }
        }
    });
}

}  // namespace compbox::world
