/* SPDX-License-Identifier: MIT
 * How far the terms of a row may be off, by their own statement. */
#ifndef COMPBOX_HAL_LINUX_FILES_ROW_SIGMA_H
#define COMPBOX_HAL_LINUX_FILES_ROW_SIGMA_H

#include <stdbool.h>

#include "hal/linux/files/row.h"

/* in : output < config->outputs_count; a bit of the configuration may have flipped
 * out: true if its term states a sigma: one with a bank that has it in its file, or one of type
 *      adapt */
bool cb_row_has_sigma(const struct cb_config *config, unsigned output);

/* In the loop, after a step.
 * out: row->sigma_um: one standard deviation of each output, µm; NaN if none is stated, or none is
 *      known yet, or if the configuration has changed in memory */
void cb_row_take_sigmas(struct cb_row *row, const struct cb_box *box);

#endif
