/* SPDX-License-Identifier: MIT
 * The list of kinds of terms. A new kind is one file of this folder and one line here: the suffix
 * of its CB_TERM_…, and its word in the file, which is also the suffix of its cb_term_…. */
#ifndef COMPBOX_FIRMWARE_TERMS_KINDS_H
#define COMPBOX_FIRMWARE_TERMS_KINDS_H

#define CB_TERM_KINDS(KIND)      \
    KIND(BSPLINE, bspline)       \
    KIND(POLYLINE, polyline)     \
    KIND(POLYNOMIAL, polynomial) \
    KIND(LINEAR, linear)         \
    KIND(PRODUCT, product)       \
    KIND(BPNET, bpnet)           \
    KIND(VOLUMETRIC, volumetric) \
    KIND(ADAPT, adapt)

#define CB_TERM_TYPE_OF(NAME, name) CB_TERM_##NAME,
enum cb_term_type { CB_TERM_KINDS(CB_TERM_TYPE_OF) CB_TERM_TYPES };
#undef CB_TERM_TYPE_OF

struct cb_term_kind; /* kind.h */
#define CB_TERM_KIND_OF(NAME, name) extern const struct cb_term_kind cb_term_##name;
CB_TERM_KINDS(CB_TERM_KIND_OF)
#undef CB_TERM_KIND_OF

extern const struct cb_term_kind *const cb_term_kinds[CB_TERM_TYPES]; /* by enum cb_term_type */

#endif
