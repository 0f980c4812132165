/* SPDX-License-Identifier: MIT
 * Internal to the loader: the section "terms", and helpers for its kinds. */
#ifndef COMPBOX_FIRMWARE_TERMS_LOAD_H
#define COMPBOX_FIRMWARE_TERMS_LOAD_H

#include "firmware/json/reader.h"

struct cb_term_inputs;

/* All functions: out: true; or false and the first mistake as a message with its place. */

/* Loads the section "terms". in: at, its list; all signals are loaded */
bool cb_load_terms(struct cb_loader *loader, uint32_t at);

/* Reserves `count` floats of the pool. in: at, the term, for messages. out: *offset in the pool */
bool cb_take_pool(struct cb_loader *loader, uint32_t at, uint32_t count, uint16_t *offset);

/* in : at, the name of a signal, of an output of a term. out: its index */
bool cb_read_signal(struct cb_loader *loader, uint32_t at, uint8_t *signal);
bool cb_read_output(struct cb_loader *loader, uint32_t at, uint8_t *output);

/* Reads a list of 1 … most different signals into config->links. in: most <= 255 */
bool cb_read_inputs(struct cb_loader *loader, uint32_t at, uint32_t most,
                    struct cb_term_inputs *inputs);

/* Reads a list of exactly `count` numbers. in: of, what each number belongs to: "inputs" */
bool cb_read_vector(struct cb_loader *loader, uint32_t at, uint32_t count, const char *of,
                    float *numbers);

/* As cb_read_vector(); every number of an absent list is `otherwise`. */
bool cb_read_vector_or(struct cb_loader *loader, uint32_t at, uint32_t count, const char *of,
                       float otherwise, float *numbers);

/* in : at, a list of `rows` rows, each a list of `columns` numbers
 * out: numbers[rows * columns], row by row */
bool cb_read_rows(struct cb_loader *loader, uint32_t at, uint32_t rows, const char *of_rows,
                  uint32_t columns, const char *of_columns, float *numbers);

/* in : at, the list of numbers[count], or CB_ABSENT; least, a number as text
 * out: true if no number is below `least`, or the list is absent */
bool cb_check_least(struct cb_loader *loader, uint32_t at, const char *least, uint32_t count,
                    const float *numbers);

#endif
