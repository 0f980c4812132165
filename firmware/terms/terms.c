/* SPDX-License-Identifier: MIT */
#include "firmware/terms/terms.h"

#include <string.h>

#include "firmware/terms/kind.h"
#include "firmware/terms/kinds.h"
#include "models/num.h"
#include "models/ppoly.h"

/* Inputs and results of one evaluation of all terms. */
struct step {
    struct cb_evaluation e;
    struct cb_term_state *states;
    struct cb_counters *counters;
    struct cb_terms_verdict verdict;
    float *outputs;
};

/* ---- any term ---- */

static inline bool all_finite(const float *value, unsigned count) {
    float nothing = value[0] - value[0]; /* NaN if a value is not finite */
    for (unsigned i = 1; i < count; ++i) nothing += value[i] - value[i];
    return nothing == 0.0f;
}

static void note(struct step *step, uint8_t remarks) {
    struct cb_terms_verdict *verdict = &step->verdict;
    step->counters->outside_curve += (remarks & CB_TERM_OUTSIDE) != 0;
    step->counters->models_extrapolated += (remarks & CB_TERM_EXTRAPOLATED) != 0;
    step->counters->models_weakened += (remarks & CB_TERM_WEAKENED) != 0;
    verdict->extrapolated = verdict->extrapolated || (remarks & CB_TERM_EXTRAPOLATED);
    verdict->degraded = verdict->degraded || (remarks & CB_TERM_WEAKENED);
}

/* out: value[term->outputs], all finite; or false: they could not be computed */
static bool compute(struct step *step, const struct cb_term_config *term,
                    struct cb_term_state *state, float *value) {
    const uint8_t remarks = cb_term_kinds[term->type]->value(&step->e, term, state, value);
    if (remarks != 0) note(step, remarks);
    if (remarks & CB_TERM_MISSING) return false;
    if (all_finite(value, term->outputs)) return true;
    ++step->counters->terms_not_finite;
    return false;
}

static void fade(float *output, unsigned count, float fade_um) {
    for (unsigned i = 0; i < count; ++i) output[i] -= cb_clamp(output[i], -fade_um, fade_um);
}

/* Sets the term's outputs of this step: computed, or faded from the last ones towards zero. */
CB_OUTLINE void evaluate(struct step *step, const struct cb_term_config *term, unsigned index) {
    struct cb_term_state *state = &step->states[index];
    float value[CB_MAX_TERM_OUTPUTS], *const output = step->outputs + term->first_output;
    if (compute(step, term, state, value)) {
        memcpy(output, value, term->outputs * sizeof *output);
        state->live = true;
        return;
    }
    fade(output, term->outputs, step->e.fade_um);
    if (cb_term_kinds[term->type]->hold) cb_term_kinds[term->type]->hold(&step->e, term, output);
    step->counters->terms_faded += state->live;
    state->live = false;
    step->e.all_live = false;
    step->verdict.degraded = true;
}

/* ---- plain curves ---- */

/* As follow(), for any distance. */
CB_COLD CB_OUTLINE bool search(const struct cb_config *config, const struct cb_grid *grid, float x,
                               uint16_t *span) {
    const struct cb_ppoly ppoly = {.breaks = config->pool + grid->breaks,
                                   .spans_per_unit = grid->spans_per_unit,
                                   .spans = grid->spans,
                                   .degree = grid->degree};
    return cb_ppoly_follow(&ppoly, x, span);
}

/* in : *span, which held the last x but not this one; usually its neighbour does
 * out: true: *span holds x; false: x is at an end of the grid, outside of it, or NaN */
CB_INLINE bool follow(const struct cb_config *config, const struct cb_grid *grid, float x,
                      uint16_t *span) {
    const unsigned was = *span;
    const float *const at = config->pool + grid->breaks + was;
    const bool up = x >= at[1]; /* else it is below at[0], or NaN */
    if (up ? was + 1u < grid->spans && x < at[2] : was > 0 && x >= at[-1]) {
        *span = (uint16_t)(up ? was + 1u : was - 1u);
        return true;
    }
    return search(config, grid, x, span);
}

