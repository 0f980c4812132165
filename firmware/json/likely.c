/* SPDX-License-Identifier: MIT
 * Suggests the known key for a misspelt one. */
#include "firmware/json/reader.h"

static uint32_t smaller(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

/* Edits (insert, delete, replace) between two texts, b of at most CB_KEY_SIZE - 1 bytes. */
static uint32_t distance(const char *a, const char *b) {
    uint32_t row[CB_KEY_SIZE];
    uint32_t length = 0;
    for (row[0] = 0; b[length]; ++length) row[length + 1] = length + 1;
    for (uint32_t i = 1; *a; ++a, ++i) {
        uint32_t diagonal = row[0];
        row[0] = i;
        for (uint32_t k = 1; k <= length; ++k) {
            const uint32_t replaced = diagonal + (*a == b[k - 1] ? 0 : 1);
            diagonal = row[k];
            row[k] = smaller(replaced, 1 + smaller(row[k], row[k - 1]));
        }
    }
    return row[length];
}

/* out: true if `known` is `key` plus a suffix such as a unit: limit for limit_um. */
static bool lacks_end(const char *known, const char *key) {
    uint32_t length = 0;
    while (key[length] && key[length] == known[length]) ++length;
    return length > 0 && key[length] == '\0' && known[length] == '_';
}

const char *cb_likely_key(const struct cb_object *object, const char *key) {
    const char *likely = 0;
    uint32_t best = 3; /* more than two edits are no typing error */
    for (uint32_t i = 0; i < object->count; ++i) {
        const char *known = object->fields[i].key;
        if (lacks_end(known, key)) return known;
        const uint32_t edits = distance(known, key);
        if (edits >= best) continue;
        best = edits;
        likely = known;
    }
    return likely;
}
