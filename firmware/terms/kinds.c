/* SPDX-License-Identifier: MIT */
#include "firmware/terms/kinds.h"

#define ENTRY(NAME, name) &cb_term_##name,
const struct cb_term_kind *const cb_term_kinds[CB_TERM_TYPES] = {CB_TERM_KINDS(ENTRY)};