/* Evaluates curves of a grid one by one. Their configuration is rebuilt from the grid, because each
 * step checks the grid (box/check.c), but not the configuration of plain curves without slopes. */
CB_COLD CB_OUTLINE void evaluate_each(struct step *step, const struct cb_grid *grid,
                                      const struct cb_plain_curve *curve,
                                      const struct cb_plain_curve *end) {
    struct cb_term_config term = {.type = CB_TERM_BSPLINE, .outputs = 1};
    term.as.curve = (struct cb_curve_config){.signal = grid->signal,
                                             .degree = grid->degree,
                                             .spans = grid->spans,
                                             .spans_per_unit = grid->spans_per_unit};
    for (; curve != end; ++curve) {
        term.first_output = curve->output;
        term.as.curve.pool = (uint16_t)(curve->coefficients - grid->spans - 1u);
        evaluate(step, &term, curve->term);
    }
}

/* Evaluates the curves of one grid. Usually x is still in the span of the last step.
 * in : same, a private copy of *step; because its address never escapes, the compiler can keep its
 *      fields in registers */
CB_INLINE void evaluate_grid(struct step *step, const struct step *same, const struct cb_grid *grid,
                             const struct cb_plain_curve *curve, const struct cb_plain_curve *end) {
    const struct cb_config *const config = same->e.config;
    struct cb_term_state *const states = same->states;
    const float *const breaks = config->pool + grid->breaks;
    const struct cb_signal_state *const signal = &same->e.signals[grid->signal];
    const float x = signal->used;
    uint32_t span = states[grid->term].span; /* 0 at first, then as of follow() */
    const bool holds = x >= breaks[span] && x < breaks[span + 1];
    if (!signal->fresh || (!holds && !follow(config, grid, x, &states[grid->term].span))) {
        evaluate_each(step, grid, curve, end);
        return;
    }
    span = states[grid->term].span;
    const unsigned degree = grid->degree;
    const float u = x - breaks[span], *const row = config->pool + span * (degree + 1u);
    do {
        const float value = cb_ppoly_horner(row + curve->coefficients, (uint8_t)degree, u);
        if (!cb_is_finite(value)) {
            evaluate_each(step, grid, curve, curve + 1);
            continue;
        }
        same->outputs[curve->output] = value;
        states[curve->term].live = true;
    } while (++curve < end);
}

/* ---- all terms ---- */

struct cb_terms_verdict cb_terms_evaluate(const struct cb_config *config,
                                          const struct cb_signal_state *signals,
                                          const struct cb_bank_state *bank,
                                          struct cb_term_state *states,
                                          struct cb_counters *counters, float fade_um,
                                          float *outputs) {
    struct step step = {{config, signals, bank, states, outputs, true, fade_um},
                        states,
                        counters,
                        {false, false},
                        outputs};
    const struct step same = step;
    const struct cb_plain_curve *curve = config->plain_curves;
    const struct cb_grid *const end = config->grids + config->grids_count;
    for (const struct cb_grid *grid = config->grids; grid != end; ++grid) {
        const struct cb_plain_curve *const next = curve + grid->curves;
        evaluate_grid(&step, &same, grid, curve, next);
        curve = next;
    }
    for (unsigned i = 0; i < config->other_terms_count; ++i)
        evaluate(&step, &config->terms[config->other_terms[i]], config->other_terms[i]);
    return step.verdict;
}

void cb_terms_slopes(const struct cb_config *config, const struct cb_signal_state *signals,
                     const struct cb_term_state *states, const float *outputs, uint8_t signal,
                     float *slopes) {
    const struct cb_slope_pass pass = {
        {config, signals, NULL, states, outputs, true, 0.0f}, signal, slopes};
    for (unsigned i = 0; i < config->terms_count; ++i) {
        const struct cb_term_config *term = &config->terms[i];
        float slope[CB_MAX_TERM_OUTPUTS] = {0.0f};
        if (states[i].live) cb_term_kinds[term->type]->slope(&pass, term, slope);
        for (unsigned k = 0; k < term->outputs; ++k)
            slopes[term->first_output + k] = cb_is_finite(slope[k]) ? slope[k] : 0.0f;
    }
}
