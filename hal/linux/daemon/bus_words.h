/* SPDX-License-Identifier: MIT
 * The slow bus in the log and in the statistics. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_BUS_WORDS_H
#define COMPBOX_HAL_LINUX_DAEMON_BUS_WORDS_H

#include "hal/linux/daemon/bus.h"
#include "hal/linux/daemon/log.h"
#include "hal/linux/daemon/stats.h"

/* Logs the changes on the bus since the last call. */
void cb_log_bus(struct cb_log *log, struct cb_bus *bus, int64_t now_us);

/* Writes the member "bus", if the file has a bus. */
void cb_stats_put_bus(struct cb_writer *json, const struct cb_bus *bus);

#endif
