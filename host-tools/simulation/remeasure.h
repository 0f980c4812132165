// SPDX-License-Identifier: MIT
// The effect of a compensation along a path: by the twin's true errors and by a laser's readings.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host-tools/simulation/scenario.h"
#include "host-tools/twin/laser.h"

struct cb_config;

namespace compbox::simulation {

// One direction (X, Y or Z) along one path. A range is that of the scenario's figure: about the
// errors' own least-squares line over the stops, or as it is.
struct direction_figures {
    double before_um = 0.0, after_um = 0.0;  // range of the true error, at the stops
    double largest_before_um = 0.0, largest_after_um = 0.0;  // |true error| at the stops, no line
    double mean_um = 0.0, variance_um2 = 0.0;  // of the true error after, at the stops, no line
    double between_before_um = 0.0, between_after_um = 0.0;  // the range also between the stops
    double remeasured_before_um = 0.0, remeasured_after_um = 0.0;  // the same by the laser
    // ISO 230-2 by the laser's readings, of the direction along the path, in one direction of
    // approach: accuracy A and repeatability R. 0: across the path, or one run.
    double A_before_um = 0.0, A_after_um = 0.0, R_before_um = 0.0, R_after_um = 0.0;
    // What a compensation of all that a model can explain would reach: by the true error (what is
    // left is the unexplained part), and as the laser would show it (mean).
    double ceiling_percent = 0.0, noise_ceiling_percent = 0.0;

    double percent() const { return reduction(before_um, after_um); }
    double between_percent() const { return reduction(between_before_um, between_after_um); }
    double remeasured_percent() const {
        return reduction(remeasured_before_um, remeasured_after_um);
    }
    static double reduction(double before, double after) {
        return before > 0.0 ? 100.0 * (1.0 - after / before) : 0.0;
    }
};

struct path_figures {
    std::array<direction_figures, 3> figures;    // X, Y, Z
    std::vector<twin::xyz> before_um, after_um;  // true error at each stop
};

// A path on a machine.
class remeasured_path {
  public:
    // The twin must outlive it. Each stop is the mean of as many readings of the laser as the
    // machine's own measurement had runs.
    remeasured_path(const twin::twin_machine &twin, const scenario_path &path);

    struct readings {
        std::vector<std::vector<twin::xyz>> runs;  // at each stop
        std::vector<twin::xyz> means;
    };

    const std::string &name() const { return path_.name; }
    const scenario_path &path() const { return path_; }
    const std::vector<twin::xyz> &stops_mm() const { return stops_; }

    // in : the machine at rest at each stop, compensated; the configuration that did it, for the
    //      figures between the stops (−Σ of its terms, at rest)
    path_figures judge(const std::vector<twin::twin_state> &states, const cb_config &config);

  private:
    double range(const std::vector<twin::xyz> &positions, const std::vector<twin::xyz> &errors,
                 std::size_t direction) const;
    // The laser's readings of these true errors.
    readings shown(twin::virtual_laser &laser, const std::vector<twin::xyz> &errors) const;
    twin::xyz noise_range_um(const std::vector<twin::xyz> &unexplained) const;

    const twin::twin_machine &twin_;
    twin::virtual_laser laser_;
    scenario_path path_;
    std::vector<twin::xyz> stops_, between_;
};

// The range of the scenario's figure for errors along a path.
double range_along(const scenario_path &path, const std::vector<twin::xyz> &positions_mm,
                   const std::vector<twin::xyz> &errors_um, std::size_t direction);

// The same machine without compensation.
std::vector<twin::twin_state> uncompensated(std::vector<twin::twin_state> states);
// The true error in each state.
std::vector<twin::xyz> true_errors(const twin::twin_machine &twin,
                                   const std::vector<twin::twin_state> &states);

}  // namespace compbox::simulation
