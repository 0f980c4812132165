/* SPDX-License-Identifier: MIT */
#ifndef COMPBOX_HAL_LINUX_DAEMON_BUS_WORDS_H
#define COMPBOX_HAL_LINUX_DAEMON_BUS_WORDS_H

#include "hal/linux/daemon/bus.h"
#include "hal/linux/daemon/log.h"
#include "hal/linux/daemon/stats.h"

/* Lines about what changed on the bus since the call before. */
void cb_log_bus(struct cb_log *log, struct cb_bus *bus, int64_t now_us);

/* The member "bus", where the file has one. */
void cb_stats_put_bus(FILE *file, const struct cb_bus *bus);

#endif
