// SPDX-License-Identifier: MIT
// The daemon's own main in the world: its ends and its restarts.
#include "tests/world/run.h"

#include <gtest/gtest.h>

#include "tests/world/isolated.h"
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
    EXPECT_EQ(text_of(small.options.faults, small.options.most), "tear:1");
    EXPECT_LT(small.options.cycles, 400u);
    EXPECT_EQ(small.found.at, 3 * second);
    // The line that is printed replays it.
    run_options again = of_seed(7);
    again.prepare = options.prepare;
    again.cycles = small.options.cycles;
    const std::string faults = text_of(small.options.faults, small.options.most);
    again.faults = fault_set_of(faults);
    again.most = fault_limits_of(faults);
    const run_result replayed = run_isolated(again);
    ASSERT_EQ(replayed.violations.size(), 1u);
    EXPECT_EQ(replayed.violations[0].cycle, small.found.cycle);
    EXPECT_EQ(replayed.violations[0].words, small.found.words);
}

TEST(run, a_crash_is_a_violation_and_is_shrunk_as_well) {
    run_options options = of_seed(7);
    options.faults = fault_set_of("tear,kill");
    options.prepare = [](run &world) {
        world.time.at(2 * second, [&world] {
            if (world.faults.has(fault_kind::kill)) std::abort();
        });
    };
    const run_result whole = run_isolated(options);
    ASSERT_EQ(whole.violations.size(), 1u);
    EXPECT_EQ(whole.violations[0].invariant, "crash");
    const failing_run small = shrunk({options, whole.violations[0]});
    EXPECT_EQ(text_of(small.options.faults), "kill");
    EXPECT_LE(small.options.cycles, 250u);
}

// As of a daemon that computes for ever without a call.
TEST(run, virtual_time_that_stands_still_is_a_crash) {
    run_options options = of_seed(7);
    options.prepare = [](run &world) {
        world.time.at(second, [] {
            for (volatile int forever = 1; forever == 1;) continue;
        });
    };
    const run_result stuck = run_isolated(options);
    ASSERT_EQ(stuck.violations.size(), 1u);
    EXPECT_EQ(stuck.violations[0].words, "virtual time stands still");
}

}  // namespace
}  // namespace compbox::world
