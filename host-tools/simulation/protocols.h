// SPDX-License-Identifier: MIT
// The protocols of a scenario of parts on one machine: train on some, judge by others.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host-tools/simulation/day.h"
#include "host-tools/simulation/step_words.h"

namespace compbox::simulation {

// Largest errors over the points of a choice; [3]: of the error's length in space.
struct part_figures {
    using four = std::array<double, 4>;
    four before_um = {}, after_um = {};                  // true
    four unexplained_um = {};                            // of the part that no model explains
    four touched_before_um = {}, touched_after_um = {};  // as the probe shows them
    four touched_ideal_um = {};  // … of a machine with the unexplained part alone

    static double reduction(double before, double after) {
        return before > 0.0 ? 100.0 * (1.0 - after / before) : 0.0;
    }
};

enum class part_role { judge, also, outside };

struct part_result {
    std::uint64_t seed = 0;
    std::string protocol, method, choice, coefficients;
    part_role role = part_role::judge;
    part_figures figures;
    std::vector<cut_point> points;
};

struct part_results {
    std::vector<part_result> runs;  // by seed, protocol, method, choice
    std::vector<std::string> warnings;
};

// Everything for one machine, with these commands in its steps; the results are appended. What it
// makes goes to `folder`.
void run_part_protocols(const part_scenario &plan, const twin::twin_config &machine,
                        const std::string &folder, step_commands commands,
                        const std::function<void(const std::string &)> &progress,
                        part_results &results);

}  // namespace compbox::simulation
