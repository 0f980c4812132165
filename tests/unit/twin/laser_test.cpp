// SPDX-License-Identifier: MIT
// The virtual laser: where it measures, what noise it adds, what it writes.
#include "host-tools/twin/laser.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/file.h"
#include "tests/support/paths.h"
#include "tests/support/temporary.h"

namespace compbox::twin {
namespace {

const std::string folder = from_source("examples/gantry-straightness");
const std::string example = folder + "/machine_twin.json";

TEST(Laser, TargetsIncludeBothEndsAndTheShortLastInterval) {
    const twin_machine twin(load_twin(example));
    const virtual_laser laser(twin);
    const auto x = laser.targets_mm('X'), y = laser.targets_mm('Y'), z = laser.targets_mm('Z');
    ASSERT_EQ(x.size(), 61u);  // 0, 240 … 14160, … and 14300
    EXPECT_EQ(x.front(), 0.0);
    EXPECT_EQ(x[58], 13920.0);
    EXPECT_EQ(x[59], 14160.0);
    EXPECT_EQ(x.back(), 14300.0);
    ASSERT_EQ(y.size(), 26u);  // 3000 is a multiple of 120
    EXPECT_EQ(y[24], 2880.0);
    EXPECT_EQ(y.back(), 3000.0);
    ASSERT_EQ(z.size(), 22u);
    EXPECT_EQ(z[20], 2400.0);
    EXPECT_EQ(z.back(), 2500.0);
}

// Readings less the truth, and from them the line of the set-up.
struct residuals {
    std::vector<double> x, e;
    double slope = 0.0, offset = 0.0;
};

residuals residuals_of(const twin_machine &twin, const laser_series &series) {
    residuals r;
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const auto &reading : series.readings) {
        r.x.push_back(reading.position_mm);
        r.e.push_back(reading.error_um - twin.curve_um(series.name, reading.position_mm));
        sx += r.x.back(), sy += r.e.back();
        sxx += r.x.back() * r.x.back(), sxy += r.x.back() * r.e.back();
    }
    const double n = static_cast<double>(r.x.size());
    r.slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    r.offset = (sy - r.slope * sx) / n;
    return r;
}

TEST(Laser, NoiseIsAsStatedAndNothingElseIsAdded) {
    twin_config config = load_twin(example);
    config.unexplained_percent = 0.0;
    config.laser.runs = 300;
    config.repeatability_um = 0.4;
    const twin_machine twin(config);
    const residuals r = residuals_of(twin, virtual_laser(twin).measure("EXZ"));
    double squares = 0.0, lag = 0.0, before = 0.0;
    for (std::size_t i = 0; i < r.x.size(); ++i) {
        const double e = r.e[i] - r.offset - r.slope * r.x[i];
        squares += e * e;
        lag += e * before;
        before = e;
    }
    const double n = static_cast<double>(r.x.size());
    EXPECT_NEAR(std::sqrt(squares / n), 0.5, 0.015);  // 0.4 and 0.3 together
    EXPECT_NEAR(lag / squares, 0.0, 0.05);
}

// Standard deviation of the readings between the runs.
double noise_between_runs(const twin_machine &twin, const char *name) {
    std::map<double, std::vector<double>> at;
    for (const auto &reading : virtual_laser(twin).measure(name).readings) {
        at[reading.position_mm].push_back(reading.error_um);
    }
    double squares = 0.0, freedom = 0.0;
    for (const auto &[position_mm, errors] : at) {
        const double n = static_cast<double>(errors.size());
        double mean = 0.0;
        for (const double e : errors) mean += e / n;
        for (const double e : errors) squares += (e - mean) * (e - mean);
        freedom += n - 1.0;
    }
    return std::sqrt(squares / freedom);
}

TEST(Laser, EachInstrumentHasItsOwnNoise) {
    twin_config config = load_twin(from_source("examples/nine-line/machine_twin.json"));
    config.unexplained_percent = config.repeatability_um = 0.0;
    config.laser.runs = 100;
    config.laser.sigma_um = 0.2;
    EXPECT_NEAR(noise_between_runs(twin_machine(config), "EYX"), 0.2, 0.01);
    config.laser.straightness_um = 1.5;
    const twin_machine twin(config);
    EXPECT_NEAR(noise_between_runs(twin, "EXX"), 0.2, 0.01);
    EXPECT_NEAR(noise_between_runs(twin, "EYX"), 1.5, 0.05);
    EXPECT_NEAR(noise_between_runs(twin, "ECX"), 0.2, 0.01);  // angles have the laser's
}

TEST(Laser, EachSetUpHasItsOwnSlopeAndOffsetWithinTheStatedSizes) {
    twin_config config = load_twin(example);
    config.unexplained_percent = 0.0;
    config.repeatability_um = config.laser.sigma_um = 0.0;
    double least = 1e9, most = -1e9;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        config.seed = seed;
        const twin_machine twin(config);
        const virtual_laser laser(twin);
        for (const char *name : {"EZX", "EYX"}) {
            const residuals r = residuals_of(twin, laser.measure(name));
            EXPECT_LE(std::fabs(r.slope), 0.01 + 1e-6);  // 10 µrad: 0.01 µm per mm
            EXPECT_LE(std::fabs(r.offset), 50.0 + 0.01);
            least = std::min(least, r.slope), most = std::max(most, r.slope);
        }
        EXPECT_GT(std::fabs(residuals_of(twin, laser.measure("EZX")).slope -
                            residuals_of(twin, laser.measure("EYX")).slope),
                  1e-6);
    }
    EXPECT_LT(least, -0.008);
    EXPECT_GT(most, 0.008);
}

