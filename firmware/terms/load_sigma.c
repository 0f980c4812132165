/* SPDX-License-Identifier: MIT
 * The sigma of a linear term with a bank, read from the file. */
#include "firmware/base/crc32.h"
#include "firmware/terms/columns.h"
#include "firmware/terms/load.h"
#include "firmware/terms/sigma.h"

#define MOST_SIGMA "1e6"

enum { FLOOR, ALONG, OFFSETS, DIRECTIONS, KEYS };
static const struct cb_field FIELDS[KEYS] = {
    [FLOOR] = {"floor_um", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [ALONG] = {"along_um", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [OFFSETS] = {"offsets", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [DIRECTIONS] = {"directions", CB_FIELD_ARRAY, true, CB_NOT_STORED},
};
const struct cb_object cb_sigma_object = {FIELDS, KEYS};

/* in : at, a list of one number for each output. out: sigma[outputs], each 0 … 1e6 */
static bool read_sigmas(struct cb_loader *loader, uint32_t at, uint32_t outputs, float *sigma) {
    if (!cb_read_vector(loader, at, outputs, "outputs", sigma)) return false;
    for (uint32_t k = 0; k < outputs; ++k) {
        if (!cb_read_float(loader, cb_list_at(loader, at, k), "0", MOST_SIGMA, &sigma[k]))
            return false;
    }
    return true;
}

/* out: *count, the number of offsets, 1 … CB_MAX_DIRECTIONS; these in scratch->values */
static bool read_offsets(struct cb_loader *loader, uint32_t at, uint32_t *count) {
    if (!cb_read_numbers(loader, at, loader->scratch->values, CB_MAX_DIRECTIONS, count))
        return false;
    if (*count > 0) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at, "at least one direction is needed");
}

/* in : offsets and weights of all directions in the pool
 * out: true if no sum exceeds 1e9 while the signals are within min … max */
static bool check_sums(struct cb_loader *loader, uint32_t at, const struct cb_bank_config *bank,
                       uint32_t columns) {
    const float *const offsets = loader->config->pool + bank->sigma + 2u * bank->outputs;
    for (uint32_t d = 0; d < bank->directions; ++d) {
        const float *const weights = offsets + bank->directions + d * columns;
        const float most = cb_columns_largest(loader->config, bank, weights) + cb_abs(offsets[d]);
        if (!(most <= CB_SIGMA_MOST_PLACE))
            return cb_fail(loader, CB_ERROR_RANGE, cb_list_at(loader, at, d),
                           "between min and max of its signals this sum exceeds 1e9");
    }
    return true;
}

/* out: a check sum of the bank's weights and biases, and of its sigma; never 0 */
static uint32_t model_of(const struct cb_config *config, const struct cb_term_config *term,
                         const struct cb_bank_config *bank, uint32_t columns, uint32_t floats) {
    const float *const weights = config->pool + term->as.linear.pool;
    uint32_t sum = cb_crc32(0, weights, term->outputs * (columns + 1u) * sizeof *weights);
    sum = cb_crc32(sum, config->pool + bank->sigma, floats * sizeof *config->pool);
    return sum != 0 ? sum : 1;
}

bool cb_sigma_load(struct cb_loader *loader, uint32_t at, uint32_t sigma_at,
                   const struct cb_term_config *term) {
    struct cb_config *config = loader->config;
    struct cb_bank_config *bank = &config->banks[term->as.linear.bank];
    const uint32_t outputs = term->outputs;
    const uint32_t columns =
        cb_columns_rows(cb_bank_sets(config, bank), bank->inputs.count) * bank->taus_count;
    uint32_t slots[KEYS], directions = 0;
    if (!cb_read_object(loader, sigma_at, &cb_sigma_object, NULL, slots) ||
        !read_offsets(loader, slots[OFFSETS], &directions))
        return false;
    const uint32_t floats = 2 * outputs + directions * (columns + 1);
    if (!cb_take_pool(loader, at, floats, &bank->sigma)) return false;
    float *const own = config->pool + bank->sigma;
    bank->directions = (uint8_t)directions;
    for (uint32_t d = 0; d < directions; ++d) own[2 * outputs + d] = loader->scratch->values[d];
    if (!read_sigmas(loader, slots[FLOOR], outputs, own) ||
        !read_sigmas(loader, slots[ALONG], outputs, own + outputs) ||
        !cb_read_rows(loader, slots[DIRECTIONS], directions, "offsets", columns,
                      "columns (input, power, time constant)", own + 2 * outputs + directions) ||
        !check_sums(loader, slots[DIRECTIONS], bank, columns))
        return false;
    bank->model = model_of(config, term, bank, columns, floats);
    return true;
}
