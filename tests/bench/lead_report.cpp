// SPDX-License-Identifier: MIT
// What the lead gains: a fast axis of the twin runs along its wavy straightness, the box
// compensates what the virtual laser measured, and the true lateral error is taken in every cycle
// of the NC while the axis moves at its feed. Prints the table of docs/results/lead.md.
// scripts/report lead runs it.
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "host-tools/coefficients/fit_files.h"
#include "host-tools/coefficients/load.h"
#include "host-tools/fakeplc/plc.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/twin/laser.h"

extern "C" {
#include "hal/cycle.h"
}

using namespace compbox;

namespace {

constexpr int64_t read_us = 5000, write_us = 4000;  // an S7 as Modbus server on a quiet network
constexpr double from_mm = 50, to_mm = 1950;
constexpr double feeds[] = {1000, 10000, 30000};  // mm/min

struct track {
    double rms_um, largest_um, lead_ms;
};

// Box, wire and machine in virtual time: a request reaches the PLC in the middle of its exchange.
class machine_run {
  public:
    machine_run(const cb_config &config, const twin_config &twin, const register_map &map,
                std::size_t direction)
        : direction_(direction),
          plc_(twin, map, *plc_profile::find(map.profile), 0),
          box_(std::make_unique<cb_box>()) {
        box_->config = config;
        cb_box_start(box_.get());
        cb_cycle_start(&cycle_);
    }

    track travel(double feed_mm_per_min) {
        while (box_->mode.mode != CB_MODE_ACTIVE) cycle();
        move(from_mm, 20000);
        sampling_ = true;
        errors_.clear();
        move(to_mm, feed_mm_per_min);
        double squares = 0, largest = 0;
        for (const double e : errors_) {
            squares += e * e;
            largest = std::max(largest, std::fabs(e));
        }
        return {std::sqrt(squares / static_cast<double>(errors_.size())), largest,
                cb_lead_us(&box_->config, &box_->life.lead) * 1e-3};
    }

  private:
    void move(double x_mm, double feed_mm_per_min) {
        twin_step step;
        step.target_mm[0] = x_mm;
        step.feed_mm_per_s = feed_mm_per_min / 60;
        plc_.move(step);
        cycle();
        while (plc_.moving()) cycle();
        for (int i = 0; i < 100; ++i) cycle();
    }
    void cycle() {
        const cb_hal hal = {this, now, tick, read, write, nullptr, nullptr, samples, feed, stop};
        cb_cycle_run(&cycle_, box_.get(), &hal);
        if (box_->mode.mode != CB_MODE_ACTIVE && sampling_) throw input_error("not ACTIVE");
    }
    // Time passes in steps of a millisecond; at the feed the lateral error is taken.
    void pass(int64_t until_us) {
        while (now_us_ < until_us) {
            now_us_ = std::min(now_us_ + 1000, until_us);
            plc_.run_to(now_us_);
            const double x = plc_.nc().position_mm()[0];
            if (!sampling_ || x < from_mm + 300 || x > to_mm - 300) continue;
            const xyz error =
                plc_.twin().true_error_um(plc_.nc().position_mm(), plc_.nc().displacement_um());
            errors_.push_back(error[direction_]);
        }
    }
    byte_string exchange(const byte_string &request, int64_t takes_us) {
        const int64_t start_us = now_us_;
        pass(start_us + takes_us / 2);
        const byte_string reply = plc_.answer(request);
        pass(start_us + takes_us);
        return reply;
    }
    static void append(byte_string &bytes, unsigned word) {
        bytes.push_back(static_cast<uint8_t>(word >> 8));
        bytes.push_back(static_cast<uint8_t>(word & 0xFF));
    }
    static machine_run &of(void *context) { return *static_cast<machine_run *>(context); }

    static int64_t now(void *context) { return of(context).now_us_; }
    static uint32_t tick(void *context) {
        machine_run &run = of(context);
        run.tick_us_ += run.box_->config.period_us;
        run.pass(run.tick_us_);
        return 0;
    }
    static cb_transfer read(void *context, uint16_t start, uint16_t count, uint16_t *registers,
                            int64_t) {
        byte_string request{3};
        append(request, start);
        append(request, count);
        const byte_string reply = of(context).exchange(request, read_us);
        for (size_t i = 0; i < count; ++i)
            registers[i] = static_cast<uint16_t>(reply.at(2 + 2 * i) << 8 | reply.at(3 + 2 * i));
        return CB_TRANSFER_OK;
    }
    static cb_transfer write(void *context, uint16_t start, uint16_t count,
                             const uint16_t *registers, int64_t) {
        byte_string request{16};
        append(request, start);
        append(request, count);
        request.push_back(static_cast<uint8_t>(2 * count));
        for (unsigned i = 0; i < count; ++i) append(request, registers[i]);
        return of(context).exchange(request, write_us).at(0) == 16 ? CB_TRANSFER_OK
                                                                   : CB_TRANSFER_REFUSED;
    }
    static size_t samples(void *, cb_sample *, size_t) { return 0; }
    static void feed(void *) {}
    static bool stop(void *) { return false; }

    std::size_t direction_;
    fake_plc plc_;
    std::unique_ptr<cb_box> box_;
    cb_cycle cycle_ = {};
    int64_t now_us_ = 0, tick_us_ = 0;
    bool sampling_ = false;
    std::vector<double> errors_;
};

track run(cb_config config, const twin_config &twin, const register_map &map, double lead_ms,
          double feed_mm_per_min) {
    config.lead_measured = lead_ms < 0;
    config.lead_us = config.lead_measured ? 0 : static_cast<uint32_t>(lead_ms * 1000);
    return machine_run(config, twin, map, 1).travel(feed_mm_per_min);
}

// The same with a PLC that goes to each value in a straight line of a period.
track run_in_lines(cb_config config, const twin_config &twin, register_map map, double feed) {
    config.plc.interpolate_us = config.period_us;
    map.interpolate_s = 1e-6 * config.period_us;
    return run(config, twin, map, -1, feed);
}

// The lead of 0 … 60 ms that leaves least.
double best_ms(const cb_config &config, const twin_config &twin, const register_map &map,
               double feed) {
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
    twin_config twin;
    std::unique_ptr<cb_config> config;
    register_map map;
};

identified identify(const std::string &inputs, const std::string &error,
                    const std::string &folder) {
    const twin_config twin = load_twin(inputs + "/" + error + "_twin.json");
    const std::string place = folder + "/" + error;
    make_folder(place + "/measurements");
    measure_all(twin_machine(twin), place + "/measurements");
    coefficients::fit_recipe recipe;
    recipe.name = recipe.method = "bspline";
    recipe.line = "least-squares";
    const coefficients::fitted_files fit =
        coefficients::fit_files(place + "/measurements", {error}, recipe,
                                inputs + "/" + error + "_machine.json", place + "/fit");
    return {twin, coefficients::load_coefficients(fit.coefficients),
            load_register_map(fit.coefficients)};
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
        for (int i = 0; i < 2; ++i)
            got[i] = machine_run(*configs[i], found.twin, found.map, 0).travel(feed);
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
