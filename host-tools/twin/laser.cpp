// SPDX-License-Identifier: MIT
#include "host-tools/twin/laser.h"

#include <cmath>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/file.h"

namespace compbox {

namespace {

constexpr double um_per_mm_per_urad = 1e-3;

}  // namespace

virtual_laser::virtual_laser(const twin_machine &twin)
    : twin_(twin), remeasure_(twin.config().seed, "remeasurement") {}

std::vector<double> virtual_laser::targets_mm(char letter) const {
    const twin_axis &axis = twin_.config().axes.at(static_cast<std::size_t>(axis_index(letter)));
    std::vector<double> targets;
    // A target closer to the end than this would be the end itself.
    const double margin_mm = 1e-6 * axis.measure_every_mm;
    for (int i = 0;; ++i) {
        const double position_mm = axis.min_mm + i * axis.measure_every_mm;
        if (position_mm >= axis.max_mm - margin_mm) break;
        targets.push_back(position_mm);
    }
    targets.push_back(axis.max_mm);
    return targets;
}

double virtual_laser::rounded(double error_um) const {
    // By the count of steps in 1 µm, which gives the shortest decimals: 0.07, not 0.07000…1.
    const double steps_per_um = std::round(1.0 / twin_.config().laser.resolution_um);
    return std::round(error_um * steps_per_um) / steps_per_um;
}

laser_series virtual_laser::measure(const std::string &name) const {
    const twin_config &config = twin_.config();
    const char axis = name.back();
    const std::vector<double> targets = targets_mm(axis);
    random_stream setup(config.seed, "laser set-up " + name);
    random_stream noise(config.seed, "laser noise " + name);
    const double slope = um_per_mm_per_urad * setup.symmetric(config.laser.slope_urad);
    const double offset_um = setup.symmetric(config.laser.offset_um);
    laser_series series{name, {}};
    for (int run = 1; run <= config.laser.runs; ++run) {
        for (const double position_mm : targets) {
            const double approach_um = config.repeatability_um * noise.normal();
            const double reading_um = config.laser.sigma_um * noise.normal();
            const double beam_um = offset_um + slope * (position_mm - targets.front());
            series.readings.push_back(
                {position_mm,
                 rounded(twin_.curve_um(name, position_mm) + beam_um + approach_um + reading_um),
                 run});
        }
    }
    return series;
}

xyz virtual_laser::read_tool_error_um(const xyz &position_mm, const xyz &displacement_um) {
    const twin_config &config = twin_.config();
    xyz error_um = twin_.true_error_um(position_mm, displacement_um);
    for (auto &e : error_um) {
        const double approach_um = config.repeatability_um * remeasure_.normal();
        const double reading_um = config.laser.sigma_um * remeasure_.normal();
        e = rounded(e + approach_um + reading_um);
    }
    return error_um;
}

std::string laser_csv(const laser_series &series) {
    std::vector<std::vector<double>> rows;
    for (const auto &r : series.readings) {
        rows.push_back({r.position_mm, r.error_um, static_cast<double>(r.run)});
    }
    return csv_text({"position_mm", "error_um", "run"}, rows);
}

std::vector<std::string> measure_all(const twin_machine &twin, const std::string &folder) {
    const virtual_laser laser(twin);
    make_folder(folder);
    std::vector<std::string> paths;
    for (const auto &[name, error] : twin.config().errors) {
        paths.push_back(folder + "/" + name + ".csv");
        write_file(paths.back(), laser_csv(laser.measure(name)));
    }
    return paths;
}

}  // namespace compbox
