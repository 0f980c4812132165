// SPDX-License-Identifier: MIT
// scenario.json of the kind "parts", as data: days of work on a machine that warms up, parts that
// are cut and probed, protocols that train on some and judge by others. Every key: docs/report.md.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "host-tools/twin/twin_file.h"

namespace compbox::simulation {

// A wall's surface, cut in lines along X from its foot upwards and probed in columns x rows points.
struct part_surface {
    std::string name;
    std::array<double, 2> x_mm = {}, z_mm = {};
    double y_mm = 0.0, bow_mm = 0.0;  // y + bow (1 - u^2), u = -1 … 1 along X
    int columns = 10, rows = 10;
};

// A part to be cut, or a time with spindle and axes running, or at rest.
struct part_work {
    std::string part;  // its name; "": no part
    double spindle_rpm = 0.0;
    double feed_mm_per_min = 0.0, depth_mm = 0.0;   // of a part
    double minutes = 0.0, travel_mm_per_min = 0.0;  // of other work
};

struct part_day {
    twin::thermal_air air;
    std::vector<part_work> work;
};

// Parts of a day and surfaces of them; empty: all.
struct part_choice {
    std::string name, day;
    std::vector<std::string> parts, surfaces;
};

struct part_method {
    std::string name;
    std::vector<std::string> steps;  // write $out/coefficients.json
    bool mean_only = false;          // instead of steps: the mean error, as a constant
};

// The first protocol gives the headline figures; its first method is the product's.
struct part_protocol {
    std::string name;
    part_choice train;
    std::vector<std::string> steps;  // before the methods: they make of $record and $probe what
                                     // these read
    std::vector<part_method> methods;
    part_choice judge;
    std::vector<part_choice> also;     // judged by the first method only
    std::vector<part_choice> outside;  // likewise, far from the training range
};

struct part_probe {
    double noise_um = 1.0;          // of a touch, 1 sigma
    double repeatability_um = 0.5;  // of the probing machine's approach, 1 sigma
    double resolution_um = 0.1;
};

// Coarser time steps, with which a day takes seconds.
struct part_pace {
    double period_ms = 600.0, scan_ms = 200.0, interpolation_ms = 100.0;
    double record_s = 1.2, idle_record_s = 12.0;  // interval of rows, with and without a cut
};

struct part_scenario {
    std::string file, name, twin, machine;
    std::vector<std::uint64_t> seeds;  // empty: the twin file's own
    std::vector<part_surface> surfaces;
    part_probe probe;
    part_pace pace;
    std::map<std::string, part_day> days;
    std::vector<part_protocol> protocols;
    double paper_percent = 0.0;
};

// Throws input_error with file and key.
part_scenario load_part_scenario(const std::string &path);

}  // namespace compbox::simulation
