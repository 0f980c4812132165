/* SPDX-License-Identifier: MIT
 * Terms of type volumetric: chain, levers, squareness, and the terms of its errors
 * (models/volumetric.h). */
#include "models/volumetric.h"

#include <string.h>

#include "firmware/terms/kind.h"
#include "firmware/terms/load.h"
#include "models/num.h"

enum {
    OUTPUTS = CB_TERM_COMMON_KEYS,
    CHAIN,
    ERRORS,
    POSITIONS,
    REFERENCE_POINTS,
    TOOL_OFFSET,
    TOOL_DIRECTION,
    TOOL_LENGTH,
    TOOL_LENGTH_MM,
    SQUARENESS,
    KEYS
};

static const struct cb_field FIELDS[KEYS] = {
    CB_TERM_COMMON_FIELDS,
    [OUTPUTS] = {"outputs", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [CHAIN] = {"chain", CB_FIELD_STRING, true, CB_NOT_STORED},
    [ERRORS] = {"errors", CB_FIELD_ARRAY, true, CB_NOT_STORED},
    [POSITIONS] = {"positions", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [REFERENCE_POINTS] = {"reference_points_mm", CB_FIELD_OBJECT, false, CB_NOT_STORED},
    [TOOL_OFFSET] = {"tool_offset_mm", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [TOOL_DIRECTION] = {"tool_direction", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [TOOL_LENGTH] = {"tool_length", CB_FIELD_STRING, false, CB_NOT_STORED},
    [TOOL_LENGTH_MM] = {"tool_length_mm", CB_FIELD_ANY, false, CB_NOT_STORED},
    [SQUARENESS] = {"squareness_urad", CB_FIELD_OBJECT, false, CB_NOT_STORED},
};

static const struct cb_field REFERENCE_FIELDS[CB_AXES] = {
    [CB_AXIS_X] = {"X", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [CB_AXIS_Y] = {"Y", CB_FIELD_ARRAY, false, CB_NOT_STORED},
    [CB_AXIS_Z] = {"Z", CB_FIELD_ARRAY, false, CB_NOT_STORED},
};
static const struct cb_object REFERENCE_POINTS_OBJECT = {REFERENCE_FIELDS, CB_AXES};

enum { C0Y, B0Z, A0Z, SQUARENESS_KEYS };
static const struct cb_field SQUARENESS_FIELDS[SQUARENESS_KEYS] = {
    [C0Y] = {"C0Y", CB_FIELD_FLOAT, false, .offset = 0, .least = "-100000", .most = "100000",
             .otherwise = "0"},
    [B0Z] = {"B0Z", CB_FIELD_FLOAT, false, .offset = 4, .least = "-100000", .most = "100000",
             .otherwise = "0"},
    [A0Z] = {"A0Z", CB_FIELD_FLOAT, false, .offset = 8, .least = "-100000", .most = "100000",
             .otherwise = "0"},
};
static const struct cb_object SQUARENESS_OBJECT = {SQUARENESS_FIELDS, SQUARENESS_KEYS};

_Static_assert(sizeof(struct cb_volumetric) % sizeof(float) == 0, "stored in the pool as floats");
enum { TOOL = CB_AXES }; /* index of the tool length in `signals` */
enum { MODEL_FLOATS = sizeof(struct cb_volumetric) / sizeof(float) };

/* ---- geometry ---- */

static bool read_chain(struct cb_loader *loader, uint32_t at, uint8_t moves[CB_AXES]) {
    char chain[CB_NAME_SIZE];
    if (!cb_read_text(loader, at, chain, sizeof chain)) return false;
    if (cb_volumetric_chain(chain, moves)) return true;
    return cb_fail(loader, CB_ERROR_NAME, at,
                   "%o is not a chain: f (foundation), X, Y and Z once each, such as \"XYfZ\"; the "
                   "axes left of f carry the workpiece, those right of it the tool",
                   at);
}

static bool read_point(struct cb_loader *loader, uint32_t at, float point[3]) {
    return at == CB_ABSENT || cb_read_vector(loader, at, 3, "coordinates", point);
}

/* out: lever of each axis at position 0 of all axes: from its reference point to the spindle, mm */
static bool read_levers(struct cb_loader *loader, const uint32_t *slots,
                        struct cb_volumetric *model) {
    float offset[3] = {0.0f, 0.0f, 0.0f};
    uint32_t axes[CB_AXES] = {CB_ABSENT, CB_ABSENT, CB_ABSENT};
    if (!read_point(loader, slots[TOOL_OFFSET], offset)) return false;
    if (slots[REFERENCE_POINTS] != CB_ABSENT &&
        !cb_read_object(loader, slots[REFERENCE_POINTS], &REFERENCE_POINTS_OBJECT, 0, axes))
        return false;
    for (uint32_t a = 0; a < CB_AXES; ++a) {
        float point[3] = {0.0f, 0.0f, 0.0f};
        if (!read_point(loader, axes[a], point)) return false;
        for (uint32_t c = 0; c < 3; ++c) model->lever_mm[a][c] = offset[c] - point[c];
    }
    return true;
}

/* out: unit vector of the tool, [0, 0, -1] by default */
static bool read_direction(struct cb_loader *loader, uint32_t at, float tool[3]) {
    tool[2] = -1.0f;
    if (!read_point(loader, at, tool)) return false;
    const float square = tool[0] * tool[0] + tool[1] * tool[1] + tool[2] * tool[2];
    if (cb_abs(square - 1.0f) < 1e-3f) return true;
    return cb_fail(loader, CB_ERROR_RANGE, at,
                   "a direction has the length 1, such as [0, 0, -1] for a tool that points down");
}

/* out: *signal, or CB_NONE and a constant length in mm */
static bool read_tool_length(struct cb_loader *loader, const uint32_t *slots, uint8_t *signal,
                             float *length_mm) {
    *signal = CB_NONE;
    *length_mm = 0.0f;
    if (slots[TOOL_LENGTH] != CB_ABSENT && slots[TOOL_LENGTH_MM] != CB_ABSENT)
        return cb_fail(loader, CB_ERROR_KEY, slots[TOOL_LENGTH_MM],
                       "the tool length is a signal (tool_length) or a number, not both");
    if (slots[TOOL_LENGTH_MM] != CB_ABSENT)
        return cb_read_float(loader, slots[TOOL_LENGTH_MM], "-10000", "10000", length_mm);
    return slots[TOOL_LENGTH] == CB_ABSENT || cb_read_signal(loader, slots[TOOL_LENGTH], signal);
}

/* ---- signals ---- */

/* in : at, the term, for messages; list_at, the list of three signals, or CB_ABSENT
 * out: the positions of the axes; without a list the signals X, Y and Z */
static bool read_positions(struct cb_loader *loader, uint32_t at, uint32_t list_at,
                           uint8_t position[CB_AXES]) {
    static const char names[CB_AXES][2] = {"X", "Y", "Z"};
    const struct cb_config *config = loader->config;
    uint32_t count = 0;
    for (uint32_t a = 0; list_at == CB_ABSENT && a < CB_AXES; ++a) {
        position[a] = cb_find_name(config->signals, sizeof config->signals[0],
                                   config->signals_count, names[a]);
        if (position[a] == CB_NONE)
            return cb_fail(loader, CB_ERROR_NAME, at,
                           "no signal is called %s; name the three axes in positions", names[a]);
    }
    if (list_at == CB_ABSENT) return true;
    struct cb_list list = cb_list(loader, list_at);
    for (; cb_list_next(&list); ++count) {
        if (count < CB_AXES && !cb_read_signal(loader, list.at, &position[count])) return false;
    }
    if (count == CB_AXES) return true;
    return cb_fail(loader, CB_ERROR_RANGE, list_at,
                   "positions are three signals, those of X, Y and Z, not %u", count);
}

/* in : as `load` of struct cb_term_kind
 * out: model and constant tool length in the pool; the errors are linked later */
static bool load(struct cb_loader *loader, uint32_t at, const uint32_t *slots,
                 struct cb_term_config *term) {
    struct cb_volumetric_config *config = &term->as.volumetric;
    struct cb_volumetric model;
    uint32_t squareness[SQUARENESS_KEYS];
    memset(&model, 0, sizeof model);
    if (term->outputs != 3)
        return cb_fail(loader, CB_ERROR_RANGE, slots[OUTPUTS],
                       "a volumetric term has three outputs, in X, Y and Z, not %u",
                       (uint32_t)term->outputs);
    if (!read_chain(loader, slots[CHAIN], model.moves) ||
        !read_positions(loader, at, slots[POSITIONS], config->signals) ||
        !read_levers(loader, slots, &model) ||
        !read_direction(loader, slots[TOOL_DIRECTION], model.tool))
        return false;
    if (slots[SQUARENESS] != CB_ABSENT &&
        !cb_read_object(loader, slots[SQUARENESS], &SQUARENESS_OBJECT, model.squareness_urad,
                        squareness))
        return false;
    if (!cb_take_pool(loader, at, MODEL_FLOATS + 1, &config->pool)) return false;
    float *pool = loader->config->pool + config->pool;
    memcpy(pool, &model, sizeof model);
    return read_tool_length(loader, slots, &config->signals[TOOL], pool + MODEL_FLOATS);
}

/* ---- errors ---- */

/* Enters one output of config->error by its name, which is that of an error: EXX. */
static bool link_error(struct cb_loader *loader, uint32_t at, struct cb_volumetric_config *config) {
    char name[CB_NAME_SIZE];
    if (!cb_read_name(loader, at, name)) return false;
    const int error = cb_volumetric_error(name);
    if (error < 0)
        return cb_fail(loader, CB_ERROR_NAME, at,
                       "%o is not an error of an axis; ISO 230-1 names them EXX, EYX, … ECZ", at);
    if (error >= CB_CURVE_ERRORS)
        return cb_fail(loader, CB_ERROR_NAME, at, "%o is a number and belongs in squareness_urad",
                       at);
    if (config->error[error] != CB_NONE)
        return cb_fail(loader, CB_ERROR_NAME, at, "%o occurs twice", at);
    return cb_read_output(loader, at, &config->error[error]);
}

static bool link(struct cb_loader *loader, uint32_t at, struct cb_term_config *term) {
    struct cb_volumetric_config *config = &term->as.volumetric;
    struct cb_list list = cb_list(loader, at);
    memset(config->error, CB_NONE, sizeof config->error);
    while (cb_list_next(&list)) {
        if (!link_error(loader, list.at, config)) return false;
    }
    config->complete = list.index + 1 == CB_CURVE_ERRORS;
    return true;
}

/* ---- value and slope ---- */

static const struct cb_volumetric *model_of(const struct cb_config *config,
                                            const struct cb_volumetric_config *volumetric) {
    const void *model = config->pool + volumetric->pool;
    return model;
}

static bool all_live(const struct cb_evaluation *e, const struct cb_volumetric_config *config) {
    bool live = true;
    for (unsigned k = 0; k < CB_CURVE_ERRORS; ++k)
        live &= config->error[k] == CB_NONE || cb_output_is_live(e, config->error[k]);
    return live;
}

/* out: *state of this step; false if a position, an error or the tool length is missing */
static bool machine(const struct cb_evaluation *e, const struct cb_volumetric_config *config,
                    struct cb_volumetric_state *state) {
    bool there = e->all_live || all_live(e, config);
    state->tool_mm = e->config->pool[config->pool + MODEL_FLOATS];
    for (unsigned a = 0; a < CB_AXES; ++a) {
        const struct cb_signal_state *position = &e->signals[config->signals[a]];
        state->position_mm[a] = position->used;
        there &= position->fresh;
    }
    for (unsigned k = 0; config->complete && k < CB_CURVE_ERRORS; ++k)
        state->error[k] = e->outputs[config->error[k]];
    for (unsigned k = 0; !config->complete && k < CB_CURVE_ERRORS; ++k)
        state->error[k] = config->error[k] == CB_NONE ? 0.0f : e->outputs[config->error[k]];
    if (config->signals[TOOL] == CB_NONE) return there;
    state->tool_mm = e->signals[config->signals[TOOL]].used;
    return there && e->signals[config->signals[TOOL]].fresh;
}

static uint8_t value(const struct cb_evaluation *e, const struct cb_term_config *term,
                     struct cb_term_state *term_state, float *value) {
    const struct cb_volumetric_config *config = &term->as.volumetric;
    struct cb_volumetric_state state;
    (void)term_state;
    if (!machine(e, config, &state)) return CB_TERM_MISSING;
    cb_volumetric_evaluate(model_of(e->config, config), &state, value);
    return 0;
}

/* The rates are those of a motion in which pass->signal grows by 1. */
static void slope(const struct cb_slope_pass *pass, const struct cb_term_config *term,
                  float *slope) {
    const struct cb_volumetric_config *config = &term->as.volumetric;
    struct cb_volumetric_state state, rate;
    machine(&pass->e, config, &state);
    for (unsigned a = 0; a < CB_AXES; ++a)
        rate.position_mm[a] = config->signals[a] == pass->signal ? 1.0f : 0.0f;
    rate.tool_mm = config->signals[TOOL] == pass->signal ? 1.0f : 0.0f;
    for (unsigned k = 0; k < CB_CURVE_ERRORS; ++k)
        rate.error[k] = config->error[k] == CB_NONE ? 0.0f : pass->slopes[config->error[k]];
    cb_volumetric_derivative(model_of(pass->e.config, config), &state, &rate, slope);
}

static const struct cb_term_part PARTS[] = {
    {"reference_points", &REFERENCE_POINTS_OBJECT}, {"squareness", &SQUARENESS_OBJECT}, {0, 0}};

const struct cb_term_kind cb_term_volumetric = {
    .object = {FIELDS, KEYS},
    .parts = PARTS,
    .signals = CB_TERM_LIST(as.volumetric.signals),
    .uses = CB_TERM_LIST(as.volumetric.error),
    .uses_key = "errors",
    .outputs = OUTPUTS,
    .load = load,
    .link = link,
    .value = value,
    .slope = slope,
};
