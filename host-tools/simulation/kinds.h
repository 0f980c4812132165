// SPDX-License-Identifier: MIT
// What `compbox simulate` can do with a scenario: each kind reads its own keys and judges in its
// own way; report.json has the same keys at the top (docs/report.md, docs/report.schema.json).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host-tools/formats/json.h"
#include "host-tools/simulation/plc_log.h"
#include "host-tools/simulation/step_words.h"

namespace compbox::simulation {

// What is known of a run of compboxd and fakeplc in real time.
struct real_time_run {
    json statistics;        // what compboxd wrote with --stats; null: none
    motion_figures motion;  // from fakeplc's log; duration 0: none
};

struct simulate_request {
    std::string scenario;              // path of the file
    std::string folder;                // for all that the run makes
    std::vector<std::uint64_t> seeds;  // empty: as the scenario says
    std::string plots;                 // folder for figures, there already; "": none
    real_time_run real;
    step_commands commands = nullptr;  // of steps beside measure; not null
    std::function<void(const std::string &)> progress;
};

struct simulate_outcome {
    json report;
    std::string text;  // tables for people
    std::vector<std::string> warnings;
};

// Runs the scenario by its "kind" ("paths" where it has none). Writes below request.folder and the
// scenario's own folder only. Throws input_error.
simulate_outcome run_scenario(const simulate_request &request);

// The kinds, one file each.
simulate_outcome run_paths(const simulate_request &request);  // paths_kind.cpp
simulate_outcome run_parts(const simulate_request &request);  // parts_kind.cpp

}  // namespace compbox::simulation
