// SPDX-License-Identifier: MIT
#include "host-tools/simulation/at_rest.h"

#include "host-tools/coefficients/evaluate.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::simulation {

namespace {

constexpr double eval_step_s = 1.0;

// out: positions as a table of samples for the box
formats::csv_table samples_at(const cb_config &config, const std::vector<twin::xyz> &positions) {
    formats::csv_table table;
    table.file = "positions";
    table.names = {"time_s"};
    for (unsigned s = 0; s < config.signals_count; ++s) {
        table.names.push_back(config.signals[s].name);
    }
    for (std::size_t i = 0; i < positions.size(); ++i) {
        std::vector<double> row{static_cast<double>(i) * eval_step_s};
        for (unsigned s = 0; s < config.signals_count; ++s) {
            const int axis = twin::axis_index(config.signals[s].name[0]);
            row.push_back(axis < 0 ? 0.0 : positions[i][static_cast<std::size_t>(axis)]);
        }
        table.rows.push_back(row);
        table.lines.push_back(static_cast<long>(i) + 1);
    }
    return table;
}

// Adds a channel to its drive, or to both drives of its axis.
void add_channel(const std::string &name, const twin::twin_config &machine, double um,
                 twin::twin_state &state) {
    if (const auto drive = twin::find_drive(machine, name)) {
        state.drive_um[drive->axis][drive->side] += um;
        return;
    }
    const auto mapped = machine.channels.find(name);
    const int axis = twin::axis_index(mapped != machine.channels.end() ? mapped->second : name[0]);
    if (axis < 0) return;
    for (double &one : state.drive_um[static_cast<std::size_t>(axis)]) one += um;
}

}  // namespace

std::vector<twin::twin_state> states_at_rest(const cb_config &config,
                                             const twin::twin_config &machine,
                                             const std::vector<twin::xyz> &positions_mm) {
    const coefficients::evaluation result =
        coefficients::evaluate(config, samples_at(config, positions_mm), true);
    std::vector<twin::twin_state> states;
    for (std::size_t i = 0; i < positions_mm.size(); ++i) {
        twin::twin_state state = twin::state_at(positions_mm[i]);
        for (unsigned c = 0; c < config.channels_count; ++c) {
            const double um = static_cast<double>(result.rows[i][config.outputs_count + c]);
            add_channel(config.channels[c].name, machine, um, state);
        }
        states.push_back(state);
    }
    return states;
}

}  // namespace compbox::simulation
