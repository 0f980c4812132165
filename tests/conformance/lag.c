/* SPDX-License-Identifier: MIT
 * The first-order lag against tests/oracle/lag.py. */
#include "models/lag.h"

#include <stddef.h>

#include "models/num.h"
#include "tests/conformance/check.h"
#include "tests/support/lag_step.h"

struct gain_row {
    float dt_s, tau_s;
    double gain, gain_bound, ramp, ramp_bound;
};

struct walk_row {
    float dt_s, u;
    double y, bound;
};

struct walk {
    float tau_s;
    const struct walk_row *rows;
    size_t count;
};

struct course {
    float tau_s, dt_s;
    struct {
        uint32_t steps;
        float u; /* the input goes straight to it */
        double y, bound;
    } pieces[4];
};

#include "tests/conformance/vectors/lag.inc"

static void run_walk(struct check *check, const struct walk *walk) {
    struct cb_lag lag;
    check->subject = "walk";
    cb_lag_start(&lag, 20.0f);
    for (size_t i = 0; i < walk->count; ++i) {
        const struct walk_row *row = &walk->rows[i];
        const struct cb_lag_gains gains = cb_lag_gains_for(row->dt_s, walk->tau_s);
        check->row = (uint32_t)i;
        check_number(check, "output", lag_step(&lag, gains, row->u), row->y, row->bound);
        check_hash(check, cb_bits_of(lag.lo));
    }
}

static void run_course(struct check *check, const struct course *course) {
    const struct cb_lag_gains gains = cb_lag_gains_for(course->dt_s, course->tau_s);
    struct cb_lag lag;
    float from = 20.0f;
    check->subject = "course";
    cb_lag_start(&lag, from);
    for (unsigned k = 0; k < LENGTH(course->pieces); ++k) {
        const float to = course->pieces[k].u, steps = (float)course->pieces[k].steps;
        for (uint32_t i = 1; i <= course->pieces[k].steps; ++i)
            lag_step(&lag, gains, from + (to - from) * ((float)i / steps));
        check->row = k;
        check_number(check, "output", lag.hi, course->pieces[k].y, course->pieces[k].bound);
        check_hash(check, cb_bits_of(lag.lo));
        from = to;
    }
}

void run_lag(struct check *check) {
    check->subject = "gains";
    for (size_t i = 0; i < LENGTH(gain_rows); ++i) {
        const struct gain_row *row = &gain_rows[i];
        const struct cb_lag_gains gains = cb_lag_gains_for(row->dt_s, row->tau_s);
        check->row = (uint32_t)i;
        check_number(check, "gain", gains.gain, row->gain, row->gain_bound);
        check_number(check, "ramp", gains.ramp, row->ramp, row->ramp_bound);
    }
    for (size_t i = 0; i < LENGTH(walks); ++i) run_walk(check, &walks[i]);
    for (size_t i = 0; i < LENGTH(courses); ++i) run_course(check, &courses[i]);
}
