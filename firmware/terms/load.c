/* SPDX-License-Identifier: MIT
 * The section "terms": kinds, names of outputs, and the order of evaluation. */
#include "firmware/terms/load.h"

#include <string.h>

#include "firmware/terms/kind.h"
#include "firmware/terms/kinds.h"
#include "firmware/terms/terms.h"

/* ---- helpers of the kinds ---- */

bool cb_take_pool(struct cb_loader *loader, uint32_t at, uint32_t count, uint16_t *offset) {
    struct cb_config *config = loader->config;
    const uint32_t left = CB_POOL_FLOATS - (uint32_t)config->pool_count;
    if (count > left)
        return cb_fail(loader, CB_ERROR_FULL, at,
                       "this needs %u floats, and of the box's %u only %u are left", count,
                       (uint32_t)CB_POOL_FLOATS, left);
    *offset = config->pool_count;
    config->pool_count = (uint16_t)(config->pool_count + count);
    return true;
}

bool cb_read_signal(struct cb_loader *loader, uint32_t at, uint8_t *signal) {
    const struct cb_config *config = loader->config;
    char name[CB_NAME_SIZE];
    if (!cb_read_name(loader, at, name)) return false;
    *signal = cb_find_name(config->signals, sizeof config->signals[0], config->signals_count, name);
    if (*signal != CB_NONE) return true;
    return cb_fail(loader, CB_ERROR_NAME, at, "no signal is called %o", at);
}

bool cb_read_output(struct cb_loader *loader, uint32_t at, uint8_t *output) {
    const struct cb_config *config = loader->config;
    char name[CB_NAME_SIZE];
    if (!cb_read_name(loader, at, name)) return false;
    *output = cb_find_name(config->outputs, sizeof config->outputs[0], config->outputs_count, name);
    if (*output != CB_NONE) return true;
    return cb_fail(loader, CB_ERROR_NAME, at, "no term has an output %o", at);
}

/* Appends the signal at `at` to config->links. in: link, start of the term's inputs there */
static bool add_input(struct cb_loader *loader, uint32_t at, uint16_t link) {
    struct cb_config *config = loader->config;
    uint8_t signal = 0;
    if (config->links_count == CB_MAX_LINKS)
        return cb_fail(loader, CB_ERROR_FULL, at, "the terms have more than %u inputs together",
                       (uint32_t)CB_MAX_LINKS);
    if (!cb_read_signal(loader, at, &signal)) return false;
    for (uint32_t i = link; i < config->links_count; ++i) {
        if (config->links[i] == signal)
            return cb_fail(loader, CB_ERROR_NAME, at, "%o occurs twice", at);
    }
    config->links[config->links_count++] = signal;
    return true;
}

bool cb_read_inputs(struct cb_loader *loader, uint32_t at, uint32_t most,
                    struct cb_term_inputs *inputs) {
    struct cb_list list = cb_list(loader, at);
    inputs->link = loader->config->links_count;
    for (inputs->count = 0; cb_list_next(&list); ++inputs->count) {
        if (!cb_list_has_room(loader, &list, most, "inputs of one term")) return false;
        if (!add_input(loader, list.at, inputs->link)) return false;
    }
    if (inputs->count > 0) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at, "at least one input is needed");
}

bool cb_read_vector(struct cb_loader *loader, uint32_t at, uint32_t count, const char *of,
                    float *numbers) {
    uint32_t found = 0;
    if (cb_token_at(loader, at).kind != CB_JSON_ARRAY)
        return cb_fail(loader, CB_ERROR_TYPE, at, "must be a list […], not %o", at);
    if (!cb_read_numbers(loader, at, numbers, count, &found)) return false;
    if (found == count) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at, "%u numbers for %u %s; each needs one", found, count,
                   of);
}

bool cb_read_vector_or(struct cb_loader *loader, uint32_t at, uint32_t count, const char *of,
                       float otherwise, float *numbers) {
    if (at != CB_ABSENT) return cb_read_vector(loader, at, count, of, numbers);
    for (uint32_t i = 0; i < count; ++i) numbers[i] = otherwise;
    return true;
}

