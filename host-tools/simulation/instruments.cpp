// SPDX-License-Identifier: MIT
#include "host-tools/simulation/instruments.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>

#include "host-tools/coefficients/load.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/file.h"
#include "host-tools/identification/plan_file.h"
#include "host-tools/simulation/at_rest.h"
#include "host-tools/twin/diagonals.h"
#include "host-tools/twin/laser.h"
#include "host-tools/twin/nine_line.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::simulation {

namespace {

void add_laser(cli::command &app, const twin::twin_machine &twin) {
    cli::command command = app.add_subcommand("laser", "NAME.csv of every error of the twin");
    const auto output = std::make_shared<std::string>();
    command.add_option("-o", *output).required();
    command.callback([output, &twin](const cli::streams &) { twin::measure_all(twin, *output); });
}

// in : the twin outlives app
// out: app has the command nine-line, which writes nine instrument files to a folder
void add_nine_line(cli::command &app, const twin::twin_machine &twin) {
    struct arguments {
        std::string axis, points, output;
        twin::nine_line_options options;
    };
    cli::command command = app.add_subcommand("nine-line", "P1x.rtl … P3z.rtl of one axis");
    const auto given = std::make_shared<arguments>();
    command.add_option("--axis", given->axis).required().check(cli::one_of({"X", "Y", "Z"}));
    command.add_option("--points", given->points).required();
    command.add_option("--scale-ppm-per-degC", given->options.scale_ppm_per_degC);
    command.add_option("--temperature-degC", given->options.temperature_degC);
    command.add_option("-o", given->output).required();
    command.callback([given, &twin](const cli::streams &) {
        given->options.points_mm = identification::read_plan(given->points);
        given->options.axis = given->axis[0];
        twin::measure_nine_lines(twin, given->options, given->output);
    });
}

// in : the twin outlives app
// out: app has the command diagonals, which writes a table for volumetric --diagonals
void add_diagonals(cli::command &app, const twin::twin_machine &twin) {
    struct arguments {
        twin::xyz low_mm, high_mm;
        std::vector<double> low, high;
        std::string compensated, output;
        int targets = 5;
    };
    cli::command command =
        app.add_subcommand("diagonals", "Face and body diagonals of a box, a CSV file");
    const auto given = std::make_shared<arguments>();
    command.add_option("--from-mm", given->low).required().expected(3).delimiter(',');
    command.add_option("--to-mm", given->high).required().expected(3).delimiter(',');
    command.add_option("--targets", given->targets).check(cli::whole_between(2, 100));
    command.add_option("--compensated", given->compensated);
    command.add_option("-o", given->output).required();
    command.callback([given, &twin](const cli::streams &) {
        std::copy(given->low.begin(), given->low.end(), given->low_mm.begin());
        std::copy(given->high.begin(), given->high.end(), given->high_mm.begin());
        std::shared_ptr<cb_config> config;
        if (!given->compensated.empty())
            config = coefficients::load_coefficients(given->compensated);
        const auto at_rest = [&](const twin::xyz &place) {
            return config ? states_at_rest(*config, twin.config(), {place}).front()
                          : twin::state_at(place);
        };
        formats::write_file(given->output,
                            twin::diagonals_text(twin::measure_diagonals(
                                twin, given->low_mm, given->high_mm, given->targets, at_rest)));
    });
}

}  // namespace

void add_instruments(cli::command &app, const twin::twin_machine &twin) {
    app.require_subcommand();
    add_laser(app, twin);
    add_nine_line(app, twin);
    add_diagonals(app, twin);
}

}  // namespace compbox::simulation
