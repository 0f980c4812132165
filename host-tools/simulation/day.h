// SPDX-License-Identifier: MIT
// A day of work on the simulated machine with the box at it, in virtual time: what the box
// recorded, and what became of each point of the parts.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/csv.h"
#include "host-tools/simulation/parts.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::simulation {

// A point of a surface, at the moment the tool passed it: its error stays in the part. Truth, for
// the virtual probe and for reports after the fact.
struct cut_point {
    std::string part, surface;
    double time_s = 0.0;  // of the PLC's and the record's clock
    xyz position_mm = {};
    xyz before_um = {}, after_um = {};  // error without and with what compensation did
    xyz unexplained_um = {};
};

struct worked_day {
    std::string record;  // CSV as compboxd --record writes it, but fewer rows
    std::vector<cut_point> points;
};

// in : a coefficient file for the box, for the machine that `machine` with its seed stands for; its
//      period is replaced by that of the pace
// Throws input_error, in words, when the box does not become ACTIVE or a point is never passed.
worked_day work_a_day(const part_scenario &plan, const part_day &day, const twin_config &machine,
                      const std::string &coefficients, const std::string &folder);

// What a touch probe says of a point: noisy and rounded.
class touch_probe {
  public:
    touch_probe(const part_probe &probe, std::uint64_t seed, const std::string &purpose)
        : probe_(probe), noise_(seed, "touch probe " + purpose) {}
    xyz touch(const xyz &error_um);

  private:
    part_probe probe_;
    random_stream noise_;
};

}  // namespace compbox::simulation
