// SPDX-License-Identifier: MIT
#include "host-tools/simulation/plc_log.h"

#include <cmath>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/simulation/figures.h"

namespace compbox::simulation {

namespace {

constexpr int status_active = 1;  // low byte of the box's status register

// Columns BEFORE + "X" + AFTER … as one vector; an axis that a machine lacks stays at 0.
std::vector<twin::xyz> axes_of(const formats::csv_table &table, const std::string &before,
                               const std::string &after) {
    std::vector<twin::xyz> values(table.rows.size(), twin::xyz{});
    for (std::size_t a = 0; a < 3; ++a) {
        const int column = table.find(before + twin::axis_letters[a] + after);
        for (std::size_t r = 0; column >= 0 && r < values.size(); ++r) {
            values[r][a] = table.rows[r][static_cast<std::size_t>(column)];
        }
    }
    return values;
}

}  // namespace

plc_log read_plc_log(const std::string &path) {
    const formats::csv_table table = formats::read_csv(path, {"event"});
    table.column("event");
    plc_log log;
    log.time_s = table.values("time_s");
    const std::vector<double> status = table.values("status");
    for (std::size_t r = 0; r < status.size(); ++r) {
        if (!(status[r] >= 0.0 && status[r] <= 65535.0)) {
            throw input_error(path, table.lines[r], 0, "status must be from 0 to 65535");
        }
        log.active.push_back(static_cast<int>(status[r]) % 256 == status_active);
    }
    log.position_mm = axes_of(table, "", "_mm");
    log.displacement_um = axes_of(table, "displacement_", "_um");
    log.before_um = axes_of(table, "error_before_", "_um");
    log.after_um = axes_of(table, "error_after_", "_um");
    return log;
}

// Uses the rows in which a position changed; fewer than three give zeros.
motion_figures figures_in_motion(const plc_log &log) {
    motion_figures result;
    std::vector<twin::xyz> positions, before, after;
    double length_mm = 0.0;
    for (std::size_t r = 1; r < log.time_s.size(); ++r) {
        const double step_mm = distance_mm(log.position_mm[r - 1], log.position_mm[r]);
        if (step_mm == 0.0) continue;
        length_mm += step_mm;
        result.duration_s += log.time_s[r] - log.time_s[r - 1];
        positions.push_back(log.position_mm[r]);
        before.push_back(log.before_um[r]);
        after.push_back(log.after_um[r]);
    }
    if (positions.size() < 3) return {};
    result.feed_mm_per_min = 60.0 * length_mm / result.duration_s;
    for (std::size_t a = 0; a < 3; ++a) {
        result.before_um[a] = range_about_line(positions, before, a);
        result.after_um[a] = range_about_line(positions, after, a);
    }
    return result;
}

}  // namespace compbox::simulation
