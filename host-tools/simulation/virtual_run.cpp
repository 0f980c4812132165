// SPDX-License-Identifier: MIT
#include "host-tools/simulation/virtual_run.h"

#include <cmath>
#include <memory>
#include <numeric>

#include "host-tools/formats/error.h"

namespace compbox::simulation {

namespace {

constexpr int64_t longest_start_us = 10000000;
constexpr int64_t longest_stop_us = 10000000;
constexpr int64_t longest_move_us = 7200000000;
constexpr double rapid_mm_per_s = 1e3;  // or as fast as the axes go
constexpr int quiet_cycles = 10;        // nothing moved for so long: at rest

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
    wire_times wire;
    int64_t period_us;
    int64_t now_us = 0, tick_us = 0;
    bool stop = false;
    long long cycles = 0, keep_every = 0;  // of the NC; 0: no states are kept
    std::vector<twin_state> states = {};

    void run_to(int64_t until_us) {
        now_us = until_us;
        while (keep_every > 0 && plc.next_due_us() <= until_us) {
            const double before_s = plc.nc().time_s();
            plc.run_to(plc.next_due_us());
            if (plc.nc().time_s() == before_s) continue;  // a scan alone
            if (cycles++ % keep_every == 0) states.push_back(plc.nc().state());
        }
        plc.run_to(until_us);
    }
    // A request with its reply.
    byte_string exchange(const byte_string &request, int64_t takes_us) {
        const int64_t start_us = now_us;
        run_to(start_us + takes_us / 2);
        byte_string reply = plc.answer(request);
        run_to(start_us + takes_us);
        return reply;
    }
};

site &site_of(void *context) {
    return *static_cast<site *>(context);
}

int64_t hal_now(void *context) {
    return site_of(context).now_us;
}

uint32_t hal_wait_tick(void *context) {
    site &here = site_of(context);
    here.tick_us += here.period_us;
    here.run_to(here.tick_us);
    return 0;
}

cb_transfer hal_read(void *context, uint16_t start, uint16_t count, uint16_t *registers, int64_t) {
    site &here = site_of(context);
    const byte_string reply = here.exchange(read_request(start, count), here.wire.read_us);
    if (reply.size() != 2u + 2u * count || reply[0] != 3) return CB_TRANSFER_REFUSED;
    for (std::size_t i = 0; i < count; ++i) {
        registers[i] = static_cast<uint16_t>(reply[2 + 2 * i] << 8 | reply[3 + 2 * i]);
    }
    return CB_TRANSFER_OK;
}

cb_transfer hal_write(void *context, uint16_t start, uint16_t count, const uint16_t *registers,
                      int64_t) {
    site &here = site_of(context);
    const byte_string reply =
        here.exchange(write_request(start, count, registers), here.wire.write_us);
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

size_t hal_samples(void *, cb_sample *, size_t) {
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
          const plc_profile &profile, const wire_times &wire)
        : site_{fake_plc(machine, map, profile, 0), wire, config.period_us},
          hal_(hal_of(site_)),
          box_(std::make_unique<cb_box>()) {
        site_.plc.leave_truth_out();
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

    // To a position, and until the compensation rests there.
    twin_state go_to(const xyz &position_mm, double feed_mm_per_s) {
        travel_to(position_mm, feed_mm_per_s);
        rest();
        return plc().nc().state();
    }

    // The states on the way to a position.
    std::vector<twin_state> states_to(const xyz &position_mm, double feed_mm_per_s, int most) {
        const xyz from_mm = plc().nc().position_mm();
        double squares = 0.0;
        for (std::size_t a = 0; a < 3; ++a) squares += std::pow(position_mm[a] - from_mm[a], 2.0);
        const double cycle_s = plc().twin().config().nc.interpolation_s;
        const double cycles = std::sqrt(squares) / feed_mm_per_s / cycle_s;
        site_.keep_every = 1 + static_cast<long long>(cycles / most);
        // Not in step with the box: each phase of its period shall be seen.
        while (std::gcd(site_.keep_every, 15) != 1) ++site_.keep_every;
        travel_to(position_mm, feed_mm_per_s);
        site_.keep_every = 0;
        return site_.states;
    }

  private:
    void travel_to(const xyz &position_mm, double feed_mm_per_s) {
        twin_step step;
        for (std::size_t a = 0; a < 3; ++a) {
            if (plc().twin().config().axes[a].present) step.target_mm[a] = position_mm[a];
        }
        step.feed_mm_per_s = feed_mm_per_s;
        plc().move(step);
        const int64_t latest_us = now_us() + longest_move_us;
        cycle();
        while (plc().moving()) {
            cycle();
            if (!is_active()) refuse("does not stay ACTIVE while the axes move");
            if (now_us() > latest_us) refuse("waits for a move that does not end");
        }
    }

    // Until neither the box's outputs nor the tool have moved for a while.
    void rest() {
        const int64_t latest_us = now_us() + longest_stop_us;
        int quiet = 0;
        while (quiet < quiet_cycles) {
            const auto moved = plc().nc().state().drive_um;
            const cb_outputs outputs = cycle_.out;
            cycle();
            const bool same =
                moved == plc().nc().state().drive_um &&
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

plc_profile profile_of(const register_map &map) {
    const auto profile = plc_profile::find(map.profile);
    if (!profile) throw input_error(map.file, 0, 0, "unknown profile '" + map.profile + "'");
    return *profile;
}

// The moves are ours.
twin_config without_program(twin_config machine) {
    machine.program.clear();
    return machine;
}

void finish(const bench &bench, virtual_run &result) {
    result.counters = bench.box().counters;
    result.duration_s = static_cast<double>(bench.now_us()) * 1e-6;
    result.lead_ms =
        static_cast<double>(cb_lead_us(&bench.box().config, &bench.box().life.lead)) * 1e-3;
}

}  // namespace

virtual_run run_virtually(const cb_config &config, const twin_config &machine,
                          const register_map &map, const std::vector<xyz> &positions_mm,
                          double feed_mm_per_s, const wire_times &wire) {
    bench bench(config, without_program(machine), map, profile_of(map), wire);
    bench.wait_until_active();
    virtual_run result = {};
    for (const auto &position : positions_mm) {
        result.states.push_back(bench.go_to(position, feed_mm_per_s));
    }
    finish(bench, result);
    return result;
}

virtual_run run_in_motion(const cb_config &config, const twin_config &machine,
                          const register_map &map, const travel &way, const wire_times &wire,
                          int most_states) {
    bench bench(config, without_program(machine), map, profile_of(map), wire);
    bench.wait_until_active();
    bench.go_to(way.from_mm, rapid_mm_per_s);
    virtual_run result = {};
    result.states = bench.states_to(way.to_mm, way.feed_mm_per_s, most_states);
    finish(bench, result);
    return result;
}

}  // namespace compbox::simulation
