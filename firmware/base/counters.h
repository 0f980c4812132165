/* SPDX-License-Identifier: MIT
 * Counters for all faults of the field; they wrap. docs/faults.md has the meaning of each one.
 * Names are stable, because statistics, flight recorder and docs use them. */
#ifndef COMPBOX_FIRMWARE_BASE_COUNTERS_H
#define COMPBOX_FIRMWARE_BASE_COUNTERS_H

#include <stdint.h>

#include "firmware/base/limits.h"

#define CB_COUNTERS(X)     \
    X(cycles)              \
    X(missed_ticks)        \
    X(reads_failed)        \
    X(reads_torn)          \
    X(writes_failed)       \
    X(writes_refused)      \
    X(writes_unknown)      \
    X(heartbeats_lost)     \
    X(clock_jumps)         \
    X(samples_implausible) \
    X(samples_unknown)     \
    X(signals_stale)       \
    X(sensors_doubted)     \
    X(outside_curve)       \
    X(models_extrapolated) \
    X(models_weakened)     \
    X(terms_not_finite)    \
    X(terms_faded)         \
    X(probes_taken)        \
    X(probes_asked)        \
    X(probes_refused)      \
    X(outputs_limited)     \
    X(outputs_slewed)      \
    X(pairs_limited)       \
    X(slopes_limited)      \
    X(applied_foreign)     \
    X(registers_foreign)   \
    X(handshakes)          \
    X(nc_alarms)           \
    X(resyncs)             \
    X(holds)               \
    X(ramps)               \
    X(faults)

struct cb_counters {
#define CB_X(name) uint32_t name;
    CB_COUNTERS(CB_X)
#undef CB_X
};

/* Number of counters; their names follow the order of the struct. */
enum {
#define CB_X(name) +1
    CB_COUNTERS_COUNT = 0 CB_COUNTERS(CB_X)
#undef CB_X
};
_Static_assert(CB_COUNTERS_COUNT <= 33, "the flight recorder has a bit for each but cycles");
_Static_assert(sizeof(struct cb_counters) == CB_COUNTERS_COUNT * sizeof(uint32_t), "no padding");

/* index < CB_COUNTERS_COUNT. */
const char *cb_counter_name(unsigned index);

#endif
