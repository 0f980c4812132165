/* SPDX-License-Identifier: MIT
 * Exact inputs and outputs of each step of the box, as text: `compbox simulate --replay` repeats
 * the same steps from it (docs/compboxd.md). */
#ifndef COMPBOX_HAL_LINUX_FILES_INPUT_RECORD_H
#define COMPBOX_HAL_LINUX_FILES_INPUT_RECORD_H

#include <stdio.h>

#include "firmware/box/ceiling.h"
#include "firmware/box/state.h"
#include "hal/linux/files/row.h"

struct cb_config;

struct cb_input_record {
    FILE *file; /* NULL: no record */
    int error;  /* errno of the first failure, 0: none */
};

/* Creates the file. path NULL: no record. out: 0, or errno. */
int cb_input_record_start(struct cb_input_record *record, const char *path);

/* Writes what a replay needs beside the coefficient file: the site's ceiling, and the state with
 * which the box starts; then the names of the columns. Once, before the first row. */
void cb_input_record_begin(struct cb_input_record *record, const struct cb_ceiling *ceiling,
                           const struct cb_state *resumed);

/* Adds a row. config: the row's own. */
void cb_input_record_add(struct cb_input_record *record, const struct cb_config *config,
                         const struct cb_row *row);

/* Flushes and closes. out: 0, or errno of the first failure. */
int cb_input_record_finish(struct cb_input_record *record);

#endif
