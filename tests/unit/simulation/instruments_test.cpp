// SPDX-License-Identifier: MIT
// The nine lines, the diagonals and the touch probe without noise against their formulas; the words
// of a step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/rtl.h"
#include "host-tools/formats/table_text.h"
#include "host-tools/simulation/day.h"
#include "host-tools/simulation/step_words.h"
#include "host-tools/twin/diagonals.h"
#include "host-tools/twin/nine_line.h"
#include "tests/support/paths.h"
#include "tests/support/temporary.h"

namespace compbox {
namespace {

const std::string example = from_source("examples/nine-line/machine_twin.json");

formats::laser_file read_laser(const std::string &path) {
    return formats::read_laser_text(path, formats::read_table_text(path));
}

// The example's machine, and a laser and a person who are perfect.
twin::twin_config noiseless() {
    twin::twin_config config = twin::load_twin(example);
    config.unexplained_percent = config.repeatability_um = config.laser.sigma_um = 0.0;
    config.laser.slope_urad = config.laser.offset_um = 0.0;
    return config;
}

TEST(TouchProbe, ShowsWholeStepsOfItsResolution) {
    for (const auto &[resolution_um, shown_um] :
         {std::pair{0.1, 7.1}, {1.0, 7.0}, {2.0, 8.0}, {5.0, 5.0}, {100.0, 0.0}}) {
        const simulation::part_probe kind{0.0, 0.0, resolution_um};
        simulation::touch_probe probe(kind, 1, "");
        for (const double um : probe.touch({7.13, 7.13, 7.13})) EXPECT_EQ(um, shown_um);
    }
}

TEST(NineLine, FilesHoldWhatTheCarriageDoesAtThePoints) {
    const twin::twin_machine twin(noiseless());
    twin::nine_line_options options;
    options.axis = 'Y';
    options.points_mm = {twin::xyz{-100, 200, 300}, twin::xyz{50, -250, 80},
                         twin::xyz{320, 10, -40}};
    const std::string folder = compbox_test::temporary("nine");
    const auto paths = twin::measure_nine_lines(twin, options, folder);
    ASSERT_EQ(paths.size(), 9u);
    EXPECT_EQ(paths[5], folder + "/P2z.rtl");
    for (std::size_t line = 0; line < 9; ++line) {
        const formats::laser_file file = read_laser(paths[line]);
        ASSERT_EQ(file.runs.size(), 5u);
        ASSERT_EQ(file.targets_mm.size(), 21u);
        for (std::size_t i = 0; i < file.targets_mm.size(); ++i) {
            const twin::xyz moved = twin.geometry().carriage_point_um(
                1, options.points_mm[line / 3], file.targets_mm[i]);
            EXPECT_NEAR(file.runs[3].deviation[i], moved[line % 3], 0.0051) << paths[line];
        }
    }
}

TEST(NineLine, AWarmScaleShowsAlongTheAxisOnly) {
    const twin::twin_machine twin(noiseless());
    twin::nine_line_options options;
    options.points_mm = {twin::xyz{-100, 200, 300}, twin::xyz{50, -250, 80},
                         twin::xyz{320, 10, -40}};
    const std::string cold = compbox_test::temporary("cold"),
                      warm = compbox_test::temporary("warm");
    twin::measure_nine_lines(twin, options, cold);
    options.scale_ppm_per_degC = 11.0;
    options.temperature_degC = 22.0;
    twin::measure_nine_lines(twin, options, warm);
    for (const char *name : {"/P1x.rtl", "/P1y.rtl", "/P3z.rtl"}) {
        const formats::laser_file a = read_laser(cold + name), b = read_laser(warm + name);
        const double at_mm = a.targets_mm[10];
        const double more = name[3] == 'x' ? 22e-3 * at_mm : 0.0;
        EXPECT_NEAR(b.runs[0].deviation[10] - a.runs[0].deviation[10], more, 0.011) << name;
    }
}

TEST(NineLine, EachLineIsASetUpOfItsOwn) {
    twin::twin_config config = noiseless();
    config.laser.slope_urad = 60.0;
    config.laser.offset_um = 40.0;
    config.errors.clear();
    const twin::twin_machine twin(config);
    twin::nine_line_options options;
    options.points_mm = {twin::xyz{-100, 200, 300}, twin::xyz{50, -250, 80},
                         twin::xyz{320, 10, -40}};
    const auto paths = twin::measure_nine_lines(twin, options, compbox_test::temporary("set-ups"));
    std::vector<double> starts;
    for (std::size_t line = 0; line < 9; ++line) {
        const formats::laser_file file = read_laser(paths[line]);
        const auto &run = file.runs[0].deviation;
        const double slope = (run.back() - run.front()) / 4000.0;
        EXPECT_LE(std::fabs(slope), 0.06 + 1e-5);
        if (line % 3 == 0) {
            EXPECT_NEAR(slope, 0.0, 1e-5);  // along the axis a beam has none
        }
        starts.push_back(run.front());
    }
    std::sort(starts.begin(), starts.end());
    EXPECT_EQ(std::unique(starts.begin(), starts.end()), starts.end());
}

TEST(Diagonals, AreTwelveOfTheFacesAndFourOfTheBody) {
    const twin::twin_machine twin(noiseless());
    const auto readings =
        twin::measure_diagonals(twin, {500, 300, 100}, {3500, 1700, 900}, 3,
                                [](const twin::xyz &place) { return twin::state_at(place); });
    std::map<std::string, std::vector<twin::xyz>> targets;
    for (const auto &one : readings) {
        if (one.run == 1) targets[one.diagonal].push_back(one.position_mm);
    }
    EXPECT_EQ(targets.size(), 16u);
    using places = std::vector<twin::xyz>;
    EXPECT_EQ(targets.at("XZ high falling"),
              (places{{500, 1700, 900}, {2000, 1700, 500}, {3500, 1700, 100}}));
    EXPECT_EQ(targets.at("body Y Z falling"),
              (places{{500, 1700, 900}, {2000, 1000, 500}, {3500, 300, 100}}));
}

TEST(Diagonals, ShowSquarenessAsTheFormulaOfSquarenessSays) {
    twin::twin_config config = noiseless();
    config.errors.clear();
    config.chain.c0y_urad = 18.0;
    config.chain.b0z_urad = -11.0;
    config.chain.a0z_urad = 7.0;
    config.laser.resolution_um = 1e-6;
    const twin::twin_machine twin(config);
    const auto readings =
        twin::measure_diagonals(twin, {500, 300, 100}, {1300, 1100, 900}, 2,
                                [](const twin::xyz &place) { return twin::state_at(place); });
    const auto longer_um = [&](const std::string &diagonal) {
        double first = 0.0, last = 0.0;
        for (auto one = readings.rbegin(); one != readings.rend(); ++one) {
            if (one->diagonal == diagonal) first = one->error_um;
        }
        for (const auto &one : readings) {
            if (one.diagonal == diagonal) last = one.error_um;
        }
        return last - first;
    };
    const std::pair<std::string, double> opening_urad[] = {{"XY", 18.0}, {"XZ", 11.0}, {"YZ", 7.0}};
    for (const auto &[face, urad] : opening_urad) {
        for (const std::string side : {" low", " high"}) {
            const double difference_um =
                longer_um(face + side + " falling") - longer_um(face + side + " rising");
            EXPECT_NEAR(1e3 * difference_um * std::sqrt(2.0) / (2.0 * 800.0), urad, 0.02) << face;
        }
    }
}

TEST(Diagonals, AreMeasuredWithTheCompensationAtWork) {
    const twin::twin_machine twin(noiseless());
    const auto perfect = twin::measure_diagonals(
        twin, {500, 300, 100}, {1300, 900, 700}, 3, [&](const twin::xyz &place) {
            const twin::xyz error = twin.explained_error_um(twin::state_at(place));
            return twin::state_at(place, {-error[0], -error[1], -error[2]});
        });
    for (const auto &one : perfect) EXPECT_NEAR(one.error_um, 0.0, 0.011) << one.diagonal;
}

TEST(Steps, WordsAreAsAShellMakesThem) {
    const twin::twin_machine twin(noiseless());
    const std::string note = compbox_test::temporary("note.txt");
    formats::write_file(note, "1,2,-3\n");
    const simulation::step_world world{twin, "s.json", {{"out", "a b"}, {"note", note}}, nullptr};
    using words = std::vector<std::string>;
    EXPECT_EQ(simulation::words_of("fit  $out/X.csv -o $out", world),
              (words{"fit", "a b/X.csv", "-o", "a b"}));
    EXPECT_EQ(simulation::words_of("P{1,2}{x,y}.rtl", world),
              (words{"P1x.rtl", "P1y.rtl", "P2x.rtl", "P2y.rtl"}));
    EXPECT_EQ(simulation::words_of("--box=-1:1 $($note) 5$", world),
              (words{"--box=-1:1", "1,2,-3", "5$"}));
    EXPECT_EQ(simulation::words_of("  ", world), words{});
    EXPECT_THROW(simulation::words_of("$nothing", world), input_error);
    EXPECT_THROW(simulation::words_of("$(missing.txt)", world), input_error);
}

}  // namespace
}  // namespace compbox
