/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/stats.h"

static void add_change(struct cb_stats *stats, const struct cb_row *row) {
    if (stats->rows > 0 && row->mode == stats->last.mode && row->reason == stats->last.reason)
        return;
    stats->history[stats->changes % CB_STATS_HISTORY] =
        (struct cb_stats_change){row->time_us, row->mode, row->reason, row->cause};
    stats->changes++;
}

void cb_stats_add(struct cb_stats *stats, const struct cb_row *row) {
    if (stats->rows == 0) {
        stats->first_us = row->time_us;
        stats->first_tick = row->tick;
    }
    add_change(stats, row);
    cb_histogram_add(&stats->jitter, row->late_ns);
    if (row->interval_ns > 0) cb_histogram_add(&stats->interval, row->interval_ns);
    if (row->read != CB_TRANSFER_FAILED || row->write != CB_TRANSFER_FAILED)
        cb_histogram_add(&stats->exchange, row->exchange_us * 1000);
    cb_histogram_add(&stats->step, row->step_us * 1000);
    stats->rows++;
    stats->last = *row;
}
