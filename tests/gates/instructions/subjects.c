/* SPDX-License-Identifier: MIT */
#include "tests/gates/instructions/subjects.h"

#include <stdint.h>

#include "models/bpnet.h"
#include "models/bspline.h"
#include "models/direction.h"
#include "models/lag.h"
#include "models/training_range.h"
#include "models/volumetric.h"
#include "tests/support/lag_step.h"
#include "tests/support/training_range_hold.h"

enum { INPUTS = SUBJECT_INPUTS, HIDDEN = SUBJECT_HIDDEN, OUTPUTS = SUBJECT_OUTPUTS };
enum { POINTS = 20, DEGREE = 3, SPANS = POINTS - DEGREE, NET_FLOATS = 800 };

static float w1[HIDDEN * INPUTS], b1[HIDDEN], w2[OUTPUTS * HIDDEN], b2[OUTPUTS];
static float linear[OUTPUTS * INPUTS], zeros[INPUTS], ones[INPUTS];
static float plain_weights[NET_FLOATS], linear_weights[NET_FLOATS];
static struct cb_bpnet plain, with_linear;
static struct cb_training_range ranges[INPUTS];
static float breaks[SPANS + 1], coefficients[SPANS * (DEGREE + 1)];
static struct cb_ppoly curve;
static struct cb_lag lags[SUBJECT_LAGS];
static struct cb_lag_gains gains;
static struct cb_volumetric volumetric;
static struct cb_volumetric_state state;
static struct cb_volumetric_state rate;
static struct cb_direction direction;
static float x[INPUTS], inside[INPUTS], y[OUTPUTS], hidden[HIDDEN], position;
static volatile float sink, step_s = 0.03f;

static uint32_t seed = 1;

/* out: -1 … 1 */
static float random_number(void) {
    seed = seed * 1664525u + 1013904223u;
    return ((float)(seed >> 8) - 8388608.0f) / 8388608.0f;
}

static void fill(float *numbers, unsigned count, float size) {
    for (unsigned i = 0; i < count; ++i) numbers[i] = size * random_number();
}

static bool make_networks(void) {
    fill(w1, HIDDEN * INPUTS, 1.0f);
    fill(b1, HIDDEN, 1.0f);
    fill(w2, OUTPUTS * HIDDEN, 1.0f);
    fill(b2, OUTPUTS, 1.0f);
    fill(linear, OUTPUTS * INPUTS, 1.0f);
    for (int j = 0; j < INPUTS; ++j) {
        ones[j] = 1.0f;
        ranges[j] = (struct cb_training_range){-0.9f, 0.9f, 0.05f, 20.0f};
    }
    struct cb_bpnet_source source = {w1,    b1,   w2,     b2,     0,       zeros,          ones,
                                     zeros, ones, INPUTS, HIDDEN, OUTPUTS, CB_BPNET_TANSIG};
    if (cb_bpnet_floats(INPUTS, HIDDEN, OUTPUTS, true) > NET_FLOATS) return false;
    if (!cb_bpnet_fold(&source, plain_weights, &plain)) return false;
    source.linear_weights = linear;
    return cb_bpnet_fold(&source, linear_weights, &with_linear);
}

/* Twenty control points on knots that are not uniform, so that the span is searched. */
static void make_curve(void) {
    float knots[POINTS + DEGREE + 1], points[POINTS];
    fill(points, POINTS, 100.0f);
    for (int i = 0; i < POINTS + DEGREE + 1; ++i) {
        const int k = i < DEGREE ? 0 : i > POINTS ? SPANS : i - DEGREE;
        knots[i] = (float)(k * k) * (1000.0f / (SPANS * SPANS));
    }
    const struct cb_bspline spline = {knots, points, POINTS, DEGREE};
    cb_bspline_to_ppoly(&spline, breaks, coefficients, &curve);
}

bool subjects_make(void) {
    make_curve();
    if (!make_networks()) return false;
    gains = cb_lag_gains_for(0.03f, 1800.0f);
    for (int i = 0; i < SUBJECT_LAGS; ++i) cb_lag_start(&lags[i], 20.0f);
    fill(&volumetric.lever_mm[0][0], 9, 1000.0f);
    fill(volumetric.squareness_urad, 3, 20.0f);
    volumetric.tool[2] = -1.0f;
    cb_direction_start(&direction, 0.0f, 0.5f);
    return cb_volumetric_chain("XYfZ", volumetric.moves);
}

