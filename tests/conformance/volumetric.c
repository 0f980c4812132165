/* SPDX-License-Identifier: MIT
 * The volumetric model against the full matrices of tests/oracle/volumetric.py. */
#include "models/volumetric.h"

#include "tests/conformance/check.h"

struct volumetric_row {
    struct cb_volumetric_state state;
    int axis; /* of the slope */
    float slope[CB_AXIS_ERRORS];
    double e_um[3], e_bound[3];
    double d_um_per_mm[3], d_bound[3];
};

/* Everything moves at once; one for each case. */
struct volumetric_motion {
    struct cb_volumetric_state state, rate;
    double d_um[3], bound;
};

enum { ALL, ALL_AGAIN, FEW, STRAIGHTNESS, ROWS };

struct volumetric_case {
    const char *chain;
    struct cb_volumetric model; /* moves still empty */
    const struct volumetric_row *rows;
};

#include "tests/conformance/vectors/volumetric.inc"

/* in : slope of the six curves of one axis
 * out: the motion of that axis by 1 mm */
static struct cb_volumetric_state motion_of(int axis, const float slope[CB_AXIS_ERRORS]) {
    struct cb_volumetric_state rate = {.tool_mm = 0.0f};
    rate.position_mm[axis] = 1.0f;
    for (int k = 0; k < CB_AXIS_ERRORS; ++k) rate.error[axis * CB_AXIS_ERRORS + k] = slope[k];
    return rate;
}

static void check_row(struct check *check, const struct cb_volumetric *model,
                      const struct volumetric_row *row) {
    static const char *const names[3] = {"E_x", "E_y", "E_z"};
    static const char *const slopes[3] = {"dE_x", "dE_y", "dE_z"};
    float e[3], d[3];
    cb_volumetric_evaluate(model, &row->state, e);
    const struct cb_volumetric_state rate = motion_of(row->axis, row->slope);
    cb_volumetric_derivative(model, &row->state, &rate, d);
    for (int c = 0; c < 3; ++c) {
        check_number(check, names[c], e[c], row->e_um[c], row->e_bound[c]);
        check_number(check, slopes[c], d[c], row->d_um_per_mm[c], row->d_bound[c]);
    }
}

static void check_motion(struct check *check, const struct cb_volumetric *model,
                         const struct volumetric_motion *motion) {
    static const char *const names[3] = {"motion E_x", "motion E_y", "motion E_z"};
    float d[3];
    cb_volumetric_derivative(model, &motion->state, &motion->rate, d);
    for (int c = 0; c < 3; ++c) check_number(check, names[c], d[c], motion->d_um[c], motion->bound);
}

void run_volumetric(struct check *check) {
    for (unsigned i = 0; i < LENGTH(volumetric_cases); ++i) {
        struct cb_volumetric model = volumetric_cases[i].model;
        check->subject = volumetric_cases[i].chain;
        check_equal(check, "chain", cb_volumetric_chain(volumetric_cases[i].chain, model.moves),
                    true);
        for (unsigned row = 0; row < ROWS; ++row) {
            struct cb_volumetric used = model;
            for (int k = 0; row == STRAIGHTNESS && k < 3; ++k) used.squareness_urad[k] = 0.0f;
            check->row = row;
            check_row(check, &used, &volumetric_cases[i].rows[row]);
        }
        check_motion(check, &model, &volumetric_motions[i]);
    }
}
