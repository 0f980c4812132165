/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/cause_words.h"

#include <stdio.h>
#include <string.h>

/* Only values of the signal itself have its unit. */
static bool in_signal_unit(uint8_t kind) {
    return kind == CB_CAUSE_BELOW || kind == CB_CAUSE_ABOVE || kind == CB_CAUSE_FAST;
}

static void put_names(struct cb_row_cause *row, const char *name, const char *unit) {
    memcpy(row->name, name, sizeof row->name);
    if (in_signal_unit(row->cause.kind)) memcpy(row->unit, unit, sizeof row->unit);
}

struct cb_row_cause cb_name_cause(const struct cb_box *box) {
    struct cb_row_cause row = {.cause = box->cause};
    const struct cb_config *config = &box->config;
    const uint8_t i = box->cause.index;
    const char what = cb_cause_words_of(row.cause.kind).what[0];
    if (what == 's') put_names(&row, config->signals[i].name, config->signals[i].unit);
    if (what == 't') put_names(&row, config->outputs[config->terms[i].first_output].name, row.unit);
    if (what == 'c') put_names(&row, config->channels[i].name, row.unit);
    return row;
}

void cb_cause_text(const struct cb_row_cause *cause, char text[CB_CAUSE_TEXT]) {
    const struct cb_cause_words words = cb_cause_words_of(cause->cause.kind);
    if (cause->cause.kind == CB_CAUSE_NONE)
        text[0] = '\0';
    else if (words.between[0] == '\0')
        snprintf(text, CB_CAUSE_TEXT, "%s %s %s", words.what, cause->name, words.before);
    else /* + 0.0 takes the sign of a zero */
        snprintf(text, CB_CAUSE_TEXT, "%s %s %s %.6g%s%s %s %.6g", words.what, cause->name,
                 words.before, (double)cause->cause.value + 0.0, cause->unit[0] == '\0' ? "" : " ",
                 cause->unit, words.between, (double)cause->cause.bound + 0.0);
}
