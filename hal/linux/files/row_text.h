/* SPDX-License-Identifier: MIT
 * A row as a line of CSV, for the record and the black box: time_s, every signal by its name (empty
 * until it is first received), every term output by its name, comp_NAME_um of every channel,
 * sigma_NAME of every term output that states one, mode and reason (numbers of the status
 * register), and unix_s, the wall clock. */
#ifndef COMPBOX_HAL_LINUX_FILES_ROW_TEXT_H
#define COMPBOX_HAL_LINUX_FILES_ROW_TEXT_H

#include <stddef.h>
#include <stdint.h>

#include "hal/linux/files/row.h"

struct cb_config;

enum {
    CB_ROW_VALUES = CB_MAX_SIGNALS + 2 * CB_MAX_OUTPUTS + CB_MAX_CHANNELS,
    CB_ROW_TEXT = 12288, /* bytes of the longest line: 64 + 2 * 128 + 16 columns, 32 bytes each */
};

/* The columns before and behind the values. */
struct cb_row_frame {
    int64_t time_us; /* since the record's zero */
    int64_t unix_us;
    uint8_t mode, reason;
};

/* out: text[CB_ROW_TEXT]: the names of the columns, with the end of the line; its length */
size_t cb_row_header(char *text, const struct cb_config *config);

/* out: number of values of a row, between time_s and mode */
unsigned cb_row_count(const struct cb_config *config);

/* out: values[CB_ROW_VALUES]: signals, outputs, channels, sigmas; NaN: empty, and behind the last.
 *      result: their number; another one than that of the header if a bit has flipped since */
unsigned cb_row_values(float *values, const struct cb_config *config, const struct cb_row *row);

/* out: text[CB_ROW_TEXT]: the line with its end; its length. Nine digits of each value, so that a
 *      float32 reads back with the same bits. */
size_t cb_row_line(char *text, const struct cb_row_frame *frame, const float *values,
                   unsigned count);

#endif
