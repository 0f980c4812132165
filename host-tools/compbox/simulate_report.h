// SPDX-License-Identifier: MIT
// What a simulation found, for people and for programs (docs/report.md, docs/report.schema.json).
#pragma once

#include <string>

#include "host-tools/compbox/plc_log.h"
#include "host-tools/compbox/simulate.h"
#include "host-tools/formats/json.h"

namespace compbox {

// What is known of a run of compboxd and fakeplc in real time.
struct real_time_run {
    json statistics;        // what compboxd wrote with --stats; null: none
    motion_figures motion;  // from fakeplc's log; duration 0: none
};

json report_json(const scenario &plan, const simulation &result, const real_time_run &real);

// Tables in plain text. Of several seeds: median and worst.
std::string report_text(const scenario &plan, const simulation &result, const real_time_run &real);

}  // namespace compbox
