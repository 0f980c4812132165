/* SPDX-License-Identifier: MIT
 * Inside of the loader: the section "terms", and helpers that its kinds share. */
#ifndef COMPBOX_FIRMWARE_TERMS_LOAD_H
#define COMPBOX_FIRMWARE_TERMS_LOAD_H

#include "firmware/json/reader.h"

/* Loads one term: its simple fields are stored in term->as, its outputs are named; slots as its
 * table says. References to other terms are resolved later, when all are there. */
typedef bool cb_load_kind(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                          struct cb_term_config *term);

cb_load_kind cb_load_linear;     /* linear.c */
cb_load_kind cb_load_bpnet;      /* bpnet.c */
cb_load_kind cb_load_volumetric; /* volumetric.c */

/* Second pass, at: the same term */
typedef bool cb_link_kind(struct cb_loader *loader, uint32_t at, struct cb_term_config *term);
cb_link_kind cb_link_volumetric;

/* The tables of their keys. */
extern const struct cb_object cb_bspline_object; /* curves.c */
extern const struct cb_object cb_polynomial_object;
extern const struct cb_object cb_bspline_backward_object;
extern const struct cb_object cb_polynomial_backward_object;
extern const struct cb_object cb_linear_object;     /* linear.c */
extern const struct cb_object cb_bpnet_object;      /* bpnet.c */
extern const struct cb_object cb_volumetric_object; /* volumetric.c */
extern const struct cb_object cb_reference_points_object;
extern const struct cb_object cb_squareness_object;

/* The section "terms"; at: its list. Needs signals. */
bool cb_load_terms(struct cb_loader *loader, uint32_t at);

/* Takes `count` floats of the pool. */
bool cb_take_pool(struct cb_loader *loader, uint32_t at, uint32_t count, uint16_t *offset);

/* The signal that a name means; the output of a term that a name means. */
bool cb_read_signal(struct cb_loader *loader, uint32_t at, uint8_t *signal);
bool cb_read_output(struct cb_loader *loader, uint32_t at, uint8_t *output);

/* A list of different signals into config->links. in: most <= 255 */
bool cb_read_inputs(struct cb_loader *loader, uint32_t at, uint32_t most, uint16_t *link,
                    uint8_t *inputs);

/* A list of exactly `count` numbers; `of` says what there are so many of: "inputs". */
bool cb_read_vector(struct cb_loader *loader, uint32_t at, uint32_t count, const char *of,
                    float *numbers);

#endif