bool cb_read_rows(struct cb_loader *loader, uint32_t at, uint32_t rows, const char *of_rows,
                  uint32_t columns, const char *of_columns, float *numbers) {
    struct cb_list list = cb_list(loader, at);
    uint32_t count = 0;
    for (; cb_list_next(&list); ++count) {
        if (count < rows && !cb_read_vector(loader, list.at, columns, of_columns, numbers))
            return false;
        numbers += count < rows ? columns : 0;
    }
    if (count == rows) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at, "%u rows for %u %s; each needs one", count, rows,
                   of_rows);
}

bool cb_check_least(struct cb_loader *loader, uint32_t at, const char *least, uint32_t count,
                    const float *numbers) {
    for (uint32_t i = 0; at != CB_ABSENT && i < count; ++i) {
        const uint32_t place = cb_list_at(loader, at, i);
        if (!(numbers[i] >= cb_number_of(least)))
            return cb_fail(loader, CB_ERROR_RANGE, place, "%o is below %s", place, least);
    }
    return true;
}

/* ---- kinds ---- */

#define WORD(NAME, name) {#name, CB_TERM_##NAME},
static const struct cb_word KIND_WORDS[] = {CB_TERM_KINDS(WORD){0, 0}};

/* The type is read before all other keys, because it determines them. */
static bool read_kind(struct cb_loader *loader, uint32_t at, uint8_t *kind) {
    const uint32_t type = cb_find_key(loader, at, "type");
    if (cb_token_at(loader, at).kind != CB_JSON_OBJECT)
        return cb_fail(loader, CB_ERROR_TYPE, at, "must be an object {…}, not %o", at);
    if (type == CB_ABSENT) return cb_fail(loader, CB_ERROR_KEY, at, "the key type is missing");
    return cb_read_word(loader, type, KIND_WORDS, kind);
}

/* ---- outputs ---- */

static bool add_output(struct cb_loader *loader, uint32_t at, uint8_t index,
                       struct cb_term_config *term) {
    struct cb_config *config = loader->config;
    if (config->outputs_count == CB_MAX_OUTPUTS)
        return cb_fail(loader, CB_ERROR_FULL, at, "the terms have more than %u outputs together",
                       (uint32_t)CB_MAX_OUTPUTS);
    struct cb_output_config *output = &config->outputs[config->outputs_count];
    if (!cb_read_name(loader, at, output->name)) return false;
    if (cb_find_name(config->outputs, sizeof *output, config->outputs_count, output->name) !=
        CB_NONE)
        return cb_fail(loader, CB_ERROR_NAME, at, "another output is called %o", at);
    output->term = index;
    ++config->outputs_count;
    ++term->outputs;
    return true;
}

/* in : list_slot, slot of the list of names; 0: one output, with the name of the term
 * out: the term's outputs in config->outputs; or false and a message */
static bool name_outputs(struct cb_loader *loader, const uint32_t *slots, uint8_t list_slot,
                         uint8_t index) {
    struct cb_term_config *term = &loader->config->terms[index];
    char name[CB_NAME_SIZE];
    term->first_output = loader->config->outputs_count;
    if (list_slot == 0) return add_output(loader, slots[CB_TERM_NAME], index, term);
    if (!cb_read_name(loader, slots[CB_TERM_NAME], name)) return false;
    struct cb_list list = cb_list(loader, slots[list_slot]);
    while (cb_list_next(&list)) {
        if (!cb_list_has_room(loader, &list, CB_MAX_TERM_OUTPUTS, "outputs of one term"))
            return false;
        if (!add_output(loader, list.at, index, term)) return false;
    }
    if (term->outputs > 0) return true;
    return cb_fail(loader, CB_ERROR_RANGE, slots[list_slot], "at least one output is needed");
}

