// SPDX-License-Identifier: MIT
// scenario.json of the kind "paths", as data: measure, identify, compensate, remeasure along paths.
// Every key: docs/report.md.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "host-tools/coefficients/fit_files.h"
#include "host-tools/twin/twin_file.h"

namespace compbox::simulation {

// Figure of a path: the range of the errors about their own least-squares line, their plain range,
// or the plain range along the path's axis and the former across it.
enum class path_figure { straightness, range, axis };

// A straight line in space, with stops at equal steps of one axis and at both ends.
struct scenario_path {
    std::string name;
    twin::xyz from_mm = {}, to_mm = {};
    int along = 0;  // index of the axis whose travel is divided
    double every_mm = 0.0;
    path_figure figure = path_figure::straightness;
};

// A way from measurement files to coefficients: a recipe of fit, or steps (tool_steps.h).
struct scenario_method {
    std::string name;
    coefficients::fit_recipe recipe;
    std::vector<std::string> steps;  // empty: the recipe
};

struct scenario {
    std::string file, name;
    std::string twin, machine;  // paths, relative to the working directory
    std::string measurements;   // folder that serves for the twin file's own seed; may be empty
    std::vector<std::uint64_t> seeds;             // empty: the twin file's own
    std::vector<std::string> curves;              // ISO 230-1 names; the third letter is the signal
    std::vector<std::string> once;                // steps before the first seed
    std::vector<std::string> steps;               // before the methods; empty: laser
    std::vector<scenario_method> methods;         // the first is the product's
    std::vector<scenario_path> paths;             // the first gives the headline figures
    double feed_mm_per_s = 0.0;                   // between the stops
    std::vector<double> moving_mm_per_min;        // feeds at which paths are travelled in one go
    double read_ms = 0.0, write_ms = 0.0;         // that an exchange with the PLC takes
    std::string directions;                       // judged: letters of XYZ
    std::map<std::string, double> paper_percent;  // by axis
};

// Throws input_error with file and key.
scenario load_scenario(const std::string &path);

// Throws input_error where a path has 100 000 stops or more.
void check_stops(const scenario &plan);

// The stops of a path that check_stops let pass, from its beginning to its end.
std::vector<twin::xyz> stops_of(const scenario_path &path);

}  // namespace compbox::simulation
