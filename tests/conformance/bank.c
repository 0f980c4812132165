/* SPDX-License-Identifier: MIT
 * Linear terms with a bank of lags, whose inputs have new values at different times, against
 * tests/oracle/bank.py. */
#include <stddef.h>
#include <string.h>

#include "firmware/box/box.h"
#include "firmware/terms/kinds.h"
#include "models/num.h"
#include "tests/conformance/check.h"

enum { INPUTS = 3, SPEED = 1, OUTPUTS = 2 };

struct bank_row {
    int64_t elapsed_us;
    unsigned fresh; /* bit i: input i has a new value */
    float x[INPUTS];
    double y0, y0_bound, y1, y1_bound, slope0, slope0_bound, slope1, slope1_bound;
};

struct bank_case {
    uint8_t links[2 * INPUTS];
    uint8_t taus;
    bool unlagged;
    unsigned columns;
    const float *pool;
    size_t pool_count;
    const struct bank_row *rows;
    size_t row_count;
};

#include "tests/conformance/vectors/bank.inc"

/* The directions of its sigma have weights and biases of the outputs: places are their values. */
static void make(struct cb_config *config, const struct bank_case *item) {
    static const float limits[INPUTS][2] = {{-10.0f, 90.0f}, {0.0f, 24000.0f}, {-150.0f, 150.0f}};
    memset(config, 0, sizeof *config);
    config->signals_count = INPUTS;
    config->terms_count = config->banks_count = 1;
    config->outputs_count = OUTPUTS;
    for (unsigned i = 0; i < INPUTS; ++i) {
        config->signals[i].min = limits[i][0];
        config->signals[i].max = limits[i][1];
    }
    config->bank_lags_count =
        (uint16_t)(item->columns / item->taus * (item->taus - (unsigned)item->unlagged));
    memcpy(config->links, item->links, sizeof item->links);
    memcpy(config->pool, item->pool, item->pool_count * sizeof item->pool[0]);
    const uint16_t sigma = (uint16_t)(item->pool_count + 2 * OUTPUTS);
    memcpy(config->pool + sigma, item->pool + item->taus + OUTPUTS * item->columns,
           OUTPUTS * sizeof item->pool[0]);
    memcpy(config->pool + sigma + OUTPUTS, item->pool + item->taus,
           OUTPUTS * item->columns * sizeof item->pool[0]);
    config->banks[0] = (struct cb_bank_config){.inputs = {0, INPUTS},
                                               .taus_count = item->taus,
                                               .unlagged = item->unlagged,
                                               .outputs = OUTPUTS,
                                               .directions = OUTPUTS,
                                               .sigma = (uint16_t)item->pool_count,
                                               .model = 1};
    config->terms[0] = (struct cb_term_config){.type = CB_TERM_LINEAR,
                                               .outputs = OUTPUTS,
                                               .as.linear = {{0, INPUTS}, item->taus, true, 0}};
}

static void check_row(struct check *check, struct cb_box *box, const struct bank_row *row) {
    float slopes[CB_MAX_OUTPUTS];
    box->life.now_us += row->elapsed_us;
    for (unsigned i = 0; i < INPUTS; ++i) {
        struct cb_signal_state *signal = &box->signals[i];
        if (!(row->fresh >> i & 1u)) continue;
        signal->value = signal->used = row->x[i];
        signal->time_us = box->life.now_us;
        signal->known = signal->fresh = true;
    }
    cb_banks_follow(&box->config, box->signals, &box->bank);
    cb_terms_evaluate(&box->config, box->signals, &box->bank, box->terms, &box->counters, 1.0f,
                      box->outputs);
    check_number(check, "first output", box->outputs[0], row->y0, row->y0_bound);
    check_number(check, "second output", box->outputs[1], row->y1, row->y1_bound);
    box->sigma.begun = false;
    cb_sigma_step(&box->config, box->signals, &box->bank, &box->sigma, box->life.now_us);
    check_number(check, "first place", box->sigma.place[0][0], row->y0, row->y0_bound);
    check_number(check, "second place", box->sigma.place[0][1], row->y1, row->y1_bound);
    cb_terms_slopes(&box->config, box->signals, box->terms, box->outputs, SPEED, slopes);
    check_number(check, "first slope", slopes[0], row->slope0, row->slope0_bound);
    check_number(check, "second slope", slopes[1], row->slope1, row->slope1_bound);
    for (unsigned i = 0; i < box->config.bank_lags_count; ++i)
        check_hash(check, cb_bits_of(box->bank.lags[i].lo));
}

void run_bank(struct check *check) {
    struct cb_box *box = &conformance_box;
    for (size_t i = 0; i < LENGTH(bank_cases); ++i) {
        const struct bank_case *item = &bank_cases[i];
        check->subject = "bank";
        make(&box->config, item);
        cb_box_start(box);
        for (check->row = 0; check->row < item->row_count; ++check->row)
            check_row(check, box, &item->rows[check->row]);
    }
}