static bool load_term(struct cb_loader *loader, uint32_t at, uint8_t index) {
    struct cb_term_config *term = &loader->config->terms[index];
    uint32_t slots[CB_MAX_FIELDS];
    if (!read_kind(loader, at, &term->type)) return false;
    const struct cb_term_kind *kind = cb_term_kinds[term->type];
    if (!cb_read_object(loader, at, &kind->object, &term->as, slots)) return false;
    const uint8_t list = slots[kind->outputs] != CB_ABSENT ? kind->outputs : 0;
    return name_outputs(loader, slots, list, index) && kind->load(loader, at, slots, term);
}

/* ---- order ---- */

/* out: the first term without a place that this one uses; CB_NONE: there is none */
static uint8_t missing_before(const struct cb_config *config, uint8_t index, const bool *placed) {
    unsigned count = 0;
    const uint8_t *used = cb_term_used(&config->terms[index], &count);
    for (unsigned k = 0; k < count; ++k) {
        if (used[k] == CB_NONE) continue;
        const uint8_t before = config->outputs[used[k]].term;
        if (!placed[before]) return before;
    }
    return CB_NONE;
}

/* in : index, a term without a place, so its chain of used terms leads to a circle
 * out: false, and a message at a term of that circle */
static bool refuse_circle(struct cb_loader *loader, uint32_t terms, uint8_t index,
                          const bool *placed) {
    const struct cb_config *config = loader->config;
    for (uint32_t i = 0; i < config->terms_count; ++i)
        index = missing_before(config, index, placed);
    const char *key = cb_term_kinds[config->terms[index].type]->uses_key;
    const uint32_t at = cb_find_key(loader, cb_list_at(loader, terms, index), key);
    return cb_fail(loader, CB_ERROR_ORDER, at, "this term depends on its own output");
}

/* out: order[terms_count]: every term after those that it uses, otherwise as in the file; false and
 *      a message for a circle */
static bool find_order(struct cb_loader *loader, uint32_t at, uint8_t *order) {
    const struct cb_config *config = loader->config;
    bool placed[CB_MAX_TERMS] = {false};
    for (uint32_t count = 0; count < config->terms_count;) {
        const uint32_t before = count;
        uint8_t left = 0;
        for (uint8_t i = 0; i < config->terms_count; ++i) {
            if (placed[i]) continue;
            left = i;
            if (missing_before(config, i, placed) != CB_NONE) continue;
            placed[i] = true;
            order[count++] = i;
        }
        if (count == before) return refuse_circle(loader, at, left, placed);
    }
    return true;
}

/* Sorts the terms by `order`; the indices of outputs do not change. */
static void put_in_order(struct cb_loader *loader, const uint8_t *order) {
    struct cb_config *config = loader->config;
    _Static_assert(sizeof config->terms <= sizeof loader->scratch->values, "room for all terms");
    memcpy(loader->scratch->values, config->terms, sizeof config->terms);
    for (uint8_t i = 0; i < config->terms_count; ++i) {
        struct cb_term_config *term = &config->terms[i];
        memcpy(term, (const char *)loader->scratch->values + order[i] * sizeof *term, sizeof *term);
        for (uint32_t k = 0; k < term->outputs; ++k)
            config->outputs[term->first_output + k].term = i;
    }
}

static bool link_terms(struct cb_loader *loader, uint32_t at) {
    struct cb_config *config = loader->config;
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        struct cb_term_config *term = &config->terms[list.index];
        const struct cb_term_kind *kind = cb_term_kinds[term->type];
        if (!kind->link) continue;
        if (!kind->link(loader, cb_find_key(loader, list.at, kind->uses_key), term)) return false;
    }
    return true;
}

bool cb_load_terms(struct cb_loader *loader, uint32_t at) {
    struct cb_config *config = loader->config;
    uint8_t order[CB_MAX_TERMS];
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        if (!cb_list_has_room(loader, &list, CB_MAX_TERMS, "terms")) return false;
        if (!load_term(loader, list.at, config->terms_count)) return false;
        ++config->terms_count;
    }
    if (config->terms_count == 0)
        return cb_fail(loader, CB_ERROR_KEY, at, "at least one term is needed");
    if (!link_terms(loader, at) || !find_order(loader, at, order)) return false;
    put_in_order(loader, order);
    return true;
}
