// SPDX-License-Identifier: MIT
// The machine file: a coefficient file before its terms, which a person completes. Its registers
// are those of formats/register_layout.h, all free to change.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

namespace compbox::coefficients {

struct travel_range {
    double from_mm, to_mm;  // from < to
};

// One direction of motion: an axis with its motor, or a stage with two.
struct machine_axis {
    std::string name;                 // "X"; of the stage Y1+Y2 what both have in common, "Y"
    std::vector<std::string> motors;  // {"X"}, or {"Y1", "Y2"}
};

struct machine_options {
    std::string axes;                 // as parse_axes() takes them
    std::string profile = "generic";  // one of layout_names()
    std::string name = "machine";
    std::string host;  // IP address in numbers
    int port = 502;
    int unit = 1;
    double period_ms = 30.0;
    bool motor_positions = false;                // of a stage: a position of each motor
    std::map<std::string, travel_range> travel;  // by axis; of some or all
    std::string probe;                           // axes with a touch probe: "X,Z"; "": none
};

// Positions are plausible this far beyond a travel that a person stated: a standing axis reads a
// few µm past its end.
constexpr double plausible_beyond_mm = 10.0;

// The plausible range of a signal of which only its measured curves are known, in whole mm: a
// measurement seldom reaches the ends of the travel, so a tenth of its length, at least 10 mm.
travel_range plausible_around(const travel_range &measured);

// "XYZ", "X,Z" or "X,Y1+Y2,Z": letters of XYZUVW, with a number where commas separate them; each
// once, 1 to 8 axes. Throws input_error, with a sentence of its own for a rotary axis.
std::vector<machine_axis> parse_axes(const std::string &text);

// The axes of options.probe, each with its signals: "X" has probe_x and probe_x_n. Throws
// input_error for one that is none of the machine's.
struct probed_axis {
    std::string axis, value, count;
};
std::vector<probed_axis> probed_axes(const machine_options &options);

// "X=14300,Y=-1500:1500": ranges by axis; one number means from 0. Throws input_error.
std::map<std::string, travel_range> parse_travel(const std::string &text);

// A channel's name as parse_axes() takes it: the letter of its direction; 0 for any other name.
char linear_letter(const std::string &name);

// A machine file for these axes: a signal for each position, a channel for each motor, a pair for
// each stage. What only a person or the measured curves can know is null: ranges without a travel,
// and every sum. Throws input_error where the options contradict each other.
json new_machine(const machine_options &options);

}  // namespace compbox::coefficients
