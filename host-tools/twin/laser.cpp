// SPDX-License-Identifier: MIT
#include "host-tools/twin/laser.h"

#include <fmt/core.h>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/file.h"
#include "host-tools/twin/set_up.h"

namespace compbox::twin {

namespace {

// A configured error by its name: as error_name, or the positioning error of a stage's side.
error_name measured(const std::string &name, const twin_config &config) {
    if (const auto drive = find_drive(config, name)) {
        return {static_cast<int>(drive->axis), static_cast<int>(drive->axis)};
    }
    return parse_error_name(name).value();
}

}  // namespace

virtual_laser::virtual_laser(const twin_machine &twin)
    : twin_(twin), remeasure_(twin.config().seed, "remeasurement") {}

std::vector<double> virtual_laser::targets_mm(char letter) const {
    const twin_axis &axis = twin_.config().axes.at(static_cast<std::size_t>(axis_index(letter)));
    std::vector<double> targets;
    // A target closer to the end than this would coincide with the end.
    const double margin_mm = 1e-6 * axis.measure_every_mm;
    for (int i = 0;; ++i) {
        const double position_mm = axis.min_mm + i * axis.measure_every_mm;
        if (position_mm >= axis.max_mm - margin_mm) break;
        targets.push_back(position_mm);
    }
    targets.push_back(axis.max_mm);
    return targets;
}

laser_series virtual_laser::measure(const std::string &name) const {
    const twin_config &config = twin_.config();
    const error_name error = measured(name, config);
    const std::vector<double> targets = targets_mm(axis_letters[error.axis]);
    // A beam along the axis has no slope that matters; across it, and for a rotation, it has.
    laser_set_up set_up(twin_, name, error.direction != error.axis, error.direction > 2);
    laser_series series{name, {}, error.direction > 2 ? "urad" : "um"};
    xyz position_mm = config.start_mm;
    position_mm[static_cast<std::size_t>(error.axis)] = targets.front();
    const double constant =
        true_value(name, error, position_mm) - twin_.curve_um(name, targets.front());
    for (int run = 1; run <= config.laser.runs; ++run) {
        for (const double target_mm : targets) {
            position_mm[static_cast<std::size_t>(error.axis)] = target_mm;
            double shown = true_value(name, error, position_mm) - constant;
            if (error.direction < 3) {
                shown +=
                    set_up.unexplained_um(position_mm)[static_cast<std::size_t>(error.direction)];
            }
            series.readings.push_back(
                {target_mm, set_up.reading_um(shown, target_mm - targets.front()), run});
        }
    }
    return series;
}

// A side of a stage is measured on that side, a rotation directly. A displacement is measured at
// the tool, which the rotations of the axis move too.
double virtual_laser::true_value(const std::string &name, const error_name &error,
                                 const xyz &position_mm) const {
    const double at_mm = position_mm[static_cast<std::size_t>(error.axis)];
    if (error.direction > 2 || find_drive(twin_.config(), name)) return twin_.curve_um(name, at_mm);
    return twin_.explained_error_um(
        state_at(position_mm))[static_cast<std::size_t>(error.direction)];
}

xyz virtual_laser::shown(xyz error_um) {
    const twin_config &config = twin_.config();
    for (auto &e : error_um) {
        const double approach_um = config.repeatability_um * remeasure_.normal();
        const double reading_um = config.laser.sigma_um * remeasure_.normal();
        e = as_shown(e + approach_um + reading_um, config);
    }
    return error_um;
}

std::string laser_csv(const laser_series &series) {
    std::vector<std::vector<double>> rows;
    for (const auto &r : series.readings) {
        rows.push_back({r.position_mm, r.error_um, static_cast<double>(r.run)});
    }
    return formats::csv_text({"position_mm", "error_" + series.unit, "run"}, rows);
}

std::vector<std::string> measure_all(const twin_machine &twin, const std::string &folder) {
    const virtual_laser laser(twin);
    formats::make_folder(folder);
    std::vector<std::string> paths;
    std::vector<std::string> names;
    for (const auto &[name, error] : twin.config().errors) names.push_back(name);
    for (const auto &stage : twin.config().stages) {
        if (stage) names.insert(names.end(), stage->drives.begin(), stage->drives.end());
    }
    for (const auto &name : names) {
        paths.push_back(fmt::format("{}/{}.csv", folder, name));
        formats::write_file(paths.back(), laser_csv(laser.measure(name)));
    }
    return paths;
}

}  // namespace compbox::twin
