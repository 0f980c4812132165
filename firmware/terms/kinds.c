/* SPDX-License-Identifier: MIT */
#include "firmware/terms/kinds.h"

#define ENTRY(NAME, name) [CB_TERM_##NAME] = &cb_term_##name,
const struct cb_term_kind *const cb_term_kinds[] = {[CB_TERM_VOLUMETRIC] = 0, CB_TERM_KINDS(ENTRY)};
