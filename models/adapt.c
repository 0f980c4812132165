/* SPDX-License-Identifier: MIT
 *
 * Proof of (1), |y - m| <= B with B = bias_max + gain_max |m|, in real numbers.
 *
 *   Let e = 2^-24, the relative error of one rounding. limit() computes c = B (1 + d) with |d| <=
 *   2e + e², subtracts r = 2^-21 (|m| + c) + FLT_MIN, and returns at least 0. Its own roundings are
 *   below 2^-22 (|m| + c), and those of subnormal numbers below FLT_MIN. So limit <= B - 2^-22 (|m|
 *   + B), or it is 0. y is clamped into [fl(m - limit), fl(m + limit)]; these sums have errors of
 *   at most e (|m| + limit) <= 2^-24 (|m| + B). So |y - m| <= B. A limit of 0 gives fl(m) = m
 *   exactly. cb_clamp() gives the lower end for NaN, so b and g do not matter: not their size, nor
 *   whether they are numbers.
 *
 * Proof of (2). take() first forces the new b and g into the box |b| <= bias_max, |g| <= gain_max,
 * and then moves by the fraction s from the old pair towards this one. The movement of y is linear
 * in s, so s = step_max / |movement| limits it. The box is convex and contains both ends, so the
 * pair stays in it, and the clamps behind the fraction remove rounding alone.
 *
 * Proof of (3). b and g leave this file only through clamps, which give an end for NaN too. With S
 * = r + d_b + d_g f², f = u + m, and r > 0, Bierman's update multiplies d_b by r / (r + d_b) and
 * d_g by (r + d_b) / S: both factors are in (0, 1], because each sum has no negative summand and
 * rounding keeps the order. Growth adds summands that are not negative. Floor and ceiling of
 * bounded_variance() keep d from underflow and overflow, and each replaces NaN by the floor. u is
 * bounded by MOST_U. All products stay below 1e34: the largest is d_g f² <= 1e6 (1e7)².
 *
 * A probe that moves y by less than its gain K, because of the step's limit, tells the filter less.
 * With the gain s K the covariance becomes P - s (2 - s) K S K', the same as after a probe whose
 * noise is larger: r' = r + S (1 / (s (2 - s)) - 1). So P does not promise more than b and g hold.
 *
 * The model's own sigma (models/sigma.h). P describes what b and g have to explain since the last
 * probe at the place z': b's drift stands for e0 there. At another place the error of the model
 * differs by e(x) - e(x'), which b has to explain too, and which has the variance (2) of that file,
 * independent of P to first order: the probe at z' has measured e0 + a z', not its parts. So b's
 * variance at a probe is bias_d + (2). A model of which nothing was measured has e(x) itself to be
 * explained: bias_d is (1) if it was less, because both are of the same error.
 * Both go into P and not beside the noise r: the larger they are, the larger S, and the more of the
 * innovation b takes. A probe that is not taken leaves P as it was. */
#include "models/adapt.h"

#include "models/num.h"

static const float LEAST_VARIANCE = 1e-12f;
static const float MOST_BIAS_VARIANCE = 1e8f; /* µm² */
static const float MOST_GAIN_VARIANCE = 1e6f;
static const float MOST_U = 9e6f;       /* µm */
static const float MOST_HOURS = 1e4f;   /* in one wait */
static const float EARLY = 0.99999f;    /* hours are rounded: a minute may be 59.9999 s */
static const float GATE_SQUARED = 9.0f; /* three standard deviations */

static float bounded_variance(float variance, float most) {
    return cb_clamp(variance, LEAST_VARIANCE, most);
}

/* The covariance of an innovation at the model value m, by parts. */
struct outlook {
    float f; /* u + m */
    float v; /* gain_d f */
    float s; /* S without the probe's noise: the variance of y */
};

static struct outlook look(const struct cb_adapt *state, float m) {
    struct outlook at;
    at.f = state->u + m;
    at.v = state->gain_d * at.f;
    at.s = state->bias_d + at.v * at.f;
    return at;
}