TEST(Laser, WithoutNoiseAndSetUpItShowsTheCurveToItsResolution) {
    twin_config config = load_twin(example);
    config.unexplained_percent = 0.0;
    config.repeatability_um = config.laser.sigma_um = 0.0;
    config.laser.slope_urad = config.laser.offset_um = 0.0;
    const twin_machine twin(config);
    for (const auto &reading : virtual_laser(twin).measure("EZY").readings) {
        EXPECT_NEAR(reading.error_um, twin.curve_um("EZY", reading.position_mm), 0.005 + 1e-9);
        EXPECT_NEAR(reading.error_um * 100.0, std::round(reading.error_um * 100.0), 1e-6);
    }
}

TEST(Laser, TheUnexplainedPartIsInEveryReading) {
    twin_config config = load_twin(example);
    config.repeatability_um = config.laser.sigma_um = 0.0;
    config.laser.slope_urad = config.laser.offset_um = 0.0;
    const twin_machine twin(config);
    double least = 1e9, most = -1e9;
    for (const auto &reading : virtual_laser(twin).measure("EZX").readings) {
        const double rest = reading.error_um - twin.curve_um("EZX", reading.position_mm);
        least = std::min(least, rest), most = std::max(most, rest);
    }
    EXPECT_GT(most - least, 0.3);  // 1.5 % of some 250 µm is its most
    EXPECT_LT(most - least, 4.5);
}

TEST(Laser, RemeasurementReadsTheCompensatedToolWithFreshNoise) {
    const twin_machine twin(load_twin(example));
    virtual_laser laser(twin);
    const xyz p = {1000.0, 2000.0, 500.0}, applied = {10.0, -20.0, 30.0};
    const xyz truth = twin.true_error_um(p, applied);
    xyz sum = {}, squares = {};
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i) {
        const xyz reading = laser.read_tool_error_um(p, applied);
        for (std::size_t a = 0; a < 3; ++a) {
            sum[a] += reading[a] - truth[a];
            squares[a] += std::pow(reading[a] - truth[a], 2.0);
        }
    }
    for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(sum[a] / n, 0.0, 0.015);
        EXPECT_NEAR(std::sqrt(squares[a] / n), std::hypot(0.3, 0.3), 0.01);
    }
}

TEST(Laser, ACsvReadsBackAsItWasMeasured) {
    const laser_series series{"EZX", {{0.0, -1.25, 1}, {240.0, 0.07, 1}, {0.0, -0.0, 2}}};
    const std::string path = compbox_test::temporary("laser.csv");
    formats::write_file(path, laser_csv(series));
    EXPECT_EQ(formats::read_file(path),
              "position_mm,error_um,run\n0,-1.25,1\n240,0.07,1\n0,-0,2\n");
    const formats::csv_table table = formats::read_csv(path);
    EXPECT_EQ(table.values("error_um"), (std::vector<double>{-1.25, 0.07, 0.0}));
}

// The files of the example are what virtual-laser makes of its twin, to the byte.
TEST(Laser, ExampleMeasurementsAreReproducible) {
    const std::string made = compbox_test::temporary("measurements");
    const auto paths = measure_all(twin_machine(load_twin(example)), made);
    ASSERT_EQ(paths.size(), 6u);
    for (const auto &path : paths) {
        const std::string name = std::filesystem::path(path).filename();
        EXPECT_EQ(formats::read_file(path), formats::read_file(folder + "/measurements/" + name))
            << name;
    }
}

TEST(Laser, ProgramSaysWhatIsWrongAndASeedIsAnotherMachine) {
    const std::string program = built("virtual-laser") + " ";
    const std::string to = compbox_test::temporary("program");
    const auto code = [](const std::string &command) {
        return WEXITSTATUS(std::system((command + " >/dev/null 2>&1").c_str()));
    };
    EXPECT_EQ(code(program + "--help"), 0);
    EXPECT_EQ(code(program + "-o " + to), 2);
    EXPECT_EQ(code(program + "--machine missing.json -o " + to), 1);
    EXPECT_EQ(code(program + "--machine " + example + " -o /proc/none"), 1);
    EXPECT_FALSE(std::filesystem::exists(to));
    ASSERT_EQ(code(program + "--machine " + example + " --seed 3 -o " + to), 0);
    twin_config config = load_twin(example);
    config.seed = 3;
    const twin_machine twin(config);
    EXPECT_EQ(formats::read_file(to + "/EZX.csv"), laser_csv(virtual_laser(twin).measure("EZX")));
    EXPECT_NE(formats::read_file(to + "/EZX.csv"),
              formats::read_file(folder + "/measurements/EZX.csv"));
}

}  // namespace
}  // namespace compbox::twin
