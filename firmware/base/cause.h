/* SPDX-License-Identifier: MIT
 * Which signal, term or channel is behind the box's reason, its value and its bound. */
#ifndef COMPBOX_FIRMWARE_BASE_CAUSE_H
#define COMPBOX_FIRMWARE_BASE_CAUSE_H

#include <stdint.h>

/* X(name, number, what, before, between): "WHAT NAME" before value [unit] between bound. An empty
 * `between` means that the sentence has no numbers. The number is the high byte of the detail
 * register. */
#define CB_CAUSES(X)                                                                      \
    X(CB_CAUSE_NONE, 0, "", "", "")                                                       \
    X(CB_CAUSE_NEVER, 1, "signal", "has had no plausible value yet", "")                  \
    X(CB_CAUSE_STALE, 2, "signal", "is", "ms old and its max_age_ms is")                  \
    X(CB_CAUSE_BELOW, 3, "signal", "reads", "and its min is")                             \
    X(CB_CAUSE_ABOVE, 4, "signal", "reads", "and its max is")                             \
    X(CB_CAUSE_FAST, 5, "signal", "reads", "and changed faster than its max_rate_per_s,") \
    X(CB_CAUSE_NO_NUMBER, 6, "signal", "reads something that is not a number", "")        \
    X(CB_CAUSE_FADED, 7, "term", "is faded out", "")                                      \
    X(CB_CAUSE_DEMAND, 8, "channel", "wants", "um and its error_um is")                   \
    X(CB_CAUSE_LIMITED, 9, "channel", "wants", "um and its limit_um is")                  \
    X(CB_CAUSE_UNAPPLIED, 10, "channel", "applies", "um and was sent")                    \
    X(CB_CAUSE_DOUBTED, 11, "signal", "reads", "and the other sensors predict")           \
    X(CB_CAUSE_DRIFTED, 12, "term", "has probes to one side, by a sum of", "and its limit is")

enum cb_cause_kind {
#define CB_X(name, number, what, before, between) name = number,
    CB_CAUSES(CB_X)
#undef CB_X
};

struct cb_cause {
    uint8_t kind;       /* enum cb_cause_kind */
    uint8_t index;      /* of the signal, term or channel */
    float value, bound; /* in the signal's unit, ms or µm; any float */
};

/* Words of a cause's kind, from the list above. */
struct cb_cause_words {
    const char *what, *before, *between;
};
struct cb_cause_words cb_cause_words_of(uint8_t kind);

/* out: the detail register: kind * 256 + 1 + index; 0: no cause */
static inline uint16_t cb_cause_detail(const struct cb_cause *cause) {
    return (uint16_t)(cause->kind == CB_CAUSE_NONE ? 0 : cause->kind << 8 | (cause->index + 1));
}

#endif
