/* SPDX-License-Identifier: MIT
 * Derived values of terms, which every step needs: the grids, each with its curves. */
#include "firmware/base/assert.h"
#include "firmware/terms/columns.h"
#include "firmware/terms/curves.h"
#include "firmware/terms/kinds.h"
#include "firmware/terms/sigma.h"

/* out: true for a curve of pieces without branches */
static bool is_plain(const struct cb_term_config *term) {
    const struct cb_curve_kind *curve = cb_term_kinds[term->type]->curve;
    return curve && curve->piecewise && !cb_term_has_branches(term);
}

/* out: true if signal, degree and breaks of the curve are those of the grid */
static bool on_grid(const struct cb_config *config, const struct cb_grid *grid,
                    const struct cb_curve_config *curve) {
    if (curve->signal != grid->signal || curve->degree != grid->degree ||
        curve->spans != grid->spans)
        return false;
    for (unsigned i = 0; i <= curve->spans; ++i) {
        if (config->pool[curve->pool + i] != config->pool[grid->breaks + i]) return false;
    }
    return true;
}

/* in : term, a plain curve without a grid; room: start of its grid's curves
 * out: number of curves on the new grid: the term and all later ones that share it */
static unsigned make_grid(struct cb_config *config, unsigned term, bool *placed,
                          struct cb_plain_curve *room) {
    struct cb_grid *grid = &config->grids[config->grids_count++];
    const struct cb_curve_config *first = &config->terms[term].as.curve;
    *grid = (struct cb_grid){.signal = first->signal,
                             .degree = first->degree,
                             .term = (uint8_t)term,
                             .spans_per_unit = first->spans_per_unit,
                             .spans = first->spans,
                             .breaks = first->pool};
    for (unsigned i = term; i < config->terms_count; ++i) {
        const struct cb_term_config *one = &config->terms[i];
        if (placed[i] || !is_plain(one) || !on_grid(config, grid, &one->as.curve)) continue;
        placed[i] = true;
        room[grid->curves++] = (struct cb_plain_curve){
            .coefficients = (uint16_t)(one->as.curve.pool + one->as.curve.spans + 1u),
            .term = (uint8_t)i,
            .output = one->first_output};
    }
    return grid->curves;
}

static void assert_pieces(const struct cb_curve_config *curve) {
    const uint32_t rows = curve->spans * (curve->degree + 1u);
    CB_ASSERT(curve->spans >= 1);
    CB_ASSERT(curve->degree <= CB_PPOLY_MAX_DEGREE);
    CB_ASSERT(curve->pool + curve->spans + 1u + rows <= CB_POOL_FLOATS);
}

/* in : lags_before, number of those of the banks before this one
 * out: number of its lags. No lag moves outside of the arrays. */
static unsigned assert_bank(const struct cb_config *config, const struct cb_bank_config *bank,
                            unsigned lags_before) {
    const unsigned sets = bank->inputs.link + bank->inputs.count;
    unsigned rows = 0;
    CB_ASSERT(sets + bank->inputs.count <= CB_MAX_LINKS);
    CB_ASSERT(bank->taus_count <= CB_MAX_BANK_TAUS);
    CB_ASSERT(bank->taus_count >= bank->unlagged);
    CB_ASSERT(bank->lags == lags_before);
    for (unsigned i = 0; i < bank->inputs.count; ++i) {
        CB_ASSERT(config->links[bank->inputs.link + i] < config->signals_count);
        rows += cb_bank_powers(config->links[sets + i]);
    }
    return rows * ((unsigned)bank->taus_count - bank->unlagged);
}

static void assert_banks(const struct cb_config *config) {
    unsigned lags = 0;
    for (unsigned i = 0; i < config->banks_count; ++i)
        lags += assert_bank(config, &config->banks[i], lags);
    CB_ASSERT(lags == config->bank_lags_count);
}

