/* SPDX-License-Identifier: MIT
 * Training range of a model's inputs (models/training_range.h): its four keys, and its use. */
#ifndef COMPBOX_FIRMWARE_TERMS_RANGES_H
#define COMPBOX_FIRMWARE_TERMS_RANGES_H

#include "firmware/config/config.h"
#include "firmware/json/reader.h"
#include "models/num.h"
#include "models/training_range.h"

#define CB_LEAST_SCALE "0.000001" /* of a divisor in the file */

/* The keys, adjacent in the table of their object. */
enum { CB_RANGE_MIN, CB_RANGE_MAX, CB_RANGE_MARGIN, CB_RANGE_FADE, CB_RANGE_KEYS };
#define CB_RANGE_FIELDS(first, required)                                                          \
    [(first) + CB_RANGE_MIN] = {"input_min", CB_FIELD_ARRAY, required, CB_NOT_STORED},            \
               [(first) + CB_RANGE_MAX] = {"input_max", CB_FIELD_ARRAY, required, CB_NOT_STORED}, \
               [(first) + CB_RANGE_MARGIN] = {"margin", CB_FIELD_ARRAY, false, CB_NOT_STORED},    \
               [(first) + CB_RANGE_FADE] = {"fade", CB_FIELD_ARRAY, false, CB_NOT_STORED}

_Static_assert(sizeof(struct cb_training_range) == 4 * sizeof(float),
               "stored in the pool as floats");

/* in : at, the term, for messages; slots[CB_RANGE_KEYS], of which the first two have a value;
 *      inputs <= CB_MAX_SIGNALS
 * out: *ranges: place of a struct cb_training_range of each input in the pool; or false and a
 *      message */
bool cb_read_ranges(struct cb_loader *loader, uint32_t at, const uint32_t *slots, uint32_t inputs,
                    uint16_t *ranges);

static inline const struct cb_training_range *cb_ranges_at(const struct cb_config *config,
                                                           uint16_t ranges) {
    const void *const at = config->pool + ranges;
    return at;
}

/* Rarely called: inputs are usually inside their training range. */
CB_COLD float cb_range_outside(const struct cb_training_range *range, unsigned input, float x,
                               struct cb_training_verdict *verdict);

/* out: x, held within the range and its margin; the verdict updated */
CB_INLINE float cb_range_hold(const struct cb_training_range *range, unsigned input, float x,
                              struct cb_training_verdict *verdict) {
    return cb_training_range_holds(range, x) ? x : cb_range_outside(range, input, x, verdict);
}

#define CB_NO_VERDICT ((struct cb_training_verdict){1.0f, 0.0f, 0, 0, 0})

/* Scales the outputs down where an input is beyond its margin. out: remarks (kind.h) */
uint8_t cb_range_judge(const struct cb_training_verdict *verdict, float *value, unsigned outputs);

/* The same for slopes by one input, by the product rule.
 * in : verdict->weight > 0; output[outputs], weakened; slope[outputs], of the model alone */
void cb_range_fade_slope(const struct cb_training_verdict *verdict, unsigned input,
                         const float *output, float *slope, unsigned outputs);

#endif
