/* SPDX-License-Identifier: MIT
 * The cause behind the box's reason, in words. */
#ifndef COMPBOX_HAL_LINUX_FILES_CAUSE_WORDS_H
#define COMPBOX_HAL_LINUX_FILES_CAUSE_WORDS_H

#include <stddef.h>

#include "hal/linux/files/row.h"

enum { CB_CAUSE_TEXT = 160 };

/* out: "signal X reads 1000.1 mm and its max is 1000", or "" without a cause */
void cb_cause_text(const struct cb_row_cause *cause, char text[CB_CAUSE_TEXT]);

/* The box's cause with the names from its configuration, which must be intact. */
struct cb_row_cause cb_name_cause(const struct cb_box *box);

#endif
