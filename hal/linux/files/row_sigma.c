/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/row_sigma.h"

#include <math.h>

#include "firmware/terms/kinds.h"

bool cb_row_has_sigma(const struct cb_config *config, unsigned output) {
    const unsigned index = config->outputs[output].term;
    if (index >= CB_MAX_TERMS) return false;
    const struct cb_term_config *term = &config->terms[index];
    if (term->type == CB_TERM_ADAPT) return true;
    if (term->type != CB_TERM_LINEAR || !term->as.linear.has_bank) return false;
    return term->as.linear.bank < CB_MAX_BANKS && config->banks[term->as.linear.bank].model != 0;
}

void cb_row_take_sigmas(struct cb_row *row, const struct cb_box *box) {
    const struct cb_config *config = &box->config;
    for (unsigned i = 0; i < CB_MAX_OUTPUTS; i++) row->sigma_um[i] = NAN;
    if (box->config_corrupt) return;
    for (unsigned i = 0; i < config->outputs_count && config->sigma_rows > 0; i++) {
        const struct cb_sigma sigma = cb_sigma_of(config, &box->sigma, (uint8_t)i);
        if (sigma.model != 0) row->sigma_um[i] = cb_sigma_um(&sigma);
    }
    for (unsigned i = 0; i < config->adapts_count; i++) {
        const unsigned output = config->terms[config->adapts[i]].first_output;
        row->sigma_um[output] =
            cb_probe_sigma(config, i, &box->probes[i], &box->sigma, box->outputs, box->life.now_us);
    }
}
