/* SPDX-License-Identifier: MIT
 * The kinds of terms there are. A new kind is one file of this folder and one line here: the name
 * of its CB_TERM_…, and its word in the file, which is also its struct's: cb_term_product. */
#ifndef COMPBOX_FIRMWARE_TERMS_KINDS_H
#define COMPBOX_FIRMWARE_TERMS_KINDS_H

#include "firmware/terms/kind.h"

#define CB_TERM_KINDS(KIND)  \
    KIND(POLYLINE, polyline) \
    KIND(PRODUCT, product)
#define CB_TERM_KIND(NAME, name) extern const struct cb_term_kind cb_term_##name;
CB_TERM_KINDS(CB_TERM_KIND)
#undef CB_TERM_KIND

/* By enum cb_term_type. */
extern const struct cb_term_kind *const cb_term_kinds[CB_TERM_VOLUMETRIC + 1];

#endif
