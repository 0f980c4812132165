/* SPDX-License-Identifier: MIT
 * The box at this moment, as JSON for programs of other users: what it reads, wants and writes, and
 * why (docs/snapshot.md). */
#ifndef COMPBOX_HAL_LINUX_FILES_SNAPSHOT_H
#define COMPBOX_HAL_LINUX_FILES_SNAPSHOT_H

#include "hal/linux/files/stats.h"

enum { CB_SNAPSHOT_VERSION = 1 };

/* Writes the last row of *stats, of the file *config with this check sum, to a new file and renames
 * it over `path`. It is not synced: a snapshot of before a power cut is of no use.
 * out: 0, or errno (cb_output_error()) */
int cb_snapshot_write(const struct cb_stats *stats, const struct cb_config *config, uint32_t crc32,
                      const char *path);

#endif
