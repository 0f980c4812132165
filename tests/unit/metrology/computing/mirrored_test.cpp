// SPDX-License-Identifier: MIT
// How often random machines without a wrong sign raise an alarm, and how often a wrong sign is
// found.
#include "host-tools/metrology/mirrored.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "host-tools/twin/random.h"

namespace {

using namespace compbox;
using namespace compbox::metrology;
using curve = std::vector<double>;

constexpr int machines = 2000;
constexpr double noise_um = 0.3;

// Cosines with random phases and amplitudes that fall with their number.
curve smooth(twin::random_stream &dice, const curve &x) {
    curve y(x.size(), 0.0);
    for (int k = 1; k < 6; ++k) {
        const double size = dice.normal() / std::pow(k, 1.5), phase = 6.2832 * dice.uniform();
        for (std::size_t i = 0; i < x.size(); ++i) {
            y[i] += size * std::cos(3.1416 * k * x[i] / x.back() + phase);
        }
    }
    return y;
}

void add(curve &y, const curve &other, double factor) {
    for (std::size_t i = 0; i < y.size(); ++i) y[i] += factor * other[i];
}

// What the runs of one machine have beside their noise.
enum class machine { noise, drift, walk, backlash, bent_backlash, small_error, unlike_runs, usual };

struct set_up {
    std::size_t runs, targets;
    bool both_ways;
};

constexpr set_up set_ups[] = {{3, 6, false}, {3, 11, false}, {5, 11, false},
                              {4, 6, true},  {6, 11, true},  {10, 21, true}};

curve targets_of(const set_up &with) {
    curve x;
    for (std::size_t i = 0; i < with.targets; ++i) x.push_back(100.0 * static_cast<double>(i));
    return x;
}

std::vector<directed_run> runs_of(machine kind, const set_up &with, const curve &x,
                                  twin::random_stream &dice) {
    const curve shape = smooth(dice, x), bend = smooth(dice, x);
    const double small = 0.05 + 0.45 * dice.uniform();
    std::vector<directed_run> runs;
    for (std::size_t r = 0; r < with.runs; ++r) {
        const int direction = with.both_ways && r % 2 ? -1 : 1;
        curve y(x.size());
        const double slope = dice.normal() / x.back();
        double walked = 0.0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            walked += dice.normal();
            y[i] = noise_um * dice.normal();
            if (kind == machine::drift) y[i] += 3.0 * slope * x[i];
            if (kind == machine::walk) y[i] += walked;
            if (kind == machine::backlash) y[i] += 5.0 * direction;
            if (kind == machine::usual) y[i] += slope * x[i];
        }
        if (kind == machine::bent_backlash) add(y, bend, 5.0 * direction);
        if (kind == machine::small_error) add(y, shape, small);
        if (kind == machine::unlike_runs) add(y, smooth(dice, x), 1.0);
        if (kind == machine::usual) add(y, shape, 5.0);
        runs.push_back({direction, y});
    }
    return runs;
}

TEST(mirrored, random_machines_raise_no_alarm) {
    for (int kind = 0; kind <= static_cast<int>(machine::usual); ++kind) {
        int alarms = 0;
        for (const set_up &with : set_ups) {
            twin::random_stream dice(11, "mirrored runs");
            const curve x = targets_of(with);
            for (int m = 0; m < machines; ++m) {
                const auto runs = runs_of(static_cast<machine>(kind), with, x, dice);
                alarms += !mirrored_runs(x, runs).empty();
            }
        }
        // One machine in a thousand at most.
        EXPECT_LE(alarms, machines * 6 / 1000) << "machine " << kind;
        std::printf("machine %d: %d alarms in %d\n", kind, alarms, machines * 6);
    }
}

TEST(mirrored, a_turned_run_of_a_random_machine_is_found_and_no_other) {
    for (const set_up &with : set_ups) {
        twin::random_stream dice(12, "turned run");
        const curve x = targets_of(with);
        int found = 0;
        for (int m = 0; m < machines; ++m) {
            auto runs = runs_of(machine::usual, with, x, dice);
            const std::size_t turned = dice.next() % with.runs;
            for (double &y : runs[turned].deviation) y = -y;
            const auto named = mirrored_runs(x, runs);
            found += named == std::vector<std::size_t>{turned};
            EXPECT_TRUE(named.empty() || named == std::vector<std::size_t>{turned}) << m;
        }
        EXPECT_GE(found, machines * 80 / 100) << with.runs << " runs";
        std::printf("%zu runs, %zu targets: %d of %d\n", with.runs, with.targets, found, machines);
    }
}

// Compensation that removes some of the error, none of it, or adds errors of its own.
TEST(doubled, random_machines_raise_no_alarm_and_doubled_errors_do) {
    twin::random_stream dice(13, "doubled error");
    int alarms = 0, found = 0;
    for (int m = 0; m < machines; ++m) {
        const curve x = targets_of({1, m % 2 ? 11u : 6u, false});
        const curve shape = smooth(dice, x), other = smooth(dice, x);
        const double left = 2.2 * dice.uniform() - 1.0;  // of the error: -1 to 1.2
        curve before(x.size()), after(x.size()), wrong(x.size());
        for (std::size_t i = 0; i < x.size(); ++i) {
            before[i] = 5.0 * shape[i] + noise_um * dice.normal();
            after[i] = 5.0 * left * shape[i] + other[i] + noise_um * dice.normal();
            wrong[i] = 10.0 * shape[i] + noise_um * dice.normal();
        }
        alarms += doubled_error(x, before, after, noise_um).has_value();
        found += doubled_error(x, before, wrong, noise_um).has_value();
    }
    EXPECT_LE(alarms, machines / 100);
    EXPECT_GE(found, machines * 90 / 100);
    std::printf("doubled: %d alarms, %d found of %d\n", alarms, found, machines);
}

TEST(doubled, noise_alone_is_not_named) {
    twin::random_stream dice(14, "noise alone");
    int alarms = 0;
    for (int m = 0; m < machines; ++m) {
        const curve x = targets_of({1, 6, false});
        curve before, after;
        for (std::size_t i = 0; i < x.size(); ++i) before.push_back(dice.normal());
        for (std::size_t i = 0; i < x.size(); ++i) after.push_back(2.0 * dice.normal());
        alarms += doubled_error(x, before, after, 1.0).has_value();
    }
    EXPECT_LE(alarms, machines / 1000);
    std::printf("noise: %d alarms in %d\n", alarms, machines);
}

}  // namespace
