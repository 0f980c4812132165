// SPDX-License-Identifier: MIT
// ISO 230-1 and 230-2 figures of one or two measurements, as JSON and as a table for a terminal.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host-tools/fitting/measurement.h"
#include "host-tools/formats/json_type.h"
#include "host-tools/metrology/iso230_2.h"

namespace compbox::test_report {

// A figure as options and documents name it, and its place in figures_of().
struct figure {
    const char *key;     // "A+", for options
    const char *symbol;  // "A↑", for a page
    const char *name;    // "forward A"
    const char *place;   // JSON pointer
};
extern const std::vector<figure> positioning_figures, straightness_figures;

// out: the figure with this key. Throws input_error, naming the file, with all keys.
const figure &figure_of(const std::string &file, const std::string &key);

// out: its value in figures_of(); empty where the readings do not suffice
std::optional<double> value_of(const json &figures, const figure &one);

// The runs as read (without alignment), by target and direction. A run without a stated direction
// counts as forward. Throws input_error if a target lacks a reading of some run.
metrology::axis_readings readings_of(const fitting::measurement &data);

// out: file, unit, positioning (ISO 230-2; null where the runs do not suffice), straightness
// (ISO 230-1) and warnings. Throws input_error for fewer than two positions.
json figures_of(const fitting::measurement &data);

// in : the measurement before, and possibly the one after
// out: {"before": figures_of, "after": …}, with remarks on travels and signs. Throws input_error
//      where the units differ.
json comparison_of(const std::vector<fitting::measurement> &files);

// in : comparison_of, possibly with "conformity"
// out: the table for reading, with remarks, warnings and verdicts
std::string text_of(const json &report);

}  // namespace compbox::test_report