/* out: the variance of b by bias_d at the place `own`: see the proof. own: NULL, or of any model */
static float widened(const struct cb_adapt *state, const struct cb_sigma *own) {
    if (!own || own->model == 0) return state->bias_d;
    if (own->model != state->model)
        return cb_max(state->bias_d, bounded_variance(cb_sigma_variance(own), MOST_BIAS_VARIANCE));
    return bounded_variance(state->bias_d + cb_sigma_change(own, state->place), MOST_BIAS_VARIANCE);
}

void cb_adapt_start(struct cb_adapt *state) {
    *state = (struct cb_adapt){.bias_d = 1.0f, .gain_d = 0.25f, .since_h = FLT_MAX};
}

/* out: true if every field is in the range that the functions of this file leave */
static bool is_valid(const struct cb_adapt *state) {
    const bool variances = state->bias_d >= LEAST_VARIANCE && state->bias_d <= MOST_BIAS_VARIANCE &&
                           state->gain_d >= LEAST_VARIANCE && state->gain_d <= MOST_GAIN_VARIANCE &&
                           cb_abs(state->u) <= MOST_U;
    const bool times = state->since_h >= 0.0f && state->pending_h >= 0.0f;
    const bool values = cb_is_finite(state->bias_um) && cb_is_finite(state->gain) &&
                        cb_is_finite(state->pending_um[0]) && cb_is_finite(state->pending_um[1]) &&
                        cb_is_finite(state->innovation_um) && state->expected_um >= 0.0f;
    const bool sums = state->above >= 0.0f && state->above <= FLT_MAX && state->below >= 0.0f &&
                      state->below <= FLT_MAX;
    bool places = true;
    for (unsigned d = 0; d < CB_SIGMA_DIRECTIONS; ++d)
        places = places && cb_abs(state->place[d]) <= CB_SIGMA_MOST_PLACE;
    return variances && times && values && sums && places && state->pending <= 2 &&
           state->asked <= 1;
}

void cb_adapt_resume(const struct cb_adapt_settings *settings, struct cb_adapt *state) {
    if (!is_valid(state)) {
        cb_adapt_start(state);
        return;
    }
    state->bias_um = cb_clamp(state->bias_um, -settings->bias_max_um, settings->bias_max_um);
    state->gain = cb_clamp(state->gain, -settings->gain_max, settings->gain_max);
}

/* P += diag(q_bias, q_gain), kept as U D U': u gain_d, the covariance of b and g, does not change.
 * in : both >= 0, finite */
static void grow(struct cb_adapt *state, float q_bias, float q_gain) {
    const float gain_d = bounded_variance(state->gain_d + q_gain, MOST_GAIN_VARIANCE);
    const float kept = cb_min(state->gain_d / gain_d, 1.0f);
    const float freed = state->u * state->u * state->gain_d * (1.0f - kept);
    state->bias_d = bounded_variance(state->bias_d + q_bias + freed, MOST_BIAS_VARIANCE);
    state->gain_d = gain_d;
    state->u *= kept;
}

void cb_adapt_wait(const struct cb_adapt_settings *settings, struct cb_adapt *state, float hours) {
    if (!(hours > 0.0f)) return;
    const float h = cb_min(hours, MOST_HOURS);
    const float drift = settings->drift_um_per_sqrt_h, gain_drift = settings->gain_drift_per_sqrt_h;
    grow(state, drift * drift * h, gain_drift * gain_drift * h);
    if (state->since_h < FLT_MAX) state->since_h += h;
    state->pending_h += h;
}

/* Bierman's update of U D U' by a probe with the variance r. in: r > 0; at, of this state */
static void narrow(struct cb_adapt *state, const struct outlook *at, float r) {
    const float first = r + state->bias_d;
    const float all = first + at->v * at->f;
    state->u = cb_clamp(state->u - at->f * (state->bias_d / first), -MOST_U, MOST_U);
    state->bias_d = bounded_variance(state->bias_d * (r / first), MOST_BIAS_VARIANCE);
    state->gain_d = bounded_variance(state->gain_d * (first / all), MOST_GAIN_VARIANCE);
}