/* No term is evaluated outside of the arrays, whatever loaded it. */
static void assert_term(const struct cb_config *config, const struct cb_term_config *term) {
    CB_ASSERT(term->type < CB_TERM_TYPES);
    CB_ASSERT(term->outputs >= 1);
    CB_ASSERT(term->outputs <= CB_MAX_TERM_OUTPUTS);
    CB_ASSERT(term->first_output + term->outputs <= config->outputs_count);
    if (term->type == CB_TERM_LINEAR && term->as.linear.has_bank)
        CB_ASSERT(term->as.linear.bank < config->banks_count);
    const struct cb_curve_kind *kind = cb_term_kinds[term->type]->curve;
    if (!kind) return;
    const struct cb_curve_config *curve = &term->as.curve;
    CB_ASSERT(curve->signal < config->signals_count);
    if (kind->piecewise) assert_pieces(curve);
    if (!cb_term_has_branches(term)) return;
    CB_ASSERT(curve->backward < config->branches_count);
    if (kind->piecewise) assert_pieces(&config->branches[curve->backward]);
}

/* Lists the terms that probes adapt, so that a step without probes looks at none. */
static void derive_adapts(struct cb_config *config) {
    config->adapts_count = 0;
    for (unsigned i = 0; i < config->terms_count; ++i) {
        if (config->terms[i].type != CB_TERM_ADAPT) continue;
        const struct cb_adapt_config *adapt = &config->terms[i].as.adapt;
        CB_ASSERT(config->adapts_count < CB_MAX_ADAPTS);
        CB_ASSERT(adapt->output < config->outputs_count);
        CB_ASSERT(adapt->signals[0] < config->signals_count);
        CB_ASSERT(adapt->signals[1] < config->signals_count);
        const uint8_t channel = cb_adapt_channel(adapt);
        if (channel != CB_NONE) CB_ASSERT(channel < config->channels_count);
        config->adapts[config->adapts_count++] = (uint8_t)i;
    }
}

/* No direction is summed outside of the pool. in: rows of the bank */
static void assert_sigma(const struct cb_bank_config *bank, unsigned rows) {
    const unsigned floats = 2u * bank->outputs + bank->directions +
                            (unsigned)bank->directions * rows * bank->taus_count;
    CB_ASSERT(bank->outputs >= 1);
    CB_ASSERT(bank->outputs <= CB_MAX_TERM_OUTPUTS);
    CB_ASSERT(bank->directions <= CB_MAX_DIRECTIONS);
    CB_ASSERT(bank->sigma + floats <= CB_POOL_FLOATS);
}

/* A pass over the rows of all banks with a sigma takes a second, or a row in each step. */
static void derive_sigma(struct cb_config *config) {
    uint64_t rows = 0;
    for (unsigned i = 0; i < config->banks_count; ++i) {
        const struct cb_bank_config *bank = &config->banks[i];
        const unsigned own = cb_columns_rows(cb_bank_sets(config, bank), bank->inputs.count);
        if (bank->model == 0) continue;
        assert_sigma(bank, own);
        rows += own;
    }
    config->sigma_rows =
        (uint16_t)((rows * config->period_us + CB_SIGMA_PASS_US - 1) / CB_SIGMA_PASS_US);
}

void cb_terms_derive(struct cb_config *config) {
    bool placed[CB_MAX_TERMS] = {false};
    unsigned curves = 0;
    config->grids_count = config->other_terms_count = 0;
    assert_banks(config);
    for (unsigned i = 0; i < config->terms_count; ++i) {
        assert_term(config, &config->terms[i]);
        if (!is_plain(&config->terms[i]))
            config->other_terms[config->other_terms_count++] = (uint8_t)i;
        else if (!placed[i])
            curves += make_grid(config, i, placed, config->plain_curves + curves);
    }
    derive_adapts(config);
    derive_sigma(config);
    for (unsigned i = 0; i < config->outputs_count; ++i)
        config->output_terms[i] = config->outputs[i].term;
}
