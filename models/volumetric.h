/* SPDX-License-Identifier: MIT
 * The 21 geometric errors of a serial three-axis machine, brought to the tool tip.
 *
 *   E = sum over the axes a of (delta_a + 1e-3 eps_a x L_a) + squareness
 *       E, delta in µm, eps in µrad, L in mm
 *
 * Frames are parallel to the machine's and right-handed; a position counts up when the tool moves
 * in + relative to the workpiece (ISO 841), whichever of the two moves. Errors are those of the
 * tool relative to the workpiece, as a laser between tool and table shows them, so an axis that
 * carries the workpiece has the same sign as one that carries the tool.
 *
 * L_a = tool tip - reference point of carriage a. With all axes at 0 that is lever_mm[a] + tool
 * length * tool; the positions that add to it, each along its own axis, are
 *   tool side       those of the axes between a and the tool
 *   workpiece side  that of a itself, of the axes between a and the foundation, of all tool axes
 *
 * Squareness (ISO 230-1 names, travel counts from position 0, zero where the straightness curves
 * keep their slope): the direction in which Y moves is turned by C0Y about +Z, that of Z by B0Z
 * about +Y and by A0Z about +X; X is the primary axis:
 *   E_x += 1e-3 (B0Z z - C0Y y)      E_y -= 1e-3 A0Z z
 * So C0Y > 0 opens the angle between +X and +Y, A0Z > 0 opens that between +Y and +Z, and B0Z > 0
 * closes that between +X and +Z.
 *
 * Small angles: full matrices differ by at most 1e-9 A^2 L + 1e-6 A D µm, with A the sum of all
 * angles (µrad), D of all |delta| (µm), L the largest |lever| + tool + sum of the |positions| (mm).
 * tests/oracle/volumetric.py holds that for every chain and prints what it finds: 0.05 µm for
 * angles up to 60 µrad, translations up to 200 µm and travels of 3 m. */
#ifndef COMPBOX_MODELS_VOLUMETRIC_H
#define COMPBOX_MODELS_VOLUMETRIC_H

#include <stdbool.h>
#include <stdint.h>

enum cb_axis { CB_AXIS_X, CB_AXIS_Y, CB_AXIS_Z, CB_AXES };

/* Errors of one axis, in the order of ISO 230-1: three translations (µm), three rotations (µrad).
 * Error k of axis a has the index a * CB_AXIS_ERRORS + k; the squareness errors follow. */
enum {
    CB_AXIS_ERRORS = 6,
    CB_CURVE_ERRORS = CB_AXES * CB_AXIS_ERRORS,
    CB_ERROR_C0Y = CB_CURVE_ERRORS,
    CB_ERROR_B0Z,
    CB_ERROR_A0Z, /* the last of 21 */
};

struct cb_volumetric {
    float lever_mm[CB_AXES][3]; /* tool tip without tool - reference point, all axes at 0 */
    float tool[3];              /* unit vector from the spindle to the tip; (0, 0, -1) on most
                                   machines */
    float squareness_urad[3];   /* C0Y, B0Z, A0Z */
    uint8_t moves[CB_AXES];     /* bit c of moves[a]: position c adds to L_a */
};

/* State of the machine at one moment. Unmeasured errors are 0. */
struct cb_volumetric_state {
    float position_mm[CB_AXES];
    float tool_mm;                /* tool length */
    float error[CB_CURVE_ERRORS]; /* each curve at the position of its own axis; µm, µrad */
};

/* in : chain, "f" (foundation) and X, Y, Z once each; left of f the axes that carry the workpiece,
 *      right of f those that carry the tool: "fXYZ", "YfXZ", "XYfZ" …
 * out: true and moves[]; false for any other text */
bool cb_volumetric_chain(const char *chain, uint8_t moves[CB_AXES]);

/* out: index of an error by its ISO name ("EXX" … "ECZ", "C0Y", "B0Z", "A0Z"), -1 if unknown */
int cb_volumetric_error(const char *name);

/* out: e_um = E, tool tip relative to workpiece. Rounding: 12 * 2^-24 of the sum of the terms'
 *      sizes. With translations alone the result is exactly (X + Y) + Z in each direction: the
 *      superposition of S1. */
void cb_volumetric_evaluate(const struct cb_volumetric *model,
                            const struct cb_volumetric_state *state, float e_um[3]);

/* The derivative for any motion of the machine, with errors that change along it.
 * in : rate, the change of each number of *state per unit of the motion
 * out: d_um, the change of E per unit of the motion */
void cb_volumetric_derivative(const struct cb_volumetric *model,
                              const struct cb_volumetric_state *state,
                              const struct cb_volumetric_state *rate, float d_um[3]);

#endif
