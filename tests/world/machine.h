// SPDX-License-Identifier: MIT
// The random machine of a seed: its coefficient file, and the PLC, NC and axes that belong to it.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/profile.h"
#include "host-tools/fakeplc/register_map.h"
#include "host-tools/twin/twin_file.h"
#include "tests/world/can_bus.h"
#include "tests/world/dice.h"

namespace compbox::world {

// What the file promises of a channel, for invariants.
struct channel_facts {
    std::string name;
    double limit_um = 0, slew_um_per_s = 0, unit_um = 0;  // unit: of the register; float: 0
    int sign = 1;  // of the register against the tool's displacement
    bool has_applied = false;
    double error_um = 0, deadband_um = 0;
    double slope_limit = 0, slope_slew_per_s = 0, slope_unit = 0;  // of a tangent, mm/mm
    double file_slope_limit = 0;                                   // which no ceiling lowers
    std::string tangent_signal = "";  // its axis; "": there is no tangent
    bool lowered = false;             // its limit or rate, by the site's ceiling
};
struct signal_facts {
    std::string name;
    bool essential = false;
    std::int64_t max_age_us = 0;
    double min = 0, max = 0;
    bool is_lag = false;  // as old as its source
};
struct pair_facts {
    std::size_t first = 0, second = 0;
    double most_um = 0;
};

constexpr int first_module = 5;                          // unit of the first one on the bus
constexpr const char *other_probe_count = "probe_x_n2";  // of the same measurements

struct machine {
    std::string text;  // of the coefficient file
    // out: what it has, parsed once
    const nlohmann::json &file() const;
    mutable std::shared_ptr<const nlohmann::json> parsed = nullptr;  // null: not yet
    fakeplc::register_map map;
    fakeplc::plc_profile profile;
    twin::twin_config twin;
    std::int64_t period_us = 0;
    std::uint16_t port = 0;
    std::int64_t hold_us = 0, heartbeat_timeout_us = 0;
    double step_units = 0;  // > 0: largest change of a value between two updates of the NC
    double ramp_um_per_s = 0;
    unsigned revision = 1;
    bool fc23 = false;
    bool demands_fit = true;   // no demand is beyond error_um, which ends in FAULT
    bool models_fade = false;  // a network is beyond its training range at times: DEGRADED
    std::vector<channel_facts> channels;
    std::vector<pair_facts> pairs;
    std::vector<signal_facts> signals;  // by facts_of() alone
    // out: nullptr if there is none of that name
    const signal_facts *signal(const std::string &name) const;
    std::string plc_device;    // of a serial line to the PLC; "": TCP
    bool is_measured = false;  // by hand
    bool is_cold = false;      // its hall: temperatures about zero
    static constexpr double calm_k = 0.05;
    double wanders_k = calm_k;         // a temperature of the PLC, in half a second, at most
    bool changes_lags = false;         // other files have other time constants
    std::vector<std::string> modules;  // on the bus of the box, as pt100_modules::add takes them
    time_ns module_delay_ns = 0;       // before each of their replies
    std::vector<can_node> nodes;
    std::vector<std::string> temperatures;  // signals of the PLC that wander …
    std::vector<std::string> rated;         // … and those of them with max_rate_per_s
    // Sensors that check each other, of the PLC.
    struct redundant_sensor {
        std::string name;
        double center, contradicts;  // its usual value; so far from the others it contradicts them
    };
    std::vector<redundant_sensor> redundant;
};

// out: the other channel of its pair; nothing: it has none
std::optional<std::size_t> partner_of(const machine &of, std::size_t channel);

// out: the slew rate, or that to which the loader may have lowered it for a control with a largest
//      step (docs/coefficient-file.md)
double least_slew_um_per_s(const machine &of, const channel_facts &channel);

// out: two writes that were sent at once may have outputs of steps so far apart. A write follows
// its
//      step within the exchange, four fifths of a period; with FC23 a period later, and an exchange
//      that lasts comes before the step too.
time_ns longest_between_steps(const machine &of);

// out: for so long a write without a reply may take effect, while the PLC's heartbeat is alive
//      (T of docs/decisions/0003-what-the-plc-may-hold.md)
time_ns longest_late(const machine &of);
// out: without a write for longer the box has lost contact
time_ns contact_lasts(const machine &of);

// out: the names of the outputs of a term of a file
template <typename any_json>
any_json outputs_of(const any_json &term) {
    return term.value("outputs", any_json::array({term.value("name", "")}));
}
// in : revision of the file. The same dice give the same machine.
machine random_machine(dice &chance, unsigned revision = 1);
// out: the machine of a seed
machine machine_of(std::uint64_t seed);

// out: what another file promises for the same machine; nothing if no box can run it
std::optional<machine> facts_of(const machine &base, const std::string &text);

// Another file for the same machine: other models, now and then wider limits, a higher revision.
std::string another_file(const machine &of, dice &chance, unsigned revision);
// The same file with another scale or sign of one channel.
std::string with_other_units(const std::string &text, dice &chance);
// The same file with another connection, block or period.
std::string for_another_plc(const std::string &text, dice &chance);
// out: the file's outputs may be larger than the other's, or mean something else
bool is_wider(const machine &fresh, const machine &than);
// out: the same, or the rates may be to which the loader lowers them for a control with a largest
//      step
bool may_be_wider(const machine &fresh, const machine &than);

// Of the daemon's command line (docs/decisions/0011-site-ceiling.md).
struct site_ceiling {
    double um = 0, um_per_s = 0;
};
void lower_to(machine &of, const site_ceiling &ceiling);

}  // namespace compbox::world
