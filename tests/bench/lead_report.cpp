// SPDX-License-Identifier: MIT
// What the lead gains: a fast axis of the twin runs along its wavy straightness, the box
// compensates what the virtual laser measured, and the true lateral error is taken in every cycle
// of the NC while the axis moves at its feed. Prints the table of docs/results/lead.md.
// scripts/report lead runs it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "host-tools/coefficients/fit_files.h"
#include "host-tools/coefficients/load.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/simulation/world.h"
#include "host-tools/twin/laser.h"

using namespace compbox;

namespace {

constexpr simulation::wire_times wire = {5000, 4000};  // an S7 as Modbus server, quiet network
constexpr double from_mm = 50, to_mm = 1950;
constexpr double feeds[] = {1000, 10000, 30000};  // mm/min

struct track {
    double rms_um, largest_um, lead_ms;
};

// To a place on the axis, and three seconds there.
void move(simulation::world &at, double x_mm, double feed_mm_per_min) {
    twin::twin_step step;
    step.target_mm[0] = x_mm;
    step.feed_mm_per_s = feed_mm_per_min / 60;
    at.plc().move(step);
    do at.cycle();
    while (at.plc().moving());
    for (int i = 0; i < 100; ++i) at.cycle();
}

// The true error in a direction while the axis travels at a feed.
track travel(const cb_config &config, const twin::twin_config &twin,
             const fakeplc::register_map &map, std::size_t direction, double feed_mm_per_min) {
    simulation::world at(config, twin, map, wire);
    at.wait_until_active();
    move(at, from_mm, 20000);
    double squares = 0, largest = 0, count = 0;
    at.hooks.after_nc_cycle = [&] {
        const twin::nc_motion &nc = at.plc().nc();
        const double x = nc.position_mm()[0];
        if (x < from_mm + 300 || x > to_mm - 300) return;
        const double error =
            at.plc().twin().true_error_um(nc.position_mm(), nc.displacement_um())[direction];
        squares += error * error;
        largest = std::max(largest, std::fabs(error));
        ++count;
    };
    at.hooks.after_box_cycle = [&] {
        if (!at.is_active()) at.refuse("does not stay ACTIVE");
    };
    move(at, to_mm, feed_mm_per_min);
    return {std::sqrt(squares / count), largest, at.lead_ms()};
}

track run(cb_config config, const twin::twin_config &twin, const fakeplc::register_map &map,
          double lead_ms, double feed_mm_per_min) {
    config.lead_measured = lead_ms < 0;
    config.lead_us = config.lead_measured ? 0 : static_cast<uint32_t>(lead_ms * 1000);
    return travel(config, twin, map, 1, feed_mm_per_min);
}

// The same with a PLC that goes to each value in a straight line of a period.
track run_in_lines(cb_config config, const twin::twin_config &twin, fakeplc::register_map map,
                   double feed) {
    config.plc.interpolate_us = config.period_us;
    map.interpolate_s = 1e-6 * config.period_us;
    return run(config, twin, map, -1, feed);
}

// The lead of 0 … 60 ms that leaves least.
double best_ms(const cb_config &config, const twin::twin_config &twin,
               const fakeplc::register_map &map, double feed) {
    double best = 0, least = 1e9;
    for (double lead = 0; lead <= 60; lead += 2) {
        const double rms = run(config, twin, map, lead, feed).rms_um;
        if (rms < least) {
            least = rms;
            best = lead;
        }
    }
    return best;
}

// What the box knows of one error: measured by the virtual laser, fitted.
struct identified {
    twin::twin_config twin;
    std::unique_ptr<cb_config> config;
    fakeplc::register_map map;
};

identified identify(const std::string &inputs, const std::string &error,
                    const std::string &folder) {
    const twin::twin_config twin = twin::load_twin(inputs + "/" + error + "_twin.json");
    const std::string place = folder + "/" + error;
    formats::make_folder(place + "/measurements");
    twin::measure_all(twin::twin_machine(twin), place + "/measurements");
    coefficients::fit_recipe recipe;
    recipe.name = recipe.method = "bspline";
    recipe.line = "least-squares";
    const coefficients::fitted_files fit =
        coefficients::fit_files(place + "/measurements", {error}, recipe,
                                inputs + "/" + error + "_machine.json", place + "/fit");
    return {twin, coefficients::load_coefficients(fit.coefficients),
            fakeplc::load_register_map(fit.coefficients)};
}

void report_lead(const std::string &inputs, const std::string &folder) {
    const identified found = identify(inputs, "EYX", folder);
    const auto at = [&](double lead, double feed) {
        return run(*found.config, found.twin, found.map, lead, feed);
    };
    std::puts(
        "| feed m/min | no lead: rms, largest µm | 20 ms set | 45 ms set | measured | measured "
        "lead ms | best lead ms | in lines of 30 ms, measured | its lead ms |");
    std::puts("|---|---|---|---|---|---|---|---|---|");
    for (const double feed : feeds) {
        const track none = at(0, feed), shorter = at(20, feed), longer = at(45, feed);
        const track measured = at(-1, feed);
        const track lines = run_in_lines(*found.config, found.twin, found.map, feed);
        std::printf("| %.0f |", feed / 1000);
        for (const track &one : {none, shorter, longer, measured})
            std::printf(" %.2f, %.2f |", one.rms_um, one.largest_um);
        std::printf(" %.1f | %.0f | %.2f, %.2f | %.1f |\n", measured.lead_ms,
                    best_ms(*found.config, found.twin, found.map, feed), lines.rms_um,
                    lines.largest_um, lines.lead_ms);
    }
}

// The same error of the axis itself, with and without slope and reference.
void report_tangent(const std::string &inputs, const std::string &folder) {
    const identified found = identify(inputs, "EXX", folder);
    std::puts("\n| feed m/min | value only: rms, largest µm | with tangent |");
    std::puts("|---|---|---|");
    for (const double feed : feeds) {
        cb_config with = *found.config;
        with.lead_measured = true;
        cb_config without = with;
        without.slopes_count = 0;
        without.channels[0].tangent = false;
        track got[2];
        const cb_config *const configs[] = {&without, &with};
        for (int i = 0; i < 2; ++i) got[i] = travel(*configs[i], found.twin, found.map, 0, feed);
        std::printf("| %.0f | %.2f, %.2f | %.2f, %.2f |\n", feed / 1000, got[0].rms_um,
                    got[0].largest_um, got[1].rms_um, got[1].largest_um);
    }
}

}  // namespace

int main(int count, char **arguments) {
    if (count != 3) {
        std::fputs("usage: lead_report INPUTS FOLDER\n", stderr);
        return 2;
    }
    try {
        report_lead(arguments[1], arguments[2]);
        report_tangent(arguments[1], arguments[2]);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return 0;
}
