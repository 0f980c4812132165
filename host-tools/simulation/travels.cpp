// SPDX-License-Identifier: MIT
#include "host-tools/simulation/travels.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace compbox::simulation {

namespace {

constexpr std::int64_t longest_stop_us = 10000000;
constexpr std::int64_t longest_move_us = 7200000000;
constexpr double rapid_mm_per_s = 1e3;  // or as fast as the axes go
constexpr int quiet_cycles = 10;        // without motion: at rest

void travel_to(world &at, const twin::xyz &position_mm, double feed_mm_per_s) {
    twin::twin_step step;
    for (std::size_t a = 0; a < 3; ++a) {
        if (at.plc().twin().config().axes[a].present) step.target_mm[a] = position_mm[a];
    }
    step.feed_mm_per_s = feed_mm_per_s;
    at.plc().move(step);
    const std::int64_t latest_us = at.now_us() + longest_move_us;
    do {
        at.cycle();
        if (!at.is_active()) at.refuse("does not stay ACTIVE while the axes move");
        if (at.now_us() > latest_us) at.refuse("waits for a move that does not end");
    } while (at.plc().moving());
}

// Waits until the box's outputs and the tool have not moved for quiet_cycles.
void rest(world &at) {
    const std::int64_t latest_us = at.now_us() + longest_stop_us;
    for (int quiet = 0; quiet < quiet_cycles;) {
        const auto moved = at.plc().nc().state().drive_um;
        const cb_outputs outputs = at.outputs();
        at.cycle();
        const bool same = moved == at.plc().nc().state().drive_um &&
                          std::equal(std::begin(outputs.channel_um), std::end(outputs.channel_um),
                                     std::begin(at.outputs().channel_um));
        quiet = same ? quiet + 1 : 0;
        if (!at.is_active()) at.refuse("does not stay ACTIVE at standstill");
        if (at.now_us() > latest_us) at.refuse("does not come to rest at standstill");
    }
}

twin::twin_state go_to(world &at, const twin::xyz &position_mm, double feed_mm_per_s) {
    travel_to(at, position_mm, feed_mm_per_s);
    rest(at);
    return at.plc().nc().state();
}

// out: number of NC cycles per kept state; not a multiple of the box's period, so that all phases
// occur
long long keep_every(const travel &way, double cycle_s, int most_states) {
    double squares = 0.0;
    for (std::size_t a = 0; a < 3; ++a) squares += std::pow(way.to_mm[a] - way.from_mm[a], 2.0);
    const double cycles = std::sqrt(squares) / way.feed_mm_per_s / cycle_s;
    long long every = 1 + static_cast<long long>(cycles / most_states);
    while (std::gcd(every, 15) != 1) ++every;
    return every;
}

}  // namespace

std::vector<twin::twin_state> states_at(world &at, const std::vector<twin::xyz> &positions_mm,
                                        double feed_mm_per_s) {
    at.wait_until_active();
    std::vector<twin::twin_state> states;
    for (const auto &position : positions_mm) states.push_back(go_to(at, position, feed_mm_per_s));
    return states;
}

std::vector<twin::twin_state> states_along(world &at, const travel &way, int most_states) {
    at.wait_until_active();
    go_to(at, way.from_mm, rapid_mm_per_s);
    std::vector<twin::twin_state> states;
    const double cycle_s = at.plc().twin().config().nc.interpolation_s;
    const long long every = keep_every(way, cycle_s, most_states);
    long long cycles = 0;
    at.hooks.after_nc_cycle = [&] {
        if (cycles++ % every == 0) states.push_back(at.plc().nc().state());
    };
    travel_to(at, way.to_mm, way.feed_mm_per_s);
    at.hooks.after_nc_cycle = nullptr;
    return states;
}

}  // namespace compbox::simulation
