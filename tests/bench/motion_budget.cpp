// SPDX-License-Identifier: MIT
// What is left of the errors in motion, and by what: the machines of a scenario travel its paths
// again, and one cause after the other is taken away, in the box, the PLC or the control, or by
// arithmetic. Prints the table of docs/results/dual-drive-motion.md. scripts/report motion-budget
// runs it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "host-tools/coefficients/load.h"
#include "host-tools/formats/error.h"
#include "host-tools/simulation/at_rest.h"
#include "host-tools/simulation/remeasure.h"
#include "host-tools/simulation/scenario.h"
#include "host-tools/simulation/travels.h"
#include "host-tools/twin/motion.h"

using namespace compbox;

namespace {

constexpr std::size_t directions = 2;  // X and Y

// A machine with the box that was made for it.
struct site {
    twin::twin_config twin;
    cb_config box;
    fakeplc::register_map map;
    simulation::wire_times wire;
};

// What is changed before a travel.
struct variant {
    const char *name;
    std::function<void(site &)> change;
};

void interpolate(site &s, unsigned ms) {
    s.box.plc.interpolate_us = 1000 * ms;
    s.map.interpolate_s = 1e-3 * ms;
}

void at_once(site &s) {
    interpolate(s, 0);
}

void set_lead(site &s, unsigned ms) {
    s.box.lead_measured = false;
    s.box.lead_us = 1000 * ms;
}

void without_limits(site &s) {
    for (auto &channel : s.box.channels) channel.slew_um_per_s = 1e5F;
    s.twin.plc.slope_um_per_s = 1e6;
    s.twin.nc.comp_add_velo_factor = 1.0;
}

void finer_registers(site &s) {
    for (unsigned i = 0; i < s.box.channels_count; ++i) s.box.channels[i].scale *= 0.01F;
    for (auto &channel : s.map.channels) channel.scale_um *= 0.01;
}

void fast_plc(site &s) {
    s.twin.plc.scan_s = s.twin.nc.interpolation_s = 1e-3;
}

// Its exchange has 8 ms: that of the other rows would not fit.
void fast_box(site &s) {
    s.box.period_us = 10000;
    s.wire = {4000, 3000};
}

void gentle_starts(site &s) {
    for (auto &axis : s.twin.axes) axis.acceleration_mm_per_s2 *= 0.1;
}

const std::vector<variant> variants = {
    {"values at once", at_once},
    {"values at once, 10 ms period, 7 ms exchange",
     [](site &s) {
         at_once(s);
         fast_box(s);
     }},
    {"**as shipped**: lines of 30 ms", [](site &) {}},
    {"its lead 5 ms shorter", [](site &s) { set_lead(s, 38); }},
    {"its lead 5 ms longer", [](site &s) { set_lead(s, 48); }},
    {"no limit of rate in box, PLC and NC", without_limits},
    {"registers a hundred times finer", finer_registers},
    {"PLC and NC every millisecond", fast_plc},
    {"a tenth of the acceleration", gentle_starts},
    {"both",
     [](site &s) {
         fast_plc(s);
         gentle_starts(s);
     }},
};

// Less of the error in each direction, per cent, by path, name of the row and seed.
class table {
  public:
    void add(const std::string &path, const std::string &row, const twin::xyz &percent) {
        if (std::find(rows_.begin(), rows_.end(), row) == rows_.end()) rows_.push_back(row);
        if (std::find(paths_.begin(), paths_.end(), path) == paths_.end()) paths_.push_back(path);
        got_[path + "\n" + row].push_back(percent);
    }
    void print() const {
        std::printf("|  |");
        for (const auto &path : paths_) std::printf(" %s: X | Y |", path.c_str());
        std::printf("\n|---|");
        for (std::size_t i = 0; i < directions * paths_.size(); ++i) std::printf("---|");
        for (const auto &row : rows_) {
            std::printf("\n| %s |", row.c_str());
            for (const auto &path : paths_) print(got_.at(path + "\n" + row));
        }
        std::printf("\n");
    }

  private:
    static void print(const std::vector<twin::xyz> &percent) {
        for (std::size_t a = 0; a < directions; ++a) {
            std::vector<double> sorted;
            for (const auto &one : percent) sorted.push_back(one[a]);
            std::sort(sorted.begin(), sorted.end());
            const std::size_t n = sorted.size();
            std::printf(" %.1f, %.1f |", 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]), sorted[0]);
        }
    }
    std::vector<std::string> rows_, paths_;
    std::map<std::string, std::vector<twin::xyz>> got_;
};

std::vector<twin::twin_state> travelled(const site &s, const simulation::travel &way) {
    simulation::world at(s.box, s.twin, s.map, s.wire);
    return simulation::states_along(at, way);
}

// The same places and times with another compensation: that of the model at the positions `used`.
std::vector<twin::twin_state> computed(const site &s, std::vector<twin::twin_state> states,
                                       const std::vector<twin::xyz> &used) {
    const auto rest = simulation::states_at_rest(s.box, s.twin, used);
    for (std::size_t i = 0; i < states.size(); ++i) states[i].drive_um = rest[i].drive_um;
    return states;
}

