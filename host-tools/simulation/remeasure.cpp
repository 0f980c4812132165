// SPDX-License-Identifier: MIT
#include "host-tools/simulation/remeasure.h"

#include "host-tools/metrology/iso230_2.h"
#include "host-tools/simulation/at_rest.h"
#include "host-tools/simulation/figures.h"

namespace compbox::simulation {

namespace {

constexpr int between_per_interval = 10;
constexpr int ceiling_draws = 200;

// A path with finer steps, for the figures between the stops.
scenario_path finer(scenario_path path) {
    path.every_mm /= between_per_interval;
    return path;
}

std::vector<twin::xyz> unexplained_errors(const twin::twin_machine &twin,
                                          const std::vector<twin::twin_state> &states) {
    std::vector<twin::xyz> errors;
    for (const auto &state : states) errors.push_back(twin.unexplained_error_um(state));
    return errors;
}

// Sets A and R of one direction of approach from the readings of a laser; one run has none.
void take_iso(const remeasured_path::readings &shown, std::size_t along,
              const std::vector<twin::xyz> &stops, double &A_um, double &R_um) {
    metrology::axis_readings axis;
    const bool rises = stops.front()[along] < stops.back()[along];
    for (std::size_t k = 0; k < stops.size(); ++k) {
        const std::size_t i = rises ? k : stops.size() - 1 - k;
        axis.target_mm.push_back(stops[i][along]);
        axis.forward.emplace_back();
        for (const auto &run : shown.runs) axis.forward.back().push_back(run[i][along]);
    }
    const auto found = metrology::evaluate_positioning(axis).forward.value();
    A_um = found.A.value_or(0.0);
    R_um = found.R.value_or(0.0);
}

}  // namespace

std::vector<twin::twin_state> uncompensated(std::vector<twin::twin_state> states) {
    for (auto &state : states) state.drive_um = {};
    return states;
}

std::vector<twin::xyz> true_errors(const twin::twin_machine &twin,
                                   const std::vector<twin::twin_state> &states) {
    std::vector<twin::xyz> errors;
    for (const auto &state : states) errors.push_back(twin.true_error_um(state));
    return errors;
}

double range_along(const scenario_path &path, const std::vector<twin::xyz> &positions_mm,
                   const std::vector<twin::xyz> &errors_um, std::size_t direction) {
    const bool about_line =
        path.figure == path_figure::straightness ||
        (path.figure == path_figure::axis && direction != static_cast<std::size_t>(path.along));
    return about_line ? range_about_line(positions_mm, errors_um, direction)
                      : range_of(errors_um, direction);
}

remeasured_path::remeasured_path(const twin::twin_machine &twin, const scenario_path &path)
    : twin_(twin),
      laser_(twin),
      path_(path),
      stops_(stops_of(path)),
      between_(stops_of(finer(path))) {}

double remeasured_path::range(const std::vector<twin::xyz> &positions,
                              const std::vector<twin::xyz> &errors, std::size_t direction) const {
    return range_along(path_, positions, errors, direction);
}

path_figures remeasured_path::judge(const std::vector<twin::twin_state> &states,
                                    const cb_config &config) {
    path_figures result;
    result.before_um = true_errors(twin_, uncompensated(states));
    result.after_um = true_errors(twin_, states);
    const auto unexplained = unexplained_errors(twin_, states);
    const auto shown_before = shown(laser_, result.before_um);
    const auto shown_after = shown(laser_, result.after_um);
    const auto between = states_at_rest(config, twin_.config(), between_);
    const auto between_after = true_errors(twin_, between);
    const auto between_before = true_errors(twin_, uncompensated(between));
    const twin::xyz noise_um = noise_range_um(unexplained);
    for (std::size_t a = 0; a < 3; ++a) {
        direction_figures &one = result.figures[a];
        one.before_um = range(stops_, result.before_um, a);
        one.after_um = range(stops_, result.after_um, a);
        one.largest_before_um = largest_of(result.before_um, a);
        one.largest_after_um = largest_of(result.after_um, a);
        one.mean_um = mean_of(result.after_um, a);
        one.variance_um2 = variance_of(result.after_um, a);
        one.between_before_um = range(between_, between_before, a);
        one.between_after_um = range(between_, between_after, a);
        one.remeasured_before_um = range(stops_, shown_before.means, a);
        one.remeasured_after_um = range(stops_, shown_after.means, a);
        one.ceiling_percent =
            direction_figures::reduction(one.before_um, range(stops_, unexplained, a));
        one.noise_ceiling_percent =
            direction_figures::reduction(one.remeasured_before_um, noise_um[a]);
    }
    if (path_.figure == path_figure::axis) {
        const auto along = static_cast<std::size_t>(path_.along);
        direction_figures &one = result.figures[along];
        take_iso(shown_before, along, stops_, one.A_before_um, one.R_before_um);
        take_iso(shown_after, along, stops_, one.A_after_um, one.R_after_um);
    }
    return result;
}

remeasured_path::readings remeasured_path::shown(twin::virtual_laser &laser,
                                                 const std::vector<twin::xyz> &errors) const {
    const int runs = twin_.config().laser.runs;
    readings made = {{}, std::vector<twin::xyz>(errors.size(), twin::xyz{})};
    for (int run = 0; run < runs; ++run) {
        made.runs.emplace_back();
        for (std::size_t i = 0; i < errors.size(); ++i) {
            made.runs.back().push_back(laser.shown(errors[i]));
            for (std::size_t a = 0; a < 3; ++a) {
                made.means[i][a] += made.runs.back()[i][a] / runs;
            }
        }
    }
    return made;
}

// Mean range of remeasurements of a machine that has only its unexplained errors left.
twin::xyz remeasured_path::noise_range_um(const std::vector<twin::xyz> &unexplained) const {
    twin::virtual_laser laser(twin_);
    twin::xyz mean = {};
    for (int draw = 0; draw < ceiling_draws; ++draw) {
        const auto reading = shown(laser, unexplained).means;
        for (std::size_t a = 0; a < 3; ++a) mean[a] += range(stops_, reading, a) / ceiling_draws;
    }
    return mean;
}

}  // namespace compbox::simulation
