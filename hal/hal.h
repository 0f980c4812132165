/* SPDX-License-Identifier: MIT
 * The hardware as a small struct of operations with a context. Each target provides one; fault
 * injectors are decorators around any such struct (tests/support/fault.h). */
#ifndef COMPBOX_HAL_HAL_H
#define COMPBOX_HAL_HAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/base/io.h"

/* Results of a client that works beside the loop, one cycle late. */
struct cb_handed {
    int64_t read_us;    /* request time of the reading that read() returned last */
    uint8_t write;      /* enum cb_transfer, of the write of the previous cycle; NONE: none */
    int64_t written_us; /* time of its reply, where OK */
};

struct cb_hal {
    void *context; /* passed to every operation */

    /* Monotonic time in µs, which includes suspend. */
    int64_t (*now_us)(void *context);

    /* Sleeps until the next tick of the period. out: number of ticks missed before it (0: in time).
     * Ticks are absolute; missed ones are skipped, never made up. */
    uint32_t (*wait_tick)(void *context);

    /* FC3: count registers from start into registers[]; unchanged unless CB_TRANSFER_OK.
     * Returns by deadline_us, whatever the PLC does. */
    enum cb_transfer (*read)(void *context, uint16_t start, uint16_t count, uint16_t *registers,
                             int64_t deadline_us);

    /* FC16, with the same rules. */
    enum cb_transfer (*write)(void *context, uint16_t start, uint16_t count,
                              const uint16_t *registers, int64_t deadline_us);

    /* FC23 in one request: writes first, then reads. */
    enum cb_transfer (*write_read)(void *context, uint16_t write_start, uint16_t write_count,
                                   const uint16_t *write_registers, uint16_t read_start,
                                   uint16_t read_count, uint16_t *read_registers,
                                   int64_t deadline_us);

    /* Closes the connection after a last write that was sent and has no reply: the sent bytes
     * arrive, and nothing follows them. Then reconnects. NULL: the wire has no connection. */
    void (*leave)(void *context);

    /* Moves up to max pending samples into samples[]. out: their number. Never blocks. */
    size_t (*samples)(void *context, struct cb_sample *samples, size_t max);

    /* Called after each completed step, whether or not the PLC replies. */
    void (*feed_watchdog)(void *context);

    /* out: whether a stop of the box was requested */
    bool (*stop_requested)(void *context);

    /* NULL: read and write do their request and return its result. Else a client works beside the
     * loop: they return at once with results of the previous cycle's requests, and this operation,
     * called after read, has the rest. write_read is not called then. */
    struct cb_handed (*handed)(void *context);
};

#endif