/* Adds a taken innovation to the sums. They end at twice the alarm, so that it ends too. */
static void sum_up(struct cb_adapt *state, float innovation_um) {
    const float most = 2.0f * CB_ADAPT_DRIFTED, slack = 0.5f;
    const float x = cb_clamp(innovation_um / state->expected_um, -3.0f, 3.0f);
    state->above = cb_clamp(state->above + x - slack, 0.0f, most);
    state->below = cb_clamp(state->below - x - slack, 0.0f, most);
}

/* One Kalman step, limited.
 * in : innovation_um, finite; m, finite
 * out: b, g, P; the movement of b + (1 + g) m, at most step_max_um */
static float take(const struct cb_adapt_settings *settings, struct cb_adapt *state,
                  float innovation_um, float m) {
    sum_up(state, innovation_um);
    const struct outlook at = look(state, m);
    const float noise = settings->sigma_um * settings->sigma_um;
    const float share = innovation_um / (noise + at.s);
    const float bias_max = settings->bias_max_um, gain_max = settings->gain_max;
    const float bias = state->bias_um + (state->bias_d + at.v * state->u) * share;
    const float gain = state->gain + at.v * share;
    const float bias_by = cb_clamp(bias, -bias_max, bias_max) - state->bias_um;
    const float gain_by = cb_clamp(gain, -gain_max, gain_max) - state->gain;
    const float way = bias_by + gain_by * m, size = cb_abs(way);
    const float part = size > settings->step_max_um ? settings->step_max_um / size : 1.0f;
    const float weight = part * (2.0f - part);
    state->bias_um = cb_clamp(state->bias_um + part * bias_by, -bias_max, bias_max);
    state->gain = cb_clamp(state->gain + part * gain_by, -gain_max, gain_max);
    narrow(state, &at, weight < 1.0f ? noise + (noise + at.s) * (1.0f / weight - 1.0f) : noise);
    state->since_h = 0.0f;
    return part * way;
}

static bool is_inside(const struct cb_adapt_settings *settings, const struct cb_adapt *state,
                      float innovation_um, float m) {
    const float s = settings->sigma_um * settings->sigma_um + look(state, m).s;
    return innovation_um * innovation_um <= GATE_SQUARED * s;
}

/* out: true if the innovation agrees with the newest pending one */
static bool agrees(const struct cb_adapt_settings *settings, const struct cb_adapt *state,
                   float innovation_um, float m) {
    const float drift = settings->drift_um_per_sqrt_h, gain_drift = settings->gain_drift_per_sqrt_h;
    const float noise = 2.0f * settings->sigma_um * settings->sigma_um;
    const float variance = noise + (drift * drift + gain_drift * gain_drift * m * m) *
                                       cb_min(state->pending_h, MOST_HOURS);
    const float off = innovation_um - state->pending_um[state->pending - 1];
    return off * off <= GATE_SQUARED * variance;
}

/* out: true if the error can be explained inside of the bounds, but for the probe's noise */
static bool is_reachable(const struct cb_adapt_settings *settings, const struct cb_adapt *state,
                         float innovation_um, float m) {
    const float error_um = innovation_um + (state->bias_um + state->gain * m);
    return cb_abs(error_um) <=
           settings->bias_max_um + settings->gain_max * cb_abs(m) + 3.0f * settings->sigma_um;
}

static float median(float a, float b, float c) {
    return cb_max(cb_min(a, b), cb_min(cb_max(a, b), c));
}

/* Takes an innovation that was outside of the gate. If the step's limit leaves it outside, the rest
 * stays pending: the next probe that agrees with it is taken at once. */
