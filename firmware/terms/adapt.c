/* SPDX-License-Identifier: MIT
 * Terms of type adapt: another term's output m, adapted by probes: y = b + (1 + g) m.
 *
 * A probe moves the targets of b and g (box/probes.c). b and g follow their targets together, so
 * that y moves at the ramp at most by them; m passes at once. cb_adapt_value() bounds |y - m|. */
#include "firmware/terms/kind.h"
#include "firmware/terms/kinds.h"
#include "firmware/terms/load.h"
#include "firmware/wire/number.h"
#include "models/num.h"

enum {
    OF = CB_TERM_COMMON_KEYS,
    PROBE,
    MEASURES,
    BIAS_MAX,
    GAIN_MAX,
    STEP_MAX,
    DRIFT,
    GAIN_DRIFT,
    SIGMA,
    MIN_INTERVAL,
    KEYS
};

static const struct cb_word MEASURES_WORDS[] = {{"residual", 0}, {"whole", CB_ADAPT_WHOLE}, {0, 0}};

#define AT(member) .offset = offsetof(struct cb_adapt_config, member)
static const struct cb_field FIELDS[KEYS] = {
    CB_TERM_COMMON_FIELDS,
    [OF] = {"of", CB_FIELD_STRING, true, CB_NOT_STORED},
    [PROBE] = {"probe", CB_FIELD_OBJECT, true, CB_NOT_STORED},
    [MEASURES] = {"measures", CB_FIELD_WORD, false, AT(measures), .words = MEASURES_WORDS,
                  .otherwise = "residual"},
    [BIAS_MAX] = {"bias_max_um", CB_FIELD_FLOAT, true, AT(settings.bias_max_um), .least = "0",
                  .most = "1000"},
    [GAIN_MAX] = {"gain_max", CB_FIELD_FLOAT, true, AT(settings.gain_max), .least = "0",
                  .most = "1"},
    [STEP_MAX] = {"step_max_um", CB_FIELD_FLOAT, true, AT(settings.step_max_um), .least = "0.001",
                  .most = "1000"},
    [DRIFT] = {"drift_um_per_sqrt_h", CB_FIELD_FLOAT, true, AT(settings.drift_um_per_sqrt_h),
               .least = "0", .most = "1000"},
    [GAIN_DRIFT] = {"gain_drift_per_sqrt_h", CB_FIELD_FLOAT, true,
                    AT(settings.gain_drift_per_sqrt_h), .least = "0", .most = "10"},
    [SIGMA] = {"sigma_um", CB_FIELD_FLOAT, true, AT(settings.sigma_um), .least = "0.01",
               .most = "1000"},
    [MIN_INTERVAL] = {"min_interval_s", CB_FIELD_FLOAT, false, AT(settings.min_interval_s),
                      .least = "0", .most = "86400", .otherwise = "0"},
};

enum { VALUE, COUNT, PROBE_KEYS };
static const struct cb_field PROBE_FIELDS[PROBE_KEYS] = {
    [VALUE] = {"value", CB_FIELD_STRING, true, CB_NOT_STORED},
    [COUNT] = {"count", CB_FIELD_STRING, true, CB_NOT_STORED},
};
static const struct cb_object PROBE_OBJECT = {PROBE_FIELDS, PROBE_KEYS};

/* A count wraps as a uint16 does, so its signal has every number of that type as it is.
 * in : at, its name */
static bool check_count(struct cb_loader *loader, uint32_t at, uint8_t signal) {
    const struct cb_signal_config *count = &loader->config->signals[signal];
    const bool counts = count->source != CB_SOURCE_LAG &&
                        cb_number_range(count->type).max >= 65535.0f && count->scale == 1.0f &&
                        count->zero == 0.0f && count->min <= 0.0f && count->max >= 65535.0f &&
                        count->max_rate_per_s == 0.0f;
    if (counts) return true;
    return cb_fail(loader, CB_ERROR_TYPE, at,
                   "the signal %o does not count: it needs type uint16, scale 1, min 0, max 65535 "
                   "and no max_rate_per_s",
                   at);
}

