/* SPDX-License-Identifier: MIT
 * Lock-free hand-over between two threads: a ring of slots with one writer and one reader, and a
 * flag. The slots themselves belong to the caller; these are their indices.
 *
 * The atomics are the compiler's (__atomic, the C11 memory model) on plain integers, so that C and
 * C++ see the same structure. */
#ifndef COMPBOX_HAL_LINUX_MAILBOX_H
#define COMPBOX_HAL_LINUX_MAILBOX_H

#include <stdbool.h>
#include <stdint.h>

/* The counts only grow (and wrap); a slot's index is count % slots. */
struct cb_ring {
    uint32_t slots; /* a power of two */
    uint32_t written;
    uint32_t taken;
    uint32_t lost; /* items that found the ring full */
};

static inline void cb_ring_start(struct cb_ring *ring, uint32_t slots) {
    *ring = (struct cb_ring){slots, 0, 0, 0};
}

/* Writer. out: index of the slot to fill, then cb_ring_publish; or -1 when the ring is full, and
 * the item is counted as lost. Never waits. */
static inline int32_t cb_ring_slot_to_write(struct cb_ring *ring) {
    uint32_t taken = __atomic_load_n(&ring->taken, __ATOMIC_ACQUIRE);
    if (ring->written - taken >= ring->slots) {
        __atomic_store_n(&ring->lost, ring->lost + 1, __ATOMIC_RELAXED);
        return -1;
    }
    return (int32_t)(ring->written & (ring->slots - 1));
}

static inline void cb_ring_publish(struct cb_ring *ring) {
    __atomic_store_n(&ring->written, ring->written + 1, __ATOMIC_RELEASE);
}

/* Reader. out: index of the oldest unread slot, then cb_ring_release; or -1 when there is none. */
static inline int32_t cb_ring_slot_to_read(const struct cb_ring *ring) {
    uint32_t written = __atomic_load_n(&ring->written, __ATOMIC_ACQUIRE);
    return written == ring->taken ? -1 : (int32_t)(ring->taken & (ring->slots - 1));
}

static inline void cb_ring_release(struct cb_ring *ring) {
    __atomic_store_n(&ring->taken, ring->taken + 1, __ATOMIC_RELEASE);
}

static inline uint32_t cb_ring_lost(const struct cb_ring *ring) {
    return __atomic_load_n(&ring->lost, __ATOMIC_RELAXED);
}

/* A flag that one thread raises permanently. A thread that sees it also sees all earlier writes. */
static inline void cb_flag_raise(bool *flag) {
    __atomic_store_n(flag, true, __ATOMIC_RELEASE);
}

static inline bool cb_flag_is_raised(const bool *flag) {
    return __atomic_load_n(flag, __ATOMIC_ACQUIRE);
}

#endif