static void take_outside(const struct cb_adapt_settings *settings, struct cb_adapt *state,
                         float innovation_um, float m) {
    const float rest_um = innovation_um - take(settings, state, innovation_um, m);
    state->asked = 0;
    state->pending = !is_inside(settings, state, rest_um, m);
    state->pending_um[0] = rest_um;
    state->pending_h = 0.0f;
}

static enum cb_adapt_outcome judge_outside(const struct cb_adapt_settings *settings,
                                           struct cb_adapt *state, float innovation_um, float m) {
    if (state->pending > 0 && agrees(settings, state, innovation_um, m) &&
        is_reachable(settings, state, innovation_um, m)) {
        take_outside(settings, state, innovation_um, m);
        return CB_ADAPT_CONFIRMED;
    }
    if (state->pending == 2) {
        const float middle_um = median(state->pending_um[0], state->pending_um[1], innovation_um);
        take_outside(settings, state, middle_um, m);
        return CB_ADAPT_MEDIAN;
    }
    state->pending_um[state->pending++] = innovation_um;
    state->pending_h = 0.0f;
    state->asked = 1;
    return CB_ADAPT_ASK;
}

static bool is_plausible(float um) {
    return cb_abs(um) <= CB_ADAPT_MOST_UM;
}

/* One probe that is neither implausible nor early. */
static enum cb_adapt_outcome judge(const struct cb_adapt_settings *settings, struct cb_adapt *state,
                                   float probed_um, float m) {
    const float innovation_um = probed_um - (state->bias_um + (1.0f + state->gain) * m);
    state->innovation_um = innovation_um;
    state->expected_um = cb_root(settings->sigma_um * settings->sigma_um + look(state, m).s);
    if (!is_inside(settings, state, innovation_um, m))
        return judge_outside(settings, state, innovation_um, m);
    take(settings, state, innovation_um, m);
    state->pending = 0;
    state->asked = 0;
    return CB_ADAPT_TAKEN;
}

/* The last probe that was taken was at the place `own`. */
static void remember(struct cb_adapt *state, const struct cb_sigma *own) {
    if (!own || own->model == 0) return;
    state->model = own->model;
    for (unsigned d = 0; d < CB_SIGMA_DIRECTIONS; ++d)
        state->place[d] = cb_clamp(own->place[d], -CB_SIGMA_MOST_PLACE, CB_SIGMA_MOST_PLACE);
}

enum cb_adapt_outcome cb_adapt_probe(const struct cb_adapt_settings *settings,
                                     struct cb_adapt *state, float probed_um, float model_um,
                                     const struct cb_sigma *own) {
    if (!is_plausible(probed_um) || !is_plausible(model_um)) return CB_ADAPT_IMPLAUSIBLE;
    const bool early = state->since_h * 3600.0f < settings->min_interval_s * EARLY;
    if (early && !state->asked) return CB_ADAPT_EARLY;
    const float narrow_d = state->bias_d;
    state->bias_d = widened(state, own);
    const enum cb_adapt_outcome outcome = judge(settings, state, probed_um, model_um);
    if (cb_adapt_was_taken(outcome))
        remember(state, own);
    else
        state->bias_d = narrow_d;
    return outcome;
}

/* out: a little less than bias_max + gain_max |m|, at least 0 (see the proof of (1)) */
static float limit(const struct cb_adapt_settings *settings, float m) {
    const float bound = settings->bias_max_um + settings->gain_max * cb_abs(m);
    return cb_max(bound - (cb_abs(m) + bound) * 0x1p-21f - FLT_MIN, 0.0f);
}

float cb_adapt_value(const struct cb_adapt_settings *settings, float bias_um, float gain,
                     float model_um) {
    const float most = limit(settings, model_um);
    return cb_clamp(model_um + (bias_um + gain * model_um), model_um - most, model_um + most);
}

float cb_adapt_sigma(const struct cb_adapt *state, float model_um, const struct cb_sigma *own) {
    struct cb_adapt here = *state;
    here.bias_d = widened(state, own);
    return cb_root(look(&here, model_um).s);
}
