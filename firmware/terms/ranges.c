/* SPDX-License-Identifier: MIT */
#include "firmware/terms/ranges.h"

#include <string.h>

#include "firmware/terms/kind.h"
#include "firmware/terms/load.h"

/* out: trained interval, margin and width of the fade of one input; defaults for absent keys */
static bool make_range(struct cb_loader *loader, const uint32_t *slots, uint32_t input,
                       struct cb_training_range *range) {
    const struct cb_load_scratch *scratch = loader->scratch;
    const uint32_t max_at = cb_list_at(loader, slots[CB_RANGE_MAX], input);
    const float trained = scratch->range.max[input] - scratch->range.min[input];
    if (!(trained >= 0.0f))
        return cb_fail(loader, CB_ERROR_ORDER, max_at, "%o is below input_min (%o)", max_at,
                       cb_list_at(loader, slots[CB_RANGE_MIN], input));
    const bool fades = slots[CB_RANGE_FADE] != CB_ABSENT;
    const float fade = fades ? scratch->range.fade[input] : 0.5f * trained;
    if (!(fade >= cb_number_of(CB_LEAST_SCALE)))
        return cb_fail(loader, CB_ERROR_RANGE, max_at,
                       "%o equals input_min: this input was not varied; omit it or state fade",
                       max_at);
    const bool extends = slots[CB_RANGE_MARGIN] != CB_ABSENT;
    range->min = scratch->range.min[input];
    range->max = scratch->range.max[input];
    range->margin = extends ? scratch->range.margin[input] : 0.1f * trained;
    range->inverse_fade = 1.0f / fade;
    return true;
}

bool cb_read_ranges(struct cb_loader *loader, uint32_t at, const uint32_t *slots, uint32_t inputs,
                    uint16_t *ranges) {
    struct cb_load_scratch *scratch = loader->scratch;
    const uint32_t margin = slots[CB_RANGE_MARGIN], fade = slots[CB_RANGE_FADE];
    struct cb_training_range range;
    const uint32_t floats = sizeof range / sizeof(float);
    if (!cb_read_vector(loader, slots[CB_RANGE_MIN], inputs, "inputs", scratch->range.min) ||
        !cb_read_vector(loader, slots[CB_RANGE_MAX], inputs, "inputs", scratch->range.max) ||
        !cb_read_vector_or(loader, margin, inputs, "inputs", 0.0f, scratch->range.margin) ||
        !cb_read_vector_or(loader, fade, inputs, "inputs", 0.0f, scratch->range.fade) ||
        !cb_check_least(loader, margin, "0", inputs, scratch->range.margin) ||
        !cb_check_least(loader, fade, CB_LEAST_SCALE, inputs, scratch->range.fade) ||
        !cb_take_pool(loader, at, inputs * floats, ranges))
        return false;
    for (uint32_t i = 0; i < inputs; ++i) {
        if (!make_range(loader, slots, i, &range)) return false;
        memcpy(loader->config->pool + *ranges + i * floats, &range, sizeof range);
    }
    return true;
}

float cb_range_outside(const struct cb_training_range *range, unsigned input, float x,
                       struct cb_training_verdict *verdict) {
    return cb_training_range_outside(range, (uint8_t)input, x, verdict);
}

uint8_t cb_range_judge(const struct cb_training_verdict *verdict, float *value, unsigned outputs) {
    for (unsigned k = 0; k < outputs; ++k) value[k] *= verdict->weight;
    if (verdict->weight < 1.0f) return CB_TERM_EXTRAPOLATED | CB_TERM_WEAKENED;
    return verdict->extrapolated > 0 ? CB_TERM_EXTRAPOLATED : 0;
}

void cb_range_fade_slope(const struct cb_training_verdict *verdict, unsigned input,
                         const float *output, float *slope, unsigned outputs) {
    const bool fades = verdict->weight < 1.0f && verdict->weakest == input;
    const float fading = fades ? verdict->weight_slope / verdict->weight : 0.0f;
    for (unsigned k = 0; k < outputs; ++k)
        slope[k] = verdict->weight * slope[k] + fading * output[k];
}