// Where the axes are so long after the start of a travel.
twin::xyz place_at(const twin::straight_move &move, double since_s) {
    return move.position_mm(std::max(since_s, 0.0));
}

// When the travel began: the move's own time at the middle one of the states, taken back.
double start_s(const twin::straight_move &move, const std::vector<twin::twin_state> &states) {
    const twin::twin_state &middle = states[states.size() / 2];
    const auto gone = [&](const twin::xyz &at) {
        const twin::xyz from = move.position_mm(0.0);
        return std::hypot(at[0] - from[0], at[1] - from[1]);
    };
    double low = 0.0, high = move.duration_s();
    for (int i = 0; i < 60; ++i) {
        const double t = 0.5 * (low + high);
        (gone(move.position_mm(t)) < gone(middle.position_mm) ? low : high) = t;
    }
    return middle.time_s - low;
}

// What no wire, no PLC and no prediction would leave: each value held for its 30 ms and right in
// the middle of them; in lines from one to the next; and the model where the axes are.
void add_arithmetic(
    const site &s, const std::vector<twin::twin_state> &states, const simulation::travel &way,
    const std::function<void(const char *, const std::vector<twin::twin_state> &)> &add) {
    constexpr double period_s = 0.030;
    const twin::straight_move move(way.from_mm, way.to_mm, way.feed_mm_per_s, s.twin.axes);
    const double began_s = start_s(move, states);
    std::vector<twin::xyz> here, middle, before, after;
    std::vector<double> share;
    for (const auto &state : states) {
        const double periods = state.time_s / period_s, whole = std::floor(periods);
        const auto at = [&](double k) { return place_at(move, k * period_s - began_s); };
        here.push_back(state.position_mm);
        middle.push_back(at(whole + 0.5));
        before.push_back(at(whole));
        after.push_back(at(whole + 1.0));
        share.push_back(periods - whole);
    }
    add("computed: positions known ahead, values at once", computed(s, states, middle));
    auto lines = computed(s, states, before);
    const auto ends = computed(s, states, after);
    for (std::size_t i = 0; i < lines.size(); ++i) {
        for (std::size_t a = 0; a < 3; ++a) {
            for (std::size_t drive = 0; drive < 2; ++drive) {
                double &um = lines[i].drive_um[a][drive];
                um += share[i] * (ends[i].drive_um[a][drive] - um);
            }
        }
    }
    add("computed: positions known ahead, in lines", lines);
    add("computed: the model, everywhere and at once", computed(s, states, here));
}

// One machine on all paths.
void judge(const site &s, const simulation::scenario &plan, double feed_mm_per_min, table &to) {
    const twin::twin_machine twin(s.twin);
    for (const auto &path : plan.paths) {
        const simulation::travel way{path.from_mm, path.to_mm, feed_mm_per_min / 60.0};
        const auto add = [&](const char *name, const std::vector<twin::twin_state> &states) {
            std::vector<twin::xyz> places;
            for (const auto &state : states) places.push_back(state.position_mm);
            const auto before = simulation::true_errors(twin, simulation::uncompensated(states));
            const auto after = simulation::true_errors(twin, states);
            twin::xyz percent = {};
            for (std::size_t a = 0; a < directions; ++a) {
                percent[a] = simulation::direction_figures::reduction(
                    simulation::range_along(path, places, before, a),
                    simulation::range_along(path, places, after, a));
            }
            to.add(path.name, name, percent);
        };
        std::vector<twin::twin_state> states;
        for (const auto &one : variants) {
            site changed = s;
            one.change(changed);
            states = travelled(changed, way);
            add(one.name, states);
        }
        add_arithmetic(s, travelled(s, way), way, add);
    }
}

void report(const char *scenario_file, const std::string &folder) {
    const simulation::scenario plan = simulation::load_scenario(scenario_file);
    const double feed = plan.moving_mm_per_min.back();
    table result;
    for (const auto seed : plan.seeds) {
        const std::string file = folder + "/seed-" + std::to_string(seed) + "/" +
                                 plan.methods.front().name + "/coefficients.json";
        twin::twin_config twin = twin::load_twin(plan.twin);
        twin.seed = seed;
        judge({twin,
               *coefficients::load_coefficients(file),
               fakeplc::load_register_map(file),
               {std::llround(1e3 * plan.read_ms), std::llround(1e3 * plan.write_ms)}},
              plan, feed, result);
    }
    std::printf("%g m/min; less of the error in per cent, median and worst of %zu machines\n\n",
                feed / 1000, plan.seeds.size());
    result.print();
}

}  // namespace

int main(int count, char **arguments) {
    if (count != 3) {
        std::fputs("usage: motion_budget SCENARIO.json FOLDER   (of compbox simulate)\n", stderr);
        return 2;
    }
    try {
        report(arguments[1], arguments[2]);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return 0;
}
