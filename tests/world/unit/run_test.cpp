// SPDX-License-Identifier: MIT
// The daemon's own main in the world: its ends and its restarts.
#include "tests/world/run.h"

#include <gtest/gtest.h>

#include "tests/world/shrink.h"

extern "C" {
#include "hal/linux/daemon/loop.h"
}

namespace compbox::world {
namespace {

run_options of_seed(std::uint64_t seed) {
    run_options options;
    options.seed = seed;
    options.cycles = 500;
    return options;
}

TEST(run, a_daemon_that_is_killed_starts_again_with_its_first_variables) {
    run world(of_seed(3));
    std::vector<std::uint64_t> made;  // cycles of each daemon, before its end
    world.time.at(4 * second, [&] {
        const auto *loop = static_cast<const cb_loop *>(world.box.argument_of("compboxd-loop"));
        made.push_back(loop->made);
        world.box.kill();
    });
    world.time.at(6100 * ms, [&] {
        const auto *loop = static_cast<const cb_loop *>(world.box.argument_of("compboxd-loop"));
        made.push_back(loop->made);
    });
    const run_result result = world.go();
    EXPECT_EQ(result.starts, 2u);
    EXPECT_TRUE(result.violations.empty());
    ASSERT_EQ(made.size(), 2u);
    EXPECT_GT(made[0], 100u);
    EXPECT_LT(made[1], 20u);
}

TEST(run, after_a_power_cut_the_box_boots_again_and_knows_it) {
    run_options options = of_seed(3);
    options.cycles = 3000;
    run world(options);
    std::string before, lines;
    const auto logged = world.box.logged;
    world.box.logged = [&](const std::string &line) {
        lines += line + "\n";
        logged(line);
    };
    world.time.at(15 * second, [&] {
        before = world.box.boot_id();
        lines.clear();
        world.box.cut_power();
    });
    const run_result result = world.go();
    EXPECT_TRUE(result.violations.empty());
    EXPECT_EQ(result.starts, 2u);
    EXPECT_NE(world.box.boot_id(), before);
    EXPECT_NE(lines.find("the previous run did not end STOPPED"), std::string::npos) << lines;
}

TEST(run, the_same_seed_gives_the_same_bytes_with_all_faults) {
    run_options options = of_seed(7);
    options.faults = fault_set_of("all");
    const run_result first = run(options).go(), again = run(options).go();
    EXPECT_EQ(first.hash, again.hash);
    EXPECT_EQ(first.faults, again.faults);
    options.faults = {};
    EXPECT_NE(run(options).go().hash, first.hash);
}

TEST(run, a_violation_is_shrunk_to_the_fault_and_the_cycles_that_it_needs) {
    run_options options = of_seed(7);
    options.faults = fault_set_of("all");
    options.prepare = [](run &world) {
        world.time.at(3 * second, [&world] {
            if (world.faults.has(fault_kind::tear)) world.report("planted", "a tear");
        });
    };
    const run_result whole = run(options).go();
    ASSERT_EQ(whole.violations.size(), 1u);
    const failing_run small = shrunk({options, whole.violations[0]});
    EXPECT_EQ(text_of(small.options.faults), "tear");
    EXPECT_LT(small.options.cycles, 400u);
    EXPECT_EQ(small.found.at, 3 * second);
}

}  // namespace
}  // namespace compbox::world
