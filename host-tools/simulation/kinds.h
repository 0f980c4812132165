// SPDX-License-Identifier: MIT
// The kinds of scenarios of `compbox simulate`. Each kind has its own keys and figures; the
// top-level keys of report.json are common (docs/report.md, docs/report.schema.json).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host-tools/formats/json.h"
#include "host-tools/simulation/plc_log.h"
#include "host-tools/simulation/step_words.h"

namespace compbox::simulation {

// Results of a run of compboxd and fakeplc in real time.
struct real_time_run {
    json statistics;        // file of compboxd --stats; null: none
    motion_figures motion;  // from fakeplc's log; duration 0: none
};

struct simulate_request {
    std::string scenario;              // path of the file
    std::string folder;                // for all files of the run
    std::vector<std::uint64_t> seeds;  // empty: the scenario's
    std::string plots;                 // existing folder for figures; "": none
    real_time_run real;
    step_commands commands = nullptr;  // for steps besides measure; not null
    std::function<void(const std::string &)> progress;
};

struct simulate_outcome {
    json report;
    std::string text;  // tables for people
    std::vector<std::string> warnings;
};

// Runs the scenario by its "kind" (default: "paths"). Writes only below request.folder and the
// scenario's folder. Throws input_error.
simulate_outcome run_scenario(const simulate_request &request);

// The kinds, one file each.
simulate_outcome run_paths(const simulate_request &request);  // paths_kind.cpp
simulate_outcome run_parts(const simulate_request &request);  // parts_kind.cpp

}  // namespace compbox::simulation
