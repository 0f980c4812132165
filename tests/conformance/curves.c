/* SPDX-License-Identifier: MIT
 * B-spline, polyline and polynomial against tests/oracle/curves.py. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#include "models/bspline.h"
#include "models/polyline.h"
#include "models/polynomial.h"
#include "tests/conformance/check.h"
#include "tests/support/ppoly_search.h"

struct cb_curve_row {
    float x;
    double value, value_bound;
    double slope, slope_bound;
    bool outside;
};

struct bspline_case {
    const char *title;
    uint8_t degree;
    uint16_t count;
    const float *knots, *points;
    const struct cb_curve_row *rows;
    size_t row_count;
};

struct polyline_case {
    const char *title;
    uint16_t count;
    const float *x, *y;
    const struct cb_curve_row *rows;
    size_t row_count;
};

struct polynomial_case {
    const char *title;
    struct cb_polynomial polynomial;
    const struct cb_curve_row *rows;
    size_t row_count;
};

#include "tests/conformance/vectors/bspline.inc"
#include "tests/conformance/vectors/polyline.inc"
#include "tests/conformance/vectors/polynomial.inc"

enum { MAX_SPANS = 32 };
static float breaks[MAX_SPANS + 1];
static float coefficients[MAX_SPANS * (CB_PPOLY_MAX_DEGREE + 1)];

static void check_row(struct check *check, const struct cb_curve_row *row,
                      struct cb_curve_value got) {
    check_number(check, "value", got.value, row->value, row->value_bound);
    check_number(check, "slope", got.slope, row->slope, row->slope_bound);
    check_equal(check, "outside", got.outside, row->outside);
}

/* in : a converted curve
 * Every row through both evaluations, with the span computed (if it is) and searched. */
static void check_ppoly(struct check *check, const struct cb_ppoly *curve,
                        const struct cb_curve_row *rows, size_t row_count) {
    struct cb_ppoly searched = *curve;
    searched.spans_per_unit = 0.0f;
    check_equal(check, "finite", cb_ppoly_is_finite(curve), true);
    for (size_t i = 0; i < row_count; ++i) {
        check->row = (uint32_t)i;
        check_row(check, &rows[i], cb_ppoly_evaluate(curve, rows[i].x));
        check_row(check, &rows[i], cb_ppoly_evaluate(&searched, rows[i].x));
        check_number(check, "value alone", searched_value(curve, rows[i].x), rows[i].value,
                     rows[i].value_bound);
    }
}

void run_bspline(struct check *check) {
    for (size_t i = 0; i < LENGTH(bspline_cases); ++i) {
        const struct bspline_case *item = &bspline_cases[i];
        const struct cb_bspline spline = {item->knots, item->points, item->count, item->degree};
        struct cb_ppoly curve;
        uint16_t at;
        check->subject = item->title;
        check_equal(check, "check", cb_bspline_check(&spline, &at), CB_BSPLINE_OK);
        check_equal(check, "room", cb_bspline_spans(&spline) <= MAX_SPANS, true);
        cb_bspline_to_ppoly(&spline, breaks, coefficients, &curve);
        check_ppoly(check, &curve, item->rows, item->row_count);
    }
}

void run_polyline(struct check *check) {
    for (size_t i = 0; i < LENGTH(polyline_cases); ++i) {
        const struct polyline_case *item = &polyline_cases[i];
        struct cb_ppoly curve;
        check->subject = item->title;
        cb_polyline_to_ppoly(item->x, item->y, item->count, breaks, coefficients, &curve);
        check_ppoly(check, &curve, item->rows, item->row_count);
    }
}

void run_polynomial(struct check *check) {
    for (size_t i = 0; i < LENGTH(polynomial_cases); ++i) {
        const struct polynomial_case *item = &polynomial_cases[i];
        check->subject = item->title;
        check_equal(check, "finite", cb_polynomial_is_finite(&item->polynomial), true);
        for (size_t j = 0; j < item->row_count; ++j) {
            check->row = (uint32_t)j;
            check_row(check, &item->rows[j],
                      cb_polynomial_evaluate(&item->polynomial, item->rows[j].x));
        }
    }
}
