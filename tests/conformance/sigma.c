/* SPDX-License-Identifier: MIT
 * The model's own sigma against tests/oracle/sigma.py. */
#include "models/sigma.h"

#include <stddef.h>

#include "tests/conformance/check.h"

struct sigma_row {
    struct cb_sigma at;
    float from[CB_SIGMA_DIRECTIONS];
    double variance, variance_bound, change, change_bound, sigma, sigma_bound;
};

#include "tests/conformance/vectors/sigma.inc"

void run_sigma(struct check *check) {
    check->subject = "state";
    for (check->row = 0; check->row < LENGTH(sigma_rows); ++check->row) {
        const struct sigma_row *row = &sigma_rows[check->row];
        check_number(check, "variance", cb_sigma_variance(&row->at), row->variance,
                     row->variance_bound);
        check_number(check, "change", cb_sigma_change(&row->at, row->from), row->change,
                     row->change_bound);
        check_number(check, "sigma", cb_sigma_um(&row->at), row->sigma, row->sigma_bound);
    }
}
