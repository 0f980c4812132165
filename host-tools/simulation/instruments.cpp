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
        const identification::triple_mm points = identification::read_plan(given->points);
        for (std::size_t p = 0; p < 3; ++p) {
            for (std::size_t a = 0; a < 3; ++a) given->options.points_mm[p][a] = points[p][a];
        }
        given->options.axis = given->axis[0];
        twin::measure_nine_lines(twin, given->options, given->output);
    });
}

// in : the twin outlives app
// out: app has the command diagonals, which measures both diagonals of a face, in mm and µm
void add_diagonals(cli::command &app, const twin::twin_machine &twin) {
    struct arguments {
        std::vector<double> corner, sides;
        std::string compensated, output;
        twin::face rectangle;
    };
    cli::command command =
        app.add_subcommand("diagonals", "A,B,R,F as compbox squareness takes it");
    const auto given = std::make_shared<arguments>();
    command.add_option("--name", given->rectangle.name)
        .required()
        .check(cli::one_of({"C0Y", "B0Z", "A0Z"}));
    command.add_option("--corner-mm", given->corner).required().expected(3).delimiter(',');
    command.add_option("--sides-mm", given->sides).required().expected(2).delimiter(',');
    command.add_option("--compensated", given->compensated);
    command.add_option("-o", given->output).required();
    command.callback([given, &twin](const cli::streams &) {
        twin::face rectangle = given->rectangle;
        std::copy(given->corner.begin(), given->corner.end(), rectangle.corner_mm.begin());
        rectangle.first_mm = given->sides[0];
        rectangle.second_mm = given->sides[1];
        std::shared_ptr<cb_config> config;
        if (!given->compensated.empty())
            config = coefficients::load_coefficients(given->compensated);
        const twin::diagonals found =
            twin::measure_diagonals(twin, rectangle, [&](const twin::xyz &place) {
                return config ? states_at_rest(*config, twin.config(), {place}).front()
                              : twin::state_at(place);
            });
        formats::write_file(given->output,
                            fmt::format("{},{},{},{}\n", rectangle.first_mm, rectangle.second_mm,
                                        found.rising_um, found.falling_um));
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