void subjects_move(float place) {
    fill(x, INPUTS, 1.0f);
    position = 1000.0f * place;
    for (int a = 0; a < CB_AXES; ++a) state.position_mm[a] = position;
    state.tool_mm = 200.0f;
    for (int a = 0; a < CB_AXES; ++a) rate.position_mm[a] = 1.0f;
    fill(rate.error, CB_CURVE_ERRORS, 0.1f);
    fill(state.error, CB_CURVE_ERRORS, 50.0f);
}

__attribute__((noipa)) static float empty(const void *what, float argument) {
    (void)what;
    return argument;
}

void subject_nothing(void *unused) {
    (void)unused;
    sink = empty(&curve, position);
}

/* As anyone would write them, with sizes that the compiler knows. */
static void output_multiply_adds(void) {
    for (unsigned k = 0; k < OUTPUTS; ++k) {
        float sum = b2[k];
        for (unsigned i = 0; i < HIDDEN; ++i) sum += w2[k * HIDDEN + i] * hidden[i];
        y[k] = sum;
    }
}

void subject_multiply_adds(void *unused) {
    (void)unused;
    for (unsigned i = 0; i < HIDDEN; ++i) {
        float sum = b1[i];
        for (unsigned j = 0; j < INPUTS; ++j) sum += w1[i * INPUTS + j] * x[j];
        hidden[i] = sum;
    }
    output_multiply_adds();
}

void subject_network(void *unused) {
    (void)unused;
    cb_bpnet_evaluate(&plain, x, y);
}

void subject_network_with_linear_path(void *unused) {
    (void)unused;
    cb_bpnet_evaluate(&with_linear, x, y);
}

void subject_network_slope(void *unused) {
    (void)unused;
    cb_bpnet_slope(&plain, x, 0, y);
}

void subject_training_range(void *unused) {
    (void)unused;
    sink = hold_in_training_ranges(ranges, INPUTS, x, inside).weight;
}

void subject_spline(void *unused) {
    (void)unused;
    sink = cb_ppoly_evaluate(&curve, position).slope;
}

void subject_lag(void *unused) {
    (void)unused;
    sink = lag_step(&lags[0], gains, position);
}

void subject_lag_gains(void *unused) {
    (void)unused;
    gains = cb_lag_gains_for(step_s, 1800.0f);
}

void subject_volumetric(void *unused) {
    (void)unused;
    cb_volumetric_evaluate(&volumetric, &state, y);
}

void subject_volumetric_derivative(void *unused) {
    (void)unused;
    cb_volumetric_derivative(&volumetric, &state, &rate, y);
}

void subject_direction(void *unused) {
    (void)unused;
    const struct cb_curve_value branch = {1.0f, 2.0f, false};
    cb_direction_step(&direction, position, 0.5f);
    sink = cb_direction_blend(&direction, 0.5f, branch, branch).value;
}

void subject_reference_load(void *unused) {
    for (int k = 0; k < CB_CURVE_ERRORS; ++k)
        state.error[k] = cb_ppoly_evaluate(&curve, state.position_mm[k / CB_AXIS_ERRORS]).value;
    subject_volumetric(unused);
    for (int i = 0; i < SUBJECT_LAGS; ++i) sink = lag_step(&lags[i], gains, position);
    subject_training_range(unused);
    cb_bpnet_evaluate(&plain, inside, y);
}

void subject_two_splines(void *unused) {
    subject_spline(unused);
    subject_spline(unused);
}

void subject_network_in_double(void *unused) {
    (void)unused;
    for (unsigned i = 0; i < HIDDEN; ++i) {
        double sum = (double)b1[i];
        for (unsigned j = 0; j < INPUTS; ++j) sum += (double)w1[i * INPUTS + j] * (double)x[j];
        hidden[i] = (float)sum;
    }
    output_multiply_adds();
}
