// SPDX-License-Identifier: MIT
#include "host-tools/compbox/virtual_run.h"

#include <memory>

#include "host-tools/formats/error.h"

namespace compbox {

namespace {

constexpr int64_t longest_start_us = 10000000;
constexpr int64_t longest_stop_us = 10000000;
constexpr int64_t longest_move_us = 600000000;
constexpr int quiet_cycles = 10;  // nothing moved for so long: at rest

// FC3 and FC16 as bytes, big-endian.
void append(byte_string &bytes, unsigned word) {
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
    bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
}

byte_string read_request(std::uint16_t start, std::uint16_t count) {
    byte_string request{3};
    append(request, start);
    append(request, count);
    return request;
}

byte_string write_request(std::uint16_t start, std::uint16_t count,
                          const std::uint16_t *registers) {
    byte_string request{16};
    append(request, start);
    append(request, count);
    request.push_back(static_cast<std::uint8_t>(2 * count));
    for (unsigned i = 0; i < count; ++i) append(request, registers[i]);
    return request;
}

// The world around the box: clock and PLC. The operations of cb_hal work on it.
struct site {
    fake_plc plc;
    int64_t now_us = 0;
    int64_t period_us;
    bool stop = false;
};

site &site_of(void *context) {
    return *static_cast<site *>(context);
}

int64_t hal_now(void *context) {
    return site_of(context).now_us;
}

uint32_t hal_wait_tick(void *context) {
    site &here = site_of(context);
    here.now_us += here.period_us;
    here.plc.run_to(here.now_us);
    return 0;
}

cb_transfer hal_read(void *context, uint16_t start, uint16_t count, uint16_t *registers, int64_t) {
    const byte_string reply = site_of(context).plc.answer(read_request(start, count));
    if (reply.size() != 2u + 2u * count || reply[0] != 3) return CB_TRANSFER_REFUSED;
    for (std::size_t i = 0; i < count; ++i) {
        registers[i] = static_cast<uint16_t>(reply[2 + 2 * i] << 8 | reply[3 + 2 * i]);
    }
    return CB_TRANSFER_OK;
}

cb_transfer hal_write(void *context, uint16_t start, uint16_t count, const uint16_t *registers,
                      int64_t) {
    const byte_string reply = site_of(context).plc.answer(write_request(start, count, registers));
    return reply.size() == 5 && reply[0] == 16 ? CB_TRANSFER_OK : CB_TRANSFER_REFUSED;
}

cb_transfer hal_write_read(void *context, uint16_t write_start, uint16_t write_count,
                           const uint16_t *write_registers, uint16_t read_start,
                           uint16_t read_count, uint16_t *read_registers, int64_t deadline_us) {
    const cb_transfer written =
        hal_write(context, write_start, write_count, write_registers, deadline_us);
    if (written != CB_TRANSFER_OK) return written;
    return hal_read(context, read_start, read_count, read_registers, deadline_us);
}

size_t hal_samples(void *, cb_hal_sample *, size_t) {
    return 0;
}

void hal_feed_watchdog(void *) {}

bool hal_stop_requested(void *context) {
    return site_of(context).stop;
}

cb_hal hal_of(site &here) {
    cb_hal hal = {};
    hal.context = &here;
    hal.now_us = hal_now;
    hal.wait_tick = hal_wait_tick;
    hal.read = hal_read;
    hal.write = hal_write;
    hal.write_read = hal_write_read;
    hal.samples = hal_samples;
    hal.feed_watchdog = hal_feed_watchdog;
    hal.stop_requested = hal_stop_requested;
    return hal;
}

// Box, cycle and site together.
class bench {
  public:
    bench(const cb_config &config, const twin_config &machine, const register_map &map,
          const plc_profile &profile)
        : site_{fake_plc(machine, map, profile, 0), 0, config.period_us, false},
          hal_(hal_of(site_)),
          box_(std::make_unique<cb_box>()) {
        box_->config = config;
        cb_box_start(box_.get());
        cb_cycle_start(&cycle_);
    }

    const cb_box &box() const { return *box_; }
    fake_plc &plc() { return site_.plc; }
    int64_t now_us() const { return site_.now_us; }

    void cycle() { cb_cycle_run(&cycle_, box_.get(), &hal_); }

    bool is_active() const { return box_->mode.mode == CB_MODE_ACTIVE; }

    void wait_until_active() {
        while (!is_active()) {
            if (now_us() > longest_start_us) refuse("does not become ACTIVE");
            cycle();
        }
    }

    settled_stop go_to(const xyz &position_mm, double feed_mm_per_s) {
        twin_step step;
        for (std::size_t a = 0; a < 3; ++a) step.target_mm[a] = position_mm[a];
        step.feed_mm_per_s = feed_mm_per_s;
        plc().move(step);
        const int64_t latest_us = now_us() + longest_move_us;
        cycle();
        while (plc().moving()) {
            cycle();
            if (!is_active()) refuse("does not stay ACTIVE while the axes move");
            if (now_us() > latest_us) refuse("waits for a move that does not end");
        }
        rest();
        return {plc().state().position_mm, plc().state().displacement_um};
    }

  private:
    // Until neither the box's outputs nor the tool have moved for a while.
    void rest() {
        const int64_t latest_us = now_us() + longest_stop_us;
        int quiet = 0;
        while (quiet < quiet_cycles) {
            const xyz moved = plc().state().displacement_um;
            const cb_outputs outputs = cycle_.out;
            cycle();
            const bool same =
                moved == plc().state().displacement_um &&
                std::equal(std::begin(outputs.channel_um), std::end(outputs.channel_um),
                           std::begin(cycle_.out.channel_um));
            quiet = same ? quiet + 1 : 0;
            if (!is_active()) refuse("does not stay ACTIVE at standstill");
            if (now_us() > latest_us) refuse("does not come to rest at standstill");
        }
    }

    [[noreturn]] void refuse(const std::string &what) const {
        throw input_error("the box " + what + " (it is in " + cb_mode_name(box_->mode.mode) + ": " +
                          cb_reason_text(box_->mode.reason) + ")");
    }

    site site_;
    cb_hal hal_;
    std::unique_ptr<cb_box> box_;
    cb_cycle cycle_ = {};
};

}  // namespace

virtual_run run_virtually(const cb_config &config, const twin_config &machine,
                          const register_map &map, const std::vector<xyz> &positions_mm,
                          double feed_mm_per_s) {
    const auto profile = plc_profile::find(map.profile);
    if (!profile) throw input_error(map.file, 0, 0, "unknown profile '" + map.profile + "'");
    twin_config quiet_machine = machine;
    quiet_machine.program.clear();  // the moves are ours
    bench bench(config, quiet_machine, map, *profile);
    bench.wait_until_active();
    virtual_run result = {};
    for (const auto &position : positions_mm) {
        result.stops.push_back(bench.go_to(position, feed_mm_per_s));
    }
    result.counters = bench.box().counters;
    result.duration_s = static_cast<double>(bench.now_us()) * 1e-6;
    return result;
}

}  // namespace compbox
