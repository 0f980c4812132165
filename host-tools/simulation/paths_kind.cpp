// SPDX-License-Identifier: MIT
// The kind "paths": measure, identify, compensate, remeasure along paths.
#include "host-tools/simulation/kinds.h"
#include "host-tools/simulation/plots.h"
#include "host-tools/simulation/report.h"

namespace compbox::simulation {

simulate_outcome run_paths(const simulate_request &request) {
    scenario plan = load_scenario(request.scenario);
    if (!request.seeds.empty()) plan.seeds = request.seeds;
    const simulation result = simulate(plan, request.folder, request.commands, request.progress);
    if (!request.plots.empty()) {
        plot_paths(plan, result, request.plots);
        plot_curves(result, request.plots);
    }
    return {report_json(plan, result, request.real), report_text(plan, result, request.real),
            result.warnings};
}

}  // namespace compbox::simulation
