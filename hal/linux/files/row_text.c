/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/row_text.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "firmware/base/assert.h"
#include "hal/linux/files/row_sigma.h"

/* Appends to text[CB_ROW_TEXT]. */
static __attribute__((format(printf, 3, 4))) void put(char *text, size_t *used, const char *format,
                                                      ...) {
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(text + *used, CB_ROW_TEXT - *used, format, arguments);
    va_end(arguments);
    CB_ASSERT((size_t)length < CB_ROW_TEXT - *used); /* a negative one is huge */
    *used += (size_t)length;
}

size_t cb_row_header(char *text, const struct cb_config *config) {
    size_t used = 0;
    put(text, &used, "time_s");
    for (unsigned i = 0; i < config->signals_count; i++)
        put(text, &used, ",%s", config->signals[i].name);
    for (unsigned i = 0; i < config->outputs_count; i++)
        put(text, &used, ",%s", config->outputs[i].name);
    for (unsigned i = 0; i < config->channels_count; i++)
        put(text, &used, ",comp_%s_um", config->channels[i].name);
    for (unsigned i = 0; i < config->outputs_count; i++)
        if (cb_row_has_sigma(config, i)) put(text, &used, ",sigma_%s", config->outputs[i].name);
    put(text, &used, ",mode,reason,unix_s\n");
    return used;
}

unsigned cb_row_count(const struct cb_config *config) {
    unsigned count =
        (unsigned)config->signals_count + config->outputs_count + config->channels_count;
    for (unsigned i = 0; i < config->outputs_count; i++) count += cb_row_has_sigma(config, i);
    return count;
}

unsigned cb_row_values(float *values, const struct cb_config *config, const struct cb_row *row) {
    unsigned count = 0;
    for (unsigned i = 0; i < config->signals_count; i++) {
        const struct cb_row_signal *signal = &row->signals[i];
        values[count++] = signal->state != CB_ROW_SIGNAL_NEVER ? signal->value : NAN;
    }
    for (unsigned i = 0; i < config->outputs_count; i++) values[count++] = row->outputs[i];
    for (unsigned i = 0; i < config->channels_count; i++)
        values[count++] = row->channels[i].output_um;
    for (unsigned i = 0; i < config->outputs_count; i++)
        if (cb_row_has_sigma(config, i)) values[count++] = row->sigma_um[i];
    for (unsigned i = count; i < CB_ROW_VALUES; i++) values[i] = NAN;
    return count;
}

size_t cb_row_line(char *text, const struct cb_row_frame *frame, const float *values,
                   unsigned count) {
    size_t used = 0;
    put(text, &used, "%.6f", (double)frame->time_us * 1e-6);
    for (unsigned i = 0; i < count; i++) {
        if (isnan(values[i]))
            put(text, &used, ",");
        else
            put(text, &used, ",%.9g", (double)values[i]);
    }
    put(text, &used, ",%u,%u,%.3f\n", frame->mode, frame->reason, (double)frame->unix_us * 1e-6);
    return used;
}
