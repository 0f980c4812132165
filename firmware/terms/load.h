/* SPDX-License-Identifier: MIT
 * Inside of the loader: the section "terms", and helpers that its kinds share. */
#ifndef COMPBOX_FIRMWARE_TERMS_LOAD_H
#define COMPBOX_FIRMWARE_TERMS_LOAD_H

#include "firmware/json/reader.h"

/* The section "terms"; at: its list. Needs signals. */
bool cb_load_terms(struct cb_loader *loader, uint32_t at);

/* Takes `count` floats of the pool. */
bool cb_take_pool(struct cb_loader *loader, uint32_t at, uint32_t count, uint16_t *offset);

/* The signal that a name means; the output of a term that a name means. */
bool cb_read_signal(struct cb_loader *loader, uint32_t at, uint8_t *signal);
bool cb_read_output(struct cb_loader *loader, uint32_t at, uint8_t *output);

/* A list of different signals into config->links. in: most <= 255 */
bool cb_read_inputs(struct cb_loader *loader, uint32_t at, uint32_t most,
                    struct cb_term_inputs *inputs);

/* A list of exactly `count` numbers; `of` says what there are so many of: "inputs". */
bool cb_read_vector(struct cb_loader *loader, uint32_t at, uint32_t count, const char *of,
                    float *numbers);

#endif
