// SPDX-License-Identifier: MIT
// Measure, fit, compensate, remeasure: the main job on a simulated machine, in virtual time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "host-tools/coefficients/fit_files.h"
#include "host-tools/simulation/remeasure.h"
#include "host-tools/simulation/scenario.h"
#include "host-tools/simulation/step_words.h"

namespace compbox::simulation {

// One seed, one method, one path.
struct simulated_run {
    std::uint64_t seed = 0;
    std::string method, path;
    std::string coefficients;                              // path of the file that the box loaded
    std::map<std::string, int> coefficient_count;          // by curve
    std::array<direction_figures, 3> figures;              // X, Y, Z
    std::vector<twin::xyz> stops_mm, before_um, after_um;  // true errors, at each stop
};

// One seed, one path, travelled in one go by the product's method.
struct moving_run {
    std::uint64_t seed = 0;
    std::string path;
    double feed_mm_per_min = 0.0, lead_ms = 0.0;
    twin::xyz before_um = {}, after_um = {};  // ranges of the true error on the way
};

// The curves of the first seed by one recipe.
struct drawn_method {
    std::string method;
    std::map<std::string, coefficients::drawn_curve> curves;
};

struct simulation {
    std::vector<simulated_run> runs;    // by seed, method, path
    std::vector<moving_run> moving;     // by seed, path, feed
    std::vector<drawn_method> drawn;    // by method; steps instead of recipes draw nothing
    std::vector<std::string> warnings;  // of the fits and steps
};

// Runs the scenario with these commands in its steps; what it makes goes to FOLDER/seed-N/.
// progress gets each step in words. Truth is read from the twin after the fact, for these figures
// only.
simulation simulate(const scenario &plan, const std::string &folder, step_commands commands,
                    const std::function<void(const std::string &)> &progress);

}  // namespace compbox::simulation