static bool read_probe(struct cb_loader *loader, uint32_t at, struct cb_adapt_config *adapt) {
    uint32_t slots[PROBE_KEYS];
    if (!cb_read_object(loader, at, &PROBE_OBJECT, NULL, slots)) return false;
    if (!cb_read_signal(loader, slots[VALUE], &adapt->signals[0])) return false;
    if (!cb_read_signal(loader, slots[COUNT], &adapt->signals[1])) return false;
    return check_count(loader, slots[COUNT], adapt->signals[1]);
}

static bool load(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                 struct cb_term_config *term) {
    const struct cb_config *config = loader->config;
    unsigned others = 0;
    for (unsigned i = 0; i < config->terms_count; ++i)
        others += config->terms[i].type == CB_TERM_ADAPT;
    if (others == CB_MAX_ADAPTS)
        return cb_fail(loader, CB_ERROR_FULL, at, "more than %u terms of type adapt",
                       (uint32_t)CB_MAX_ADAPTS);
    term->as.adapt.measures |= CB_ADAPT_NOWHERE; /* until the channels are loaded */
    return read_probe(loader, slots[PROBE], &term->as.adapt);
}

static bool link(struct cb_loader *loader, uint32_t at, struct cb_term_config *term) {
    return cb_read_output(loader, at, &term->as.adapt.output);
}

/* Moves b and g towards their targets by the same part of the way, so that b + g m moves by fade_um
 * at most. in: m, finite */
static void follow(struct cb_adapted *adapted, float m, float fade_um) {
    const float bias_by = adapted->to_bias_um - adapted->bias_um;
    const float gain_by = adapted->to_gain - adapted->gain;
    const float way_um = cb_abs(bias_by + gain_by * m);
    if (way_um <= fade_um) {
        adapted->bias_um = adapted->to_bias_um;
        adapted->gain = adapted->to_gain;
        return;
    }
    const float part = fade_um / way_um;
    adapted->bias_um += part * bias_by;
    adapted->gain += part * gain_by;
}

static uint8_t value(const struct cb_evaluation *e, const struct cb_term_config *term,
                     struct cb_term_state *state, float *value) {
    const struct cb_adapt_config *adapt = &term->as.adapt;
    struct cb_adapted *adapted = &state->adapted;
    const float m = e->outputs[adapt->output];
    if (!cb_output_is_live(e, adapt->output)) return CB_TERM_MISSING;
    if (adapted->bias_um != adapted->to_bias_um || adapted->gain != adapted->to_gain)
        follow(adapted, m, e->fade_um);
    value[0] = cb_adapt_value(&adapt->settings, adapted->bias_um, adapted->gain, m);
    return 0;
}

/* The output fades with its model, but never further from it than the bound at its present value:
 * y itself as model value m with the bias y - m. */
static void stay_near(const struct cb_evaluation *e, const struct cb_term_config *term,
                      float *output) {
    const struct cb_adapt_config *adapt = &term->as.adapt;
    const float m = e->outputs[adapt->output];
    output[0] = cb_adapt_value(&adapt->settings, output[0] - m, 0.0f, m);
}

static void slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                  float *slope) {
    const uint8_t index = pass->e.config->output_terms[term->first_output];
    slope[0] = (1.0f + pass->e.states[index].adapted.gain) * pass->slopes[term->as.adapt.output];
}

static const struct cb_term_part PARTS[] = {{"probe", &PROBE_OBJECT}, {0, 0}};

const struct cb_term_kind cb_term_adapt = {
    .object = {FIELDS, KEYS},
    .parts = PARTS,
    .uses = CB_TERM_LIST(as.adapt.output),
    .uses_key = "of",
    .load = load,
    .link = link,
    .value = value,
    .hold = stay_near,
    .slope = slope,
};
