// SPDX-License-Identifier: MIT
// A day of work on the simulated machine with the box, in virtual time: the record of the box and
// the error of each point of the parts.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/csv.h"
#include "host-tools/simulation/parts.h"

namespace compbox::simulation {

// A point of a surface when the tool passes it; its error remains in the part. True values, for the
// virtual probe and for reports.
struct cut_point {
    std::string part, surface;
    double time_s = 0.0;  // of the PLC's and the record's clock
    twin::xyz position_mm = {};
    twin::xyz before_um = {}, after_um = {};  // error without and with compensation
    twin::xyz unexplained_um = {};
};

struct worked_day {
    std::string record;  // CSV like compboxd --record, with fewer rows
    std::vector<cut_point> points;
};

// in : a coefficient file for the box on `machine` with its seed; the pace replaces its period
// Throws input_error if the box does not become ACTIVE or the tool never passes a point.
worked_day work_a_day(const part_scenario &plan, const part_day &day,
                      const twin::twin_config &machine, const std::string &coefficients,
                      const std::string &folder);

// Readings of a touch probe: with noise and rounding.
class touch_probe {
  public:
    touch_probe(const part_probe &probe, std::uint64_t seed, const std::string &purpose)
        : probe_(probe), noise_(seed, "touch probe " + purpose) {}
    twin::xyz touch(const twin::xyz &error_um);

  private:
    part_probe probe_;
    twin::random_stream noise_;
};

}  // namespace compbox::simulation
