// SPDX-License-Identifier: MIT
// Signals compared with the control's display: each position at two places, between which a person
// jogs its axis and no other. Two places fix address, type, word order, scale, sign and zero, which
// all agree by chance where an axis is at 0.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "host-tools/commission/register_map.h"
#include "host-tools/formats/json.h"

struct cb_signal_config;

namespace compbox::commission {

// What the control's display shows of a signal.
struct shown_value {
    double value = 0.0;
    double tolerance = 0.0;  // one unit of the last digit shown; 0: a person found them equal
};

// out: text as "12.5" with its tolerance of 0.1 mm. in: digits behind the point
shown_value shown_as(double value, int decimals);

// out: "": the register agrees with the display, else a sentence with the difference, the probable
// cause (factor, sign, type, another register of the block that has the value) and the key.
// in : registers of the whole read block, of which the row's value is one
std::string display_fault(const map_row &row, const shown_value &shown,
                          const std::vector<std::uint16_t> &block, unsigned block_start);

// Positions at one moment, in the order of their rows.
using places = std::vector<double>;

// out: least way of a jog, mm or deg: 10, or a quarter of a shorter range
double least_jog(const cb_signal_config &signal);

// Positions that move together: of two motors of one stage.
using stages = std::vector<std::vector<std::string>>;

// out: "": of all positions only this one (and its stage) moved between two moments, or none; else
// a sentence
std::string others_fault(const std::vector<const map_row *> &positions, std::size_t which,
                         const places &from, const places &to, const stages &together);

// out: "": the position moved by the least way of a jog; else a sentence
std::string way_fault(const map_row &row, double way, double least);

// Throws input_error for a position that no PLC could show correctly: a number that does not reach
// over its range, one register without a range, a unit that is no length or angle.
void check_ranges(const box_setup &setup, const std::vector<const map_row *> &signals);

// The person or script at the machine.
struct dialog {
    std::function<void()> step;  // one cycle of the box; throws where the PLC does not reply
    // in : the task before the comparison; "": none
    // Asks and steps until there is an answer. out: the display; nothing: it agrees with the row
    std::function<std::optional<shown_value>(const map_row &, const std::string &task)> ask;
    // Reports a fault. Returns if the person can answer again, else throws it as input_error.
    std::function<void(const std::string &)> again;
    std::function<void(const std::string &)> say;
};

// Values of --shows, by signal: of a position two, before and after the jog.
using statements = std::map<std::string, std::vector<shown_value>>;

struct position_options {
    statements shows;
    stages together;
    double wait_s = 60.0;  // for a jog of `shows`
    json seen_before;      // result of an earlier run, whose positions are not asked for; or null
};

// Compares all signals, in the order of the file.
// out: {NAME: {"plc", "type", "scale", "zero", "from", "to"}} of each position
json check_positions(const live_box &live, const register_map &map, const dialog &person,
                     const position_options &options);

}  // namespace compbox::commission
