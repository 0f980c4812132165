/* SPDX-License-Identifier: MIT
 * Gate: instructions on a Cortex-M4F, the largest count seen over 64 inputs, against their limits,
 * and steps of a machine that is well; the dearest steps are those of tests/gates/worst.
 * It is no bound for all inputs, and instructions are not cycles (docs/results/speed.md). The last
 * rows are planted faults, which have to be over theirs. Exit 1 otherwise. */
#include <stdio.h>

#include "tests/gates/instructions/counter.h"
#include "tests/gates/instructions/step.h"
#include "tests/gates/instructions/subjects.h"

static uint32_t most(void (*subject)(void *unused)) {
    uint32_t count = 0;
    for (int i = 0; i < 64; ++i) {
        subjects_move((float)i / 63.0f);
        const uint32_t one = counter_of(subject, 0);
        if (one > count) count = one;
    }
    return count;
}

/* The function itself, from its first instruction to its return. */
static uint32_t used_by(void (*subject)(void *unused)) {
    return most(subject) - most(subject_nothing) + 1;
}

/* Prints used / limit; returns whether that is as it should be. */
static bool row(const char *name, uint32_t used, uint32_t limit, bool planted) {
    const bool over = used > limit, good = over == planted;
    printf("%-44s %6u / %6u%s\n", name, (unsigned)used, (unsigned)limit,
           planted ? (good ? "  caught, as it must be" : "  NOT CAUGHT") : (good ? "" : "  OVER"));
    return good;
}

int main(void) {
    if (!counter_start()) {
        puts("this counts no instructions: start it with qemu-system-arm -icount");
        return 1;
    }
    if (!subjects_make() || !step_load(STEP_SHARED_BREAKS)) {
        puts("a subject cannot be made");
        return 1;
    }
    const uint32_t plain = used_by(subject_multiply_adds), network = plain * 5 / 4;
    bool good = row("19-20-3, multiply-adds alone (the yardstick)", plain, plain, false);
    good &= row("19-20-3, network", used_by(subject_network), network, false);
    good &= row("19-20-3, network and linear path", used_by(subject_network_with_linear_path),
                network + 450, false);
    good &=
        row("19-20-3, slope by one input", used_by(subject_network_slope), network + 450, false);
    good &= row("guard of 19 inputs", used_by(subject_training_range), 600, false);
    good &= row("spline, 20 control points, value and slope", used_by(subject_spline), 150, false);
    good &= row("lag, one step", used_by(subject_lag), 50, false);
    good &= row("lag, its gains for a new step length", used_by(subject_lag_gains), 40, false);
    good &= row("volumetric, 21 errors to the tip", used_by(subject_volumetric), 300, false);
    good &= row("volumetric, derivative of a motion", used_by(subject_volumetric_derivative), 520,
                false);
    good &= row("direction and blend", used_by(subject_direction), 100, false);
    good &= row("18 splines, volumetric, network, 24 lags", used_by(subject_reference_load), 10000,
                false);
    good &= row("cb_box_step, reference load, at rest", step_most(STEP_REST, 200), 11500, false);
    good &=
        row("cb_box_step, reference load, travelling", step_most(STEP_TRAVEL, 500), 11500, false);
    if (!step_was_active()) {
        puts("the steps were not those of a box that compensates");
        good = false;
    }
    good &= step_load(STEP_OWN_BREAKS);
    good &= row("cb_box_step, every curve on breaks of its own", step_most(STEP_TRAVEL, 500), 12000,
                false);
    good &= step_load(STEP_BANK);
    good &= row("cb_box_step, and a bank of 256 lags", step_most(STEP_TRAVEL, 500), 40000, false);
    good &= step_load(STEP_SIGMA);
    good &= row("cb_box_step, and the bank's sigma", step_most(STEP_TRAVEL, 500), 40000, false);
    good &= row("planted: two splines for one", used_by(subject_two_splines), 150, true);
    good &=
        row("planted: hidden layer in double", used_by(subject_network_in_double), network, true);
    return good ? 0 : 1;
}
