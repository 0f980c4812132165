/* SPDX-License-Identifier: MIT
 * The direction of travel and its blend against tests/oracle/direction.py. */
#include "models/direction.h"

#include <stddef.h>

#include "tests/conformance/check.h"

struct direction_row {
    float x, forward, forward_slope, backward, backward_slope;
    double blend, blend_bound, value, value_bound, slope, slope_bound;
};

struct direction_case {
    float start, width;
    const struct direction_row *rows;
    size_t row_count;
};

#include "tests/conformance/vectors/direction.inc"

void run_direction(struct check *check) {
    for (size_t i = 0; i < LENGTH(direction_cases); ++i) {
        const struct direction_case *item = &direction_cases[i];
        struct cb_direction direction;
        check->subject = "path";
        cb_direction_start(&direction, item->start, item->width);
        for (size_t j = 0; j < item->row_count; ++j) {
            const struct direction_row *row = &item->rows[j];
            const struct cb_curve_value forward = {row->forward, row->forward_slope, false};
            const struct cb_curve_value backward = {row->backward, row->backward_slope, false};
            check->row = (uint32_t)j;
            check_number(check, "blend", cb_direction_step(&direction, row->x, item->width),
                         row->blend, row->blend_bound);
            const struct cb_curve_value v =
                cb_direction_blend(&direction, item->width, forward, backward);
            check_number(check, "value", v.value, row->value, row->value_bound);
            check_number(check, "slope", v.slope, row->slope, row->slope_bound);
        }
    }
}
