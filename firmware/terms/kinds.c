/* SPDX-License-Identifier: MIT */
#include "firmware/terms/kinds.h"

#include "firmware/terms/kind.h"

#define ENTRY(NAME, name) &cb_term_##name,
const struct cb_term_kind *const cb_term_kinds[CB_TERM_TYPES] = {CB_TERM_KINDS(ENTRY)};

const uint8_t *cb_term_signals(const struct cb_config *config, const struct cb_term_config *term,
                               unsigned *count) {
    const struct cb_term_list *list = &cb_term_kinds[term->type]->signals;
    if (list->offset == 0) { /* that of the type: no signals */
        *count = 0;
        return config->links;
    }
    const void *at = (const char *)term + list->offset;
    const struct cb_term_inputs *inputs = at;
    *count = list->count > 0 ? list->count : inputs->count;
    return list->count > 0 ? at : config->links + inputs->link;
}

const uint8_t *cb_term_used(const struct cb_term_config *term, unsigned *count) {
    const struct cb_term_list *uses = &cb_term_kinds[term->type]->uses;
    *count = uses->count;
    return (const uint8_t *)term + uses->offset;
}
