/* SPDX-License-Identifier: MIT
 * What is counted, each in the size of the reference load (S3's network, curves of 20 points). */
#ifndef COMPBOX_TESTS_GATES_SUBJECTS_H
#define COMPBOX_TESTS_GATES_SUBJECTS_H

#include <stdbool.h>

enum { SUBJECT_INPUTS = 19, SUBJECT_HIDDEN = 20, SUBJECT_OUTPUTS = 3, SUBJECT_LAGS = 24 };

/* Makes curve, network, lags and volumetric model; false when one of them cannot be made. */
bool subjects_make(void);

/* Moves all inputs to another place of their range (0 … 1), so that every path is taken. */
void subjects_move(float place);

/* One evaluation each. `nothing` loads two arguments, calls an empty function and keeps its result:
 * what a subject costs beside the function that it is about. */
void subject_nothing(void *unused);
void subject_multiply_adds(
    void *unused); /* the same layers without tanh: what a network costs at least */
void subject_network(void *unused);
void subject_network_with_linear_path(void *unused);
void subject_network_slope(void *unused);
void subject_training_range(void *unused);
void subject_spline(void *unused);
void subject_lag(void *unused);
void subject_lag_gains(void *unused);
void subject_volumetric(void *unused);
void subject_volumetric_derivative(void *unused);
void subject_direction(void *unused);
void subject_reference_load(void *unused); /* 18 splines, volumetric, network with guard, lags */

/* Planted faults, which the gate must see. */
void subject_two_splines(void *unused);
void subject_network_in_double(void *unused);

#endif
