// SPDX-License-Identifier: MIT
// The engine of the scenarios: the box's own cycle at fakeplc, in virtual time.
#include "host-tools/simulation/world.h"

#include <gtest/gtest.h>

#include "host-tools/coefficients/load.h"
#include "host-tools/formats/error.h"
#include "host-tools/simulation/travels.h"
#include "tests/support/paths.h"

namespace compbox::simulation {
namespace {

const std::string folder = from_source("examples/dual-drive/");
constexpr wire_times quiet_network = {5000, 4000};

struct site {
    std::unique_ptr<cb_config> box = coefficients::load_coefficients(folder + "coefficients.json");
    twin::twin_config twin = twin::load_twin(folder + "machine_twin.json");
    fakeplc::register_map map = fakeplc::load_register_map(folder + "coefficients.json");
};

// What the box wrote in each cycle of a travel from corner to corner.
std::vector<std::uint16_t> written(const site &s) {
    world at(*s.box, s.twin, s.map, quiet_network);
    std::vector<std::uint16_t> all;
    at.hooks.after_box_cycle = [&] {
        const auto *registers = at.outputs().registers;
        all.insert(all.end(), registers, registers + s.box->plc.write.count);
    };
    states_along(at, {{0.0, 0.0, 0.0}, {120.0, 120.0, 0.0}, 100.0});
    return all;
}

TEST(World, TheBoxCompensatesByOneRequestAsByTwo) {
    std::vector<twin::twin_state> by[2];
    for (const auto exchange : {CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23}) {
        site s;
        s.box->plc.exchange = exchange;
        world at(*s.box, s.twin, s.map, quiet_network);
        by[exchange] = states_at(at, {{30.0, 40.0, 0.0}, {100.0, 20.0, 0.0}}, 50.0);
        EXPECT_EQ(at.box().counters.reads_failed + at.box().counters.writes_failed, 0u);
        EXPECT_EQ(at.box().counters.missed_ticks, 0u);
        EXPECT_EQ(at.now_us() / s.box->period_us, at.box().counters.cycles);
    }
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NE(by[0][i].drive_um[0][0], 0.0);
        EXPECT_EQ(by[0][i].drive_um, by[1][i].drive_um);
    }
}

TEST(World, TheSameWorldGivesTheSameRun) {
    const auto once = written(site()), again = written(site());
    EXPECT_GT(once.size(), 1000u);
    EXPECT_EQ(once, again);
}

// Machines that differ in their errors alone are one and the same to the box.
TEST(World, NoTruthReachesTheBox) {
    site other;
    for (auto &[name, error] : other.twin.errors) error.amplitude += 10.0;
    other.twin.unexplained_percent += 20.0;
    twin::twin_state state;
    state.position_mm = {30.0, 40.0, 0.0};
    EXPECT_NE(twin::twin_machine(site().twin).true_error_um(state),
              twin::twin_machine(other.twin).true_error_um(state));
    EXPECT_EQ(written(site()), written(other));
}

TEST(World, AnExchangeThatACycleCannotHoldIsRefused) {
    const site s;
    world at(*s.box, s.twin, s.map, {20000, 20000});
    try {
        at.wait_until_active();
        ADD_FAILURE() << "ACTIVE";
    } catch (const input_error &error) {
        EXPECT_EQ(std::string(error.what()),
                  folder +
                      "coefficients.json: the box does not become ACTIVE (it is in STANDBY: "
                      "the PLC answers readings but confirms no write)");
    }
    EXPECT_EQ(at.box().counters.missed_ticks, 0u);
}

TEST(World, AnUnknownProfileIsRefused) {
    site s;
    s.map.profile = "abacus";
    EXPECT_THROW(world(*s.box, s.twin, s.map), input_error);
}

}  // namespace
}  // namespace compbox::simulation
