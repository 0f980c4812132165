/* SPDX-License-Identifier: MIT
 * Samples from a slow thread to the loop, lock-free: one writer, one reader (mailbox.h). A sample
 * belongs to a generation of the coefficient file, because its signal is an index there. */
#ifndef COMPBOX_HAL_LINUX_SAMPLE_RING_H
#define COMPBOX_HAL_LINUX_SAMPLE_RING_H

#include <stddef.h>

#include "hal/hal.h"
#include "hal/linux/mailbox.h"

enum { CB_RING_SAMPLES = 256 };

struct cb_sample_ring {
    struct cb_ring ring;
    struct cb_sample samples[CB_RING_SAMPLES];
    uint32_t generations[CB_RING_SAMPLES];
};

static inline void cb_sample_ring_start(struct cb_sample_ring *to) {
    cb_ring_start(&to->ring, CB_RING_SAMPLES);
}

/* Writer. A full ring counts the sample as lost. out: it had room */
static inline bool cb_sample_ring_put(struct cb_sample_ring *to, struct cb_sample sample,
                                      uint32_t generation) {
    const int32_t slot = cb_ring_slot_to_write(&to->ring);
    if (slot < 0) return false;
    to->samples[slot] = sample;
    to->generations[slot] = generation;
    cb_ring_publish(&to->ring);
    return true;
}

/* Reader. out: up to max samples of this generation; samples of others are dropped. */
static inline size_t cb_sample_ring_take(struct cb_sample_ring *from, uint32_t generation,
                                         struct cb_sample *samples, size_t max) {
    size_t count = 0;
    while (count < max) {
        const int32_t slot = cb_ring_slot_to_read(&from->ring);
        if (slot < 0) break;
        if (from->generations[slot] == generation) samples[count++] = from->samples[slot];
        cb_ring_release(&from->ring);
    }
    return count;
}

#endif
