// SPDX-License-Identifier: MIT
// A laser file as a measurement.
#include <algorithm>

#include "host-tools/fitting/measurement.h"

namespace compbox::fitting {

measurement measurement_of_laser(const formats::laser_file &laser) {
    measurement data;
    data.file = laser.file;
    data.unit = laser.angular ? "urad" : "um";
    data.environment = laser.environment;
    data.about = laser;
    std::vector<std::vector<long>> lines;
    for (std::size_t number = 0; number < laser.runs.size(); ++number) {
        const formats::laser_run &from = laser.runs[number];
        measured_run run;
        run.name = std::to_string(number + 1);
        run.direction = from.direction;
        for (const std::size_t target : from.target) {
            run.position.push_back(laser.targets_mm[target]);
        }
        run.error = from.deviation;
        lines.push_back(from.line);
        if (from.direction < 0) {
            std::reverse(run.position.begin(), run.position.end());
            std::reverse(run.error.begin(), run.error.end());
            std::reverse(lines.back().begin(), lines.back().end());
        }
        run.sigma.assign(run.position.size(), 1.0);
        for (std::size_t i = 0; i < run.position.size(); ++i) {
            check_reading(laser.file, 0, run.position[i], run.error[i], run.sigma[i]);
        }
        data.runs.push_back(std::move(run));
    }
    refuse_near_positions(data, lines, true);
    average_runs(data);
    return data;
}

}  // namespace compbox::fitting
