// SPDX-License-Identifier: MIT
// scenario.json: what `compbox simulate` does, as data. Every key: docs/report.md.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "host-tools/compbox/fit_files.h"
#include "host-tools/twin/twin_file.h"

namespace compbox {

// A straight line in space, with stops at equal steps of one axis and at both ends.
struct scenario_path {
    std::string name;
    xyz from_mm = {}, to_mm = {};
    int along = 0;  // index of the axis whose travel is divided
    double every_mm = 0.0;
};

struct scenario {
    std::string file, name;
    std::string twin, machine;  // paths, relative to the working directory
    std::string measurements;   // folder that serves for the twin file's own seed; may be empty
    std::vector<std::uint64_t> seeds;             // empty: the twin file's own
    std::vector<std::string> curves;              // ISO 230-1 names; the third letter is the signal
    std::vector<fit_recipe> methods;              // the first is the product's
    std::vector<scenario_path> paths;             // the first gives the headline figures
    double feed_mm_per_s = 0.0;                   // between the stops
    std::map<std::string, double> paper_percent;  // by axis
};

// Throws input_error with file and key.
scenario load_scenario(const std::string &path);

// The stops of a path, from its beginning to its end.
std::vector<xyz> stops_of(const scenario_path &path);

}  // namespace compbox
