// SPDX-License-Identifier: MIT
#include "host-tools/compbox/remeasure.h"

#include "host-tools/compbox/evaluate.h"
#include "host-tools/compbox/figures.h"

namespace compbox {

namespace {

constexpr int between_per_interval = 10;
constexpr int ceiling_draws = 200;
constexpr double eval_step_s = 1.0;

// A path with finer steps, for the figures between the stops.
scenario_path finer(scenario_path path) {
    path.every_mm /= between_per_interval;
    return path;
}

std::vector<xyz> zeros(std::size_t count) {
    return std::vector<xyz>(count, xyz{});
}

// Positions as a table of samples for the box.
csv_table samples_at(const cb_config &config, const std::vector<xyz> &positions) {
    csv_table table;
    table.file = "positions";
    table.names = {"time_s"};
    for (unsigned s = 0; s < config.signals_count; ++s) {
        table.names.push_back(config.signals[s].name);
    }
    for (std::size_t i = 0; i < positions.size(); ++i) {
        std::vector<double> row{static_cast<double>(i) * eval_step_s};
        for (unsigned s = 0; s < config.signals_count; ++s) {
            const int axis = axis_index(config.signals[s].name[0]);
            row.push_back(axis < 0 ? 0.0 : positions[i][static_cast<std::size_t>(axis)]);
        }
        table.rows.push_back(row);
        table.lines.push_back(static_cast<long>(i) + 1);
    }
    return table;
}

// What the box's channels are worth at each position once at rest: −Σ of the terms.
std::vector<xyz> displacements_at(const cb_config &config, const std::vector<xyz> &positions) {
    const evaluation result = evaluate(config, samples_at(config, positions), true);
    std::vector<xyz> displacements = zeros(positions.size());
    for (unsigned c = 0; c < config.channels_count; ++c) {
        const int axis = axis_index(config.channels[c].name[0]);
        for (std::size_t i = 0; axis >= 0 && i < positions.size(); ++i) {
            displacements[i][static_cast<std::size_t>(axis)] =
                static_cast<double>(result.rows[i][config.outputs_count + c]);
        }
    }
    return displacements;
}

}  // namespace

remeasured_path::remeasured_path(const twin_machine &twin, const scenario_path &path)
    : twin_(twin),
      laser_(twin),
      path_(path),
      stops_(stops_of(path)),
      between_(stops_of(finer(path))),
      before_(true_errors(stops_, zeros(stops_.size()))),
      between_before_(true_errors(between_, zeros(between_.size()))),
      shown_before_(shown_errors(laser_, zeros(stops_.size()))) {
    find_noise_range();
}

path_figures remeasured_path::judge(const std::vector<xyz> &displacements_um,
                                    const cb_config &config) {
    path_figures result;
    result.after_um = true_errors(stops_, displacements_um);
    const auto shown_after = shown_errors(laser_, displacements_um);
    const auto between_after = true_errors(between_, displacements_at(config, between_));
    for (std::size_t a = 0; a < 3; ++a) {
        direction_figures &one = result.figures[a];
        one.before_um = range_about_line(stops_, before_, a);
        one.after_um = range_about_line(stops_, result.after_um, a);
        one.mean_um = mean_of(result.after_um, a);
        one.variance_um2 = variance_of(result.after_um, a);
        one.between_before_um = range_about_line(between_, between_before_, a);
        one.between_after_um = range_about_line(between_, between_after, a);
        one.remeasured_before_um = range_about_line(stops_, shown_before_, a);
        one.remeasured_after_um = range_about_line(stops_, shown_after, a);
        one.ceiling_percent =
            direction_figures::reduction(one.remeasured_before_um, noise_range_um_[a]);
    }
    return result;
}

std::vector<xyz> remeasured_path::true_errors(const std::vector<xyz> &positions,
                                              const std::vector<xyz> &displacements) const {
    std::vector<xyz> errors;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        errors.push_back(twin_.true_error_um(positions[i], displacements[i]));
    }
    return errors;
}

std::vector<xyz> remeasured_path::shown_errors(virtual_laser &laser,
                                               const std::vector<xyz> &displacements) const {
    const int runs = twin_.config().laser.runs;
    std::vector<xyz> means = zeros(stops_.size());
    for (int run = 0; run < runs; ++run) {
        for (std::size_t i = 0; i < stops_.size(); ++i) {
            const xyz shown = laser.read_tool_error_um(stops_[i], displacements[i]);
            for (std::size_t a = 0; a < 3; ++a) means[i][a] += shown[a] / runs;
        }
    }
    return means;
}

// Mean range of remeasurements of a machine without any error left.
void remeasured_path::find_noise_range() {
    std::vector<xyz> perfect = before_;
    for (auto &one : perfect) {
        for (double &value : one) value = -value;
    }
    virtual_laser laser(twin_);
    for (int draw = 0; draw < ceiling_draws; ++draw) {
        const auto shown = shown_errors(laser, perfect);
        for (std::size_t a = 0; a < 3; ++a) {
            noise_range_um_[a] += range_about_line(stops_, shown, a) / ceiling_draws;
        }
    }
}

}  // namespace compbox
