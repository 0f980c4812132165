/* SPDX-License-Identifier: MIT
 * Statistics of a run in fixed memory, filled from the rows and written as JSON (docs/compboxd.md).
 */
#ifndef COMPBOX_HAL_LINUX_FILES_STATS_H
#define COMPBOX_HAL_LINUX_FILES_STATS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/box/ceiling.h"
#include "hal/linux/bus.h"
#include "hal/linux/files/histogram.h"
#include "hal/linux/files/row.h"
#include "hal/linux/files/writer.h"

struct cb_config;
struct cb_can_config;

enum { CB_STATS_HISTORY = 256 }; /* changes of mode or reason kept; the oldest are dropped */

struct cb_stats_change {
    int64_t time_us;
    uint8_t mode, reason;
    struct cb_row_cause cause; /* at the time of the change */
};

/* Facts about the run that do not come from rows; set by the caller. */
struct cb_stats_run {
    const char *config_file;
    const char *plc; /* address and port */
    int64_t started_unix_s;
    int priority;              /* 0: normal scheduling */
    bool memory_locked;        /* mlockall succeeded */
    bool cpu_latency_held;     /* /dev/cpu_dma_latency is held at 0 */
    bool can_used;             /* the coefficient file uses the CAN bus */
    const struct cb_bus *bus;  /* the slow bus; NULL until it is started */
    bool finished;             /* the loop has ended */
    bool stopped;              /* … after the confirmation of STOPPED */
    struct cb_ceiling ceiling; /* of the site */
    uint32_t lowered;          /* bit i: it lowers the limits of channel i */
    uint32_t reloads_taken, reloads_refused;
    bool reload_pending; /* a file waits until the box is at rest; reload_message is about it */
    const char *reload_message; /* about the last file; NULL or "": none */
    uint64_t rows_lost;         /* rows dropped because the ring was full */
    uint64_t records_lost;      /* rows missing from the record */
};

struct cb_stats {
    struct cb_stats_run run;
    struct cb_histogram jitter, interval, exchange, step;
    uint64_t rows;
    int64_t first_us, first_tick; /* of the first row */
    struct cb_row last;
    uint32_t changes; /* of mode or reason, in total */
    struct cb_stats_change history[CB_STATS_HISTORY];
};

void cb_stats_add(struct cb_stats *stats, const struct cb_row *row);

/* Writes the box's counters as one object. */
void cb_stats_put_box(struct cb_writer *json, const char *key, const struct cb_counters *counters);

/* Writes the member "can", if the file uses the bus (stats_can.c). */
void cb_stats_put_can(struct cb_writer *json, const struct cb_can_config *config,
                      const struct cb_row *row);

/* Writes the member "bus", if the file has a bus (stats_bus.c). */
void cb_stats_put_bus(struct cb_writer *json, const struct cb_bus *bus);

/* Writes a temporary file beside `path` and renames it over `path`. out: 0, or errno (ENOTSUP:
 * `path` is not a regular file); on error the old file is unchanged. */
int cb_stats_write(const struct cb_stats *stats, const struct cb_config *config, const char *path);

#endif
