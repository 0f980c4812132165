/* SPDX-License-Identifier: MIT
 * The bank of a linear term, read from the file. */
#include "firmware/terms/columns.h"
#include "firmware/terms/load.h"
#include "firmware/terms/ranges.h"
#include "models/power.h"

#define LEAST_TAU "0.001" /* as tau_s of a lag */
#define MOST_TAU "86400"
#define COLUMNS "columns (input, power, time constant)"

enum { INPUTS, POWERS, TAU, WEIGHTS, BIAS, RANGE, KEYS = RANGE + CB_RANGE_KEYS };
static const struct cb_field FIELDS[KEYS] = {
    [INPUTS] = {"inputs", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [POWERS] = {"powers", CB_FIELD_OBJECT, false, CB_NOT_STORED},
    [TAU] = {"tau_s", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [WEIGHTS] = {"weights", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [BIAS] = {"bias", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    CB_RANGE_FIELDS(RANGE, false),
};
const struct cb_object cb_bank_object = {FIELDS, KEYS};

/* ---- powers ---- */

/* in : at, a list of powers. out: *set: bit p - 1 is the power p */
static bool read_set(struct cb_loader *loader, uint32_t at, uint8_t *set) {
    uint32_t power = 0, before = CB_ABSENT;
    if (cb_token_at(loader, at).kind != CB_JSON_ARRAY)
        return cb_fail(loader, CB_ERROR_TYPE, at, "must be a list […], not %o", at);
    struct cb_list list = cb_list(loader, at);
    for (; cb_list_next(&list); before = list.at) {
        if (!cb_read_whole(loader, list.at, "1", "4", &power)) return false;
        if (*set >> (power - 1) != 0)
            return cb_fail(loader, CB_ERROR_ORDER, list.at,
                           "%o is not above the power before it (%o)", list.at, before);
        *set = (uint8_t)(*set | 1u << (power - 1));
    }
    if (*set != 0) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at, "at least one power is needed");
}
_Static_assert(CB_MAX_BANK_POWER == 4, "the most that read_set() accepts");

/* in : sets[inputs], all 0. out: those of the inputs that the object at `at` names */
static bool read_named_sets(struct cb_loader *loader, uint32_t at,
                            const struct cb_bank_config *bank, uint8_t *sets) {
    const uint8_t *const inputs = loader->config->links + bank->inputs.link;
    struct cb_members members = cb_members(loader, at);
    while (cb_members_next(&members)) {
        uint8_t signal = 0;
        unsigned i = 0;
        if (!cb_read_signal(loader, members.key.at, &signal)) return false;
        while (i < bank->inputs.count && inputs[i] != signal) ++i;
        if (i == bank->inputs.count)
            return cb_fail(loader, CB_ERROR_NAME, members.key.at, "%o is no input of this bank",
                           members.key.at);
        if (sets[i] != 0)
            return cb_fail(loader, CB_ERROR_KEY, members.key.at, "this key occurs twice");
        if (!read_set(loader, members.at, &sets[i])) return false;
    }
    return true;
}

/* in : at, the object of powers, or CB_ABSENT
 * out: a set of powers of each input behind the inputs in config->links; *rows, their number */
static bool read_powers(struct cb_loader *loader, uint32_t at, uint32_t inputs_at,
                        const struct cb_bank_config *bank, uint32_t *rows) {
    struct cb_config *config = loader->config;
    uint8_t *const sets = config->links + bank->inputs.link + bank->inputs.count;
    if (config->links_count + bank->inputs.count > CB_MAX_LINKS)
        return cb_fail(loader, CB_ERROR_FULL, inputs_at,
                       "the terms have more than %u inputs together; an input of a bank counts "
                       "twice",
                       (uint32_t)CB_MAX_LINKS);
    config->links_count = (uint16_t)(config->links_count + bank->inputs.count);
    if (at != CB_ABSENT && !read_named_sets(loader, at, bank, sets)) return false;
    *rows = 0;
    for (unsigned i = 0; i < bank->inputs.count; ++i) {
        if (sets[i] == 0) sets[i] = 1;
        *rows += cb_bank_powers(sets[i]);
    }
    return true;
}

/* ---- time constants ---- */

/* in : taus[i], the number at `at`
 * out: true if it is 0, the first of all, or a time constant above the one before it */
static bool check_tau(struct cb_loader *loader, uint32_t list_at, uint32_t i, const float *taus) {
    const uint32_t at = cb_list_at(loader, list_at, i);
    if (i > 0 && !(taus[i] > taus[i - 1]))
        return cb_fail(loader, CB_ERROR_ORDER, at,
                       "%o is not above the time constant before it (%o)", at,
                       cb_list_at(loader, list_at, i - 1));
    if (taus[i] == 0.0f) return true;
    if (taus[i] >= cb_number_of(LEAST_TAU) && taus[i] <= cb_number_of(MOST_TAU)) return true;
    return cb_fail(
        loader, CB_ERROR_RANGE, at,
        "%o is outside the range of " LEAST_TAU " to " MOST_TAU "; 0 is the input itself", at);
}

/* out: bank->taus_count, unlagged; the time constants in scratch->values */
static bool read_taus(struct cb_loader *loader, uint32_t at, struct cb_bank_config *bank) {
    float *const taus = loader->scratch->values;
    uint32_t count = 0;
    if (!cb_read_numbers(loader, at, taus, CB_MAX_BANK_TAUS, &count)) return false;
    if (count == 0)
        return cb_fail(loader, CB_ERROR_RANGE, at,
                       "at least one time constant is needed; 0 is the input itself");
    for (uint32_t i = 0; i < count; ++i)
        if (!check_tau(loader, at, i, taus)) return false;
    bank->taus_count = (uint8_t)count;
    bank->unlagged = taus[0] == 0.0f;
    return true;
}

/* ---- memory ---- */

/* in : at, the term, for messages; rows of inputs and powers; time constants in scratch->values
 * out: bank->lags, taus; linear->pool for `floats` more */
static bool take_memory(struct cb_loader *loader, uint32_t at, uint32_t rows, uint32_t floats,
                        struct cb_bank_config *bank, struct cb_linear_config *linear) {
    struct cb_config *config = loader->config;
    const uint32_t left = CB_MAX_BANK_LAGS - (uint32_t)config->bank_lags_count;
    const uint32_t lags = rows * ((uint32_t)bank->taus_count - bank->unlagged);
    if (lags > left)
        return cb_fail(loader, CB_ERROR_FULL, at,
                       "this bank needs %u lags, and of the box's %u only %u are left", lags,
                       (uint32_t)CB_MAX_BANK_LAGS, left);
    bank->lags = config->bank_lags_count;
    config->bank_lags_count = (uint16_t)(config->bank_lags_count + lags);
    if (!cb_take_pool(loader, at, bank->taus_count + floats, &bank->taus)) return false;
    for (uint32_t i = 0; i < bank->taus_count; ++i)
        config->pool[bank->taus + i] = loader->scratch->values[i];
    linear->pool = (uint16_t)(bank->taus + bank->taus_count);
    return true;
}

/* ---- bounds ---- */

float cb_columns_largest(const struct cb_config *config, const struct cb_bank_config *bank,
                         const float *weights) {
    float sum = 0.0f;
    for (uint32_t i = 0; i < bank->inputs.count; ++i) {
        const struct cb_signal_config *signal =
            &config->signals[config->links[bank->inputs.link + i]];
        for (unsigned power = 1; cb_bank_sets(config, bank)[i] >> (power - 1) != 0; ++power) {
            if (!(cb_bank_sets(config, bank)[i] >> (power - 1) & 1u)) continue;
            const struct cb_interval x = cb_power_range(signal->min, signal->max, power);
            const float size = cb_max(cb_abs(x.min), cb_abs(x.max));
            for (unsigned t = 0; t < bank->taus_count; ++t) sum += cb_abs(*weights++) * size;
        }
    }
    return sum;
}
_Static_assert(CB_MAX_BANK_POWER <= 4, "a power of 1e9 fits into a float");

/* in : the bank loaded, its weights and biases at linear->pool
 * out: true if no sum exceeds 1e9 while the signals are within min … max */
static bool check_sums(struct cb_loader *loader, uint32_t weights_at, uint32_t columns,
                       const struct cb_bank_config *bank, const struct cb_term_config *term) {
    const float *const weights = loader->config->pool + term->as.linear.pool;
    for (uint32_t k = 0; k < term->outputs; ++k) {
        const float bias = cb_abs(weights[term->outputs * columns + k]);
        const float most = cb_columns_largest(loader->config, bank, weights + k * columns) + bias;
        if (!(most <= cb_number_of(CB_MOST_NUMBER)))
            return cb_fail(loader, CB_ERROR_RANGE, cb_list_at(loader, weights_at, k),
                           "between min and max of its signals this sum exceeds 1e9 µm");
    }
    return true;
}

/* ---- load ---- */

/* out: bank->trained and ranges, if the file has any of their keys */
static bool read_ranges(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                        struct cb_bank_config *bank) {
    for (unsigned i = 0; i < CB_RANGE_KEYS; ++i)
        bank->trained = bank->trained || slots[RANGE + i] != CB_ABSENT;
    if (!bank->trained) return true;
    for (unsigned i = CB_RANGE_MIN; i <= CB_RANGE_MAX; ++i) {
        if (slots[RANGE + i] == CB_ABSENT)
            return cb_fail(loader, CB_ERROR_KEY, at, "the key %s is missing",
                           FIELDS[RANGE + i].key);
    }
    return cb_read_ranges(loader, at, slots + RANGE, bank->inputs.count, &bank->ranges);
}

bool cb_columns_load(struct cb_loader *loader, uint32_t at, uint32_t bank_at,
                     struct cb_term_config *term) {
    struct cb_config *config = loader->config;
    struct cb_linear_config *linear = &term->as.linear;
    struct cb_bank_config *bank = &config->banks[config->banks_count];
    uint32_t slots[KEYS], rows = 0;
    if (config->banks_count == CB_MAX_BANKS)
        return cb_fail(loader, CB_ERROR_FULL, bank_at, "the terms have more than %u banks together",
                       (uint32_t)CB_MAX_BANKS);
    if (!cb_read_object(loader, bank_at, &cb_bank_object, NULL, slots) ||
        !cb_read_inputs(loader, slots[INPUTS], CB_MAX_SIGNALS, &bank->inputs) ||
        !read_powers(loader, slots[POWERS], slots[INPUTS], bank, &rows) ||
        !read_taus(loader, slots[TAU], bank))
        return false;
    const uint32_t columns = rows * bank->taus_count, outputs = term->outputs;
    if (!take_memory(loader, at, rows, outputs * (columns + 1), bank, linear)) return false;
    float *const weights = config->pool + linear->pool;
    if (!cb_read_rows(loader, slots[WEIGHTS], outputs, "outputs", columns, COLUMNS, weights) ||
        !cb_read_vector_or(loader, slots[BIAS], outputs, "outputs", 0.0f,
                           weights + outputs * columns) ||
        !check_sums(loader, slots[WEIGHTS], columns, bank, term) ||
        !read_ranges(loader, bank_at, slots, bank))
        return false;
    bank->outputs = term->outputs;
    linear->inputs = bank->inputs;
    linear->has_bank = true;
    linear->bank = config->banks_count++;
    return true;
}
