/* SPDX-License-Identifier: MIT */
#include "models/volumetric.h"

/* out: 0 … 2 for X, Y, Z; CB_AXES otherwise */
static unsigned axis_of(char letter) {
    return letter >= 'X' && letter <= 'Z' ? (unsigned)(letter - 'X') : CB_AXES;
}

/* in : chain, whose letters are axes or 'f', with the foundation at index f
 * out: the axes whose positions add to the lever of the axis at index i, as bits */
static unsigned moves_of(const char *chain, unsigned f, unsigned i) {
    const unsigned from = i < f ? i : i + 1; /* workpiece side: the axis itself and all to its
                                                right */
    unsigned moves = 0;
    for (unsigned j = from; j < CB_AXES + 1; ++j) {
        if (j != f) moves |= 1u << axis_of(chain[j]);
    }
    return moves;
}

bool cb_volumetric_chain(const char *chain, uint8_t moves[CB_AXES]) {
    unsigned seen = 0, f = 0, length = 0;
    for (; chain[length] != '\0'; ++length) {
        const unsigned axis = axis_of(chain[length]);
        if (length > CB_AXES || (axis == CB_AXES && chain[length] != 'f')) return false;
        if (axis == CB_AXES) f = length;
        seen |= 1u << axis;
    }
    if (length != CB_AXES + 1 || seen != (1u << length) - 1u) return false;
    for (unsigned i = 0; i < length; ++i) {
        if (i != f) moves[axis_of(chain[i])] = (uint8_t)moves_of(chain, f, i);
    }
    return true;
}

int cb_volumetric_error(const char *name) {
    static const char squareness[3][4] = {"C0Y", "B0Z", "A0Z"};
    static const char kinds[] = "XYZABC";
    if (name[0] == '\0' || name[1] == '\0' || name[2] == '\0' || name[3] != '\0') return -1;
    for (int i = 0; i < 3; ++i) {
        const char *const s = squareness[i];
        if (name[0] == s[0] && name[1] == s[1] && name[2] == s[2]) return CB_CURVE_ERRORS + i;
    }
    const unsigned axis = axis_of(name[2]);
    for (int k = 0; name[0] == 'E' && axis < CB_AXES && k < CB_AXIS_ERRORS; ++k) {
        if (name[1] == kinds[k]) return (int)axis * CB_AXIS_ERRORS + k;
    }
    return -1;
}

/* in : tool, from the spindle to the tip in mm
 * out: L_a in mm */
static inline void lever(const struct cb_volumetric *model, const float position_mm[CB_AXES],
                         const float tool[3], unsigned axis, float mm[3]) {
    const uint8_t moves = model->moves[axis];
    for (unsigned c = 0; c < 3; ++c) {
        const float at_0 = model->lever_mm[axis][c] + tool[c];
        mm[c] = moves >> c & 1u ? at_0 + position_mm[c] : at_0;
    }
}

/* out: tool, the vector from the spindle to the tip in mm */
static inline void tool_vector(const struct cb_volumetric *model, float tool_mm, float tool[3]) {
    for (unsigned c = 0; c < 3; ++c) tool[c] = tool_mm * model->tool[c];
}

/* sum += a x b */
static inline void add_cross(const float a[3], const float b[3], float sum[3]) {
    sum[0] += a[1] * b[2] - a[2] * b[1];
    sum[1] += a[2] * b[0] - a[0] * b[2];
    sum[2] += a[0] * b[1] - a[1] * b[0];
}

void cb_volumetric_evaluate(const struct cb_volumetric *model,
                            const struct cb_volumetric_state *state, float e_um[3]) {
    const float *const c0y_b0z_a0z = model->squareness_urad;
    const float y = state->position_mm[CB_AXIS_Y], z = state->position_mm[CB_AXIS_Z];
    float turned[3] = {c0y_b0z_a0z[1] * z - c0y_b0z_a0z[0] * y, -c0y_b0z_a0z[2] * z, 0.0f};
    float tool[3];
    tool_vector(model, state->tool_mm, tool);
    for (unsigned a = 0; a < CB_AXES; ++a) {
        float mm[3];
        lever(model, state->position_mm, tool, a, mm);
        add_cross(state->error + a * CB_AXIS_ERRORS + 3, mm, turned);
    }
    const float *const ex = state->error, *const ey = ex + CB_AXIS_ERRORS;
    const float *const ez = ey + CB_AXIS_ERRORS;
    for (unsigned c = 0; c < 3; ++c) e_um[c] = ((ex[c] + ey[c]) + ez[c]) + 0.001f * turned[c];
}

/* Product rule for each axis: d (eps x L) = d eps x L + eps x d L. */
void cb_volumetric_derivative(const struct cb_volumetric *model,
                              const struct cb_volumetric_state *state,
                              const struct cb_volumetric_state *rate, float d_um[3]) {
    const float *const c0y_b0z_a0z = model->squareness_urad;
    const float y = rate->position_mm[CB_AXIS_Y], z = rate->position_mm[CB_AXIS_Z];
    float turned[3] = {c0y_b0z_a0z[1] * z - c0y_b0z_a0z[0] * y, -c0y_b0z_a0z[2] * z, 0.0f};
    float tool[3], tool_rate[3];
    tool_vector(model, state->tool_mm, tool);
    tool_vector(model, rate->tool_mm, tool_rate);
    for (unsigned a = 0; a < CB_AXES; ++a) {
        float mm[3], mm_rate[3];
        lever(model, state->position_mm, tool, a, mm);
        for (unsigned c = 0; c < 3; ++c)
            mm_rate[c] = tool_rate[c] + (model->moves[a] >> c & 1u ? rate->position_mm[c] : 0.0f);
        add_cross(rate->error + a * CB_AXIS_ERRORS + 3, mm, turned);
        add_cross(state->error + a * CB_AXIS_ERRORS + 3, mm_rate, turned);
    }
    const float *const ex = rate->error, *const ey = ex + CB_AXIS_ERRORS;
    const float *const ez = ey + CB_AXIS_ERRORS;
    for (unsigned c = 0; c < 3; ++c) d_um[c] = ((ex[c] + ey[c]) + ez[c]) + 0.001f * turned[c];
}
