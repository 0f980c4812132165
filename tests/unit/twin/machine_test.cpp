// SPDX-License-Identifier: MIT
// The simulated machine: its random curves, its file and its axes.
#include "host-tools/twin/machine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <set>

#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/twin/motion.h"
#include "tests/support/paths.h"
#include "tests/support/temporary.h"

namespace compbox::twin {
namespace {

const std::string gantry = from_source("examples/gantry-straightness/machine_twin.json");
constexpr double two_pi = 6.28318530717958647692;

// ---- random numbers

TEST(Random, SameNumbersOnEveryPlatform) {
    random_stream stream(2015, "curve EZX");
    EXPECT_EQ(stream.next(), 0x6D471D58471A9135u);
    EXPECT_EQ(stream.next(), 0xEC197AE4DBA87840u);
    EXPECT_EQ(stream.next(), 0xCB883E05F68483F5u);
    EXPECT_DOUBLE_EQ(random_stream(7, "x").normal(), -0.30431572824897279);
}

TEST(Random, StreamsDifferBySeedAndByPurpose) {
    std::set<std::uint64_t> first;
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
        for (const char *purpose : {"", "a", "b", "curve EZX", "curve EXZ"}) {
            first.insert(random_stream(seed, purpose).next());
        }
    }
    EXPECT_EQ(first.size(), 500u);
}

TEST(Random, NormalHasTheMomentsAndTailsOfANormal) {
    random_stream stream(1, "moments");
    constexpr int n = 400000;
    double m1 = 0, m2 = 0, m3 = 0, m4 = 0, lag = 0, before = 0;
    int beyond2 = 0;
    for (int i = 0; i < n; ++i) {
        const double x = stream.normal();
        m1 += x, m2 += x * x, m3 += x * x * x, m4 += x * x * x * x;
        lag += x * before;
        before = x;
        beyond2 += std::fabs(x) > 2.0;
    }
    EXPECT_NEAR(m1 / n, 0.0, 0.008);
    EXPECT_NEAR(m2 / n, 1.0, 0.012);
    EXPECT_NEAR(m3 / n, 0.0, 0.025);
    EXPECT_NEAR(m4 / n, 3.0, 0.08);
    EXPECT_NEAR(lag / n, 0.0, 0.008);
    EXPECT_NEAR(static_cast<double>(beyond2) / n, 0.0455, 0.0015);
}

// ---- curves

random_curve x_curve(std::uint64_t seed, double amplitude_um = 200.0) {
    return {0.0, 14300.0, amplitude_um, {2.5, 8.0, 1200.0}, random_stream(seed, "curve EZX")};
}

TEST(Curve, RangeAboutItsLineIsExact) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const double amplitude_um = 10.0 + 10.0 * static_cast<double>(seed);
        const random_curve curve(-250.0, 2250.0, amplitude_um, {2.5, 8.0, 600.0},
                                 random_stream(seed, "c"));
        // A line through the curve's own reference points, by normal equations in raw positions.
        constexpr int n = random_curve::reference_points;
        double sx = 0, sy = 0, sxx = 0, sxy = 0;
        std::vector<double> xs, ys;
        for (int i = 0; i < n; ++i) {
            xs.push_back(-250.0 + 2500.0 * i / (n - 1));
            ys.push_back(curve(xs.back()));
            sx += xs.back(), sy += ys.back();
            sxx += xs.back() * xs.back(), sxy += xs.back() * ys.back();
        }
        const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
        const double offset = (sy - slope * sx) / n;
        EXPECT_NEAR(slope, 0.0, 1e-10 * amplitude_um);
        EXPECT_NEAR(offset, 0.0, 1e-9 * amplitude_um);
        double low = 1e9, high = -1e9;
        for (int i = 0; i < n; ++i) {
            const double y =
                ys[static_cast<std::size_t>(i)] - offset - slope * xs[static_cast<std::size_t>(i)];
            low = std::min(low, y), high = std::max(high, y);
        }
        EXPECT_NEAR(high - low, amplitude_um, 1e-8 * amplitude_um);
    }
}

TEST(Curve, IsDeterministicAndAnotherSeedIsAnotherCurve) {
    const random_curve a = x_curve(2015), b = x_curve(2015), c = x_curve(2016);
    for (double x = -100.0; x <= 14400.0; x += 37.0) EXPECT_EQ(a(x), b(x));
    EXPECT_GT(std::fabs(a(5000.0) - c(5000.0)), 1e-3);
    EXPECT_NEAR(a(0.0), -41.33808466, 1e-6);
    EXPECT_NEAR(a(7150.0), -1.261088639, 1e-6);
    EXPECT_NEAR(a(14300.0), -20.71431889, 1e-6);
}

TEST(Curve, ZeroAmplitudeIsZero) {
    const random_curve flat = x_curve(3, 0.0);
    for (double x = 0.0; x <= 14300.0; x += 311.0) EXPECT_EQ(flat(x), 0.0);
}

// Power at one wavelength, Hann window, by a plain Fourier sum.
double power(const random_curve &curve, double length_mm, double wavelength_mm) {
    constexpr int n = 200;  // every 71.5 mm, shortest wavelength in the curve 300 mm
    std::complex<double> sum = 0.0;
    for (int i = 0; i < n; ++i) {
        const double u = static_cast<double>(i) / n, x = u * length_mm;
        const double window = 1.0 - std::cos(two_pi * u);
        sum += window * curve(x) * std::polar(1.0, -two_pi * x / wavelength_mm);
    }
    return std::norm(sum);
}

// Mean over many curves.
double mean_power(double wavelength_mm) {
    constexpr int curves = 400;
    static const std::vector<random_curve> some = [] {
        std::vector<random_curve> made;
        for (std::uint64_t seed = 0; seed < curves; ++seed) made.push_back(x_curve(seed));
        return made;
    }();
    double sum = 0.0;
    for (const auto &curve : some) sum += power(curve, 14300.0, wavelength_mm);
    return sum / curves;
}

TEST(Curve, SpectrumIsThePowerLawAboveTheCutoff) {
    double sl = 0, sp = 0, sll = 0, slp = 0;
    int n = 0;
    for (double wavelength_mm = 4000.0; wavelength_mm > 1800.0; wavelength_mm /= 1.12, ++n) {
        const double l = -std::log(wavelength_mm), p = std::log(mean_power(wavelength_mm));
        sl += l, sp += p, sll += l * l, slp += l * p;
    }
    const double exponent = (n * slp - sl * sp) / (n * sll - sl * sl);
    EXPECT_NEAR(exponent, -2.5, 0.3);
}

TEST(Curve, SpectrumRollsOffBelowTheCutoff) {
    const double at_cutoff = mean_power(1200.0), above = mean_power(2400.0);
    const double below = mean_power(600.0);
    const double power_law = std::pow(2.0, -2.5);
    EXPECT_NEAR(at_cutoff / above / power_law, 0.5, 0.15);
    EXPECT_NEAR(below / above / (power_law * power_law), 1.0 / 257.0, 1.5 / 257.0);
}

// ---- the machine

// 4 x 4 matrices of a machine of 14 m, in double: 1e-16 of the travel.
constexpr double matrix_um = 1e-7;

TEST(Machine, ErrorInSpaceIsTheSumOfItsCurves) {
    twin_config config = load_twin(gantry);
    config.unexplained_percent = 0.0;
    const twin_machine twin(config);
    const xyz p = {3456.7, 1234.5, 678.9};
    const xyz e = twin.true_error_um(p);
    EXPECT_NEAR(e[0], twin.curve_um("EXY", p[1]) + twin.curve_um("EXZ", p[2]), matrix_um);
    EXPECT_NEAR(e[1], twin.curve_um("EYX", p[0]) + twin.curve_um("EYZ", p[2]), matrix_um);
    EXPECT_NEAR(e[2], twin.curve_um("EZX", p[0]) + twin.curve_um("EZY", p[1]), matrix_um);
    const xyz after = twin.true_error_um(p, {1.0, -2.0, 3.0});
    EXPECT_NEAR(after[0], e[0] + 1.0, matrix_um);
    EXPECT_NEAR(after[1], e[1] - 2.0, matrix_um);
    EXPECT_NEAR(after[2], e[2] + 3.0, matrix_um);
}

TEST(Machine, ACurveDoesNotDependOnWhichOthersThereAre) {
    twin_config config = load_twin(gantry);
    const double before = twin_machine(config).curve_um("EZX", 5000.0);
    config.errors["EXX"].amplitude = 100.0;
    config.errors.erase("EYX");
    config.unexplained_percent = 0.0;
    const twin_machine other(config);
    EXPECT_EQ(other.curve_um("EZX", 5000.0), before);
    EXPECT_NEAR(
        other.true_error_um({1000.0, 0.0, 0.0})[0],
        other.curve_um("EXX", 1000.0) + other.curve_um("EXY", 0.0) + other.curve_um("EXZ", 0.0),
        matrix_um);
}

TEST(ErrorName, IsTakenApartAsInIso230) {
    ASSERT_TRUE(parse_error_name("EZX"));
    EXPECT_EQ(parse_error_name("EZX")->direction, 2);
    EXPECT_EQ(parse_error_name("EZX")->axis, 0);
    EXPECT_EQ(parse_error_name("EAY")->direction, 3);
    for (const char *bad : {"", "E", "EZ", "EZXX", "ezx", "AZX", "EDX", "EXA"}) {
        EXPECT_FALSE(parse_error_name(bad)) << bad;
    }
}

// ---- the twin file

TEST(TwinFile, ExampleReadsAsWritten) {
    const twin_config config = load_twin(gantry);
    EXPECT_EQ(config.seed, 2015u);
    EXPECT_EQ(config.axes[0].max_mm, 14300.0);
    EXPECT_EQ(config.axes[1].max_mm, 3000.0);
    EXPECT_EQ(config.axes[2].max_mm, 2500.0);
    const std::map<std::string, double> amplitudes = {{"EZX", 200}, {"EYX", 79}, {"EZY", 52},
                                                      {"EXY", 25},  {"EXZ", 20}, {"EYZ", 35}};
    ASSERT_EQ(config.errors.size(), amplitudes.size());
    for (const auto &[name, um] : amplitudes) EXPECT_EQ(config.errors.at(name).amplitude, um);
    EXPECT_EQ(config.repeatability_um, 0.3);
    EXPECT_EQ(config.laser.sigma_um, 0.3);
    EXPECT_EQ(config.laser.runs, 3);
    ASSERT_EQ(config.program.size(), 3u);
    EXPECT_DOUBLE_EQ(config.program[1].feed_mm_per_s, 10000.0 / 60.0);
    EXPECT_EQ(config.coefficients, from_source("examples/gantry-straightness/machine.json"));
}

// The sentence that load_twin gives for a text, without the file's name.
std::string complaint(const std::string &text) {
    const std::string path = compbox_test::temporary("twin.json");
    formats::write_file(path, text);
    std::string sentence = "none";
    try {
        load_twin(path);
    } catch (const input_error &error) {
        sentence = error.what();
    }
    const auto start = sentence.find(path);
    return start == 0 ? sentence.substr(path.size() + 2) : sentence;
}

std::string with_axis_x(const std::string &rest) {
    return R"({"format": "compbox-twin/1", "axes": {"X": {"travel_mm": [0, 1000],
        "max_velocity_mm_per_min": 6000, "acceleration_mm_per_s2": 100}})" +
           rest + "}";
}

TEST(TwinFile, SaysWhatIsWrongAndWhere) {
    const std::pair<std::string, std::string> cases[] = {
        {with_axis_x(""), "none"},
        {R"({"axes": {}})", "format: must be \"compbox-twin/1\""},
        {R"({"format": "compbox-twin/1"})", "axes: must be an object with the axes"},
        {R"({"format": "compbox-twin/1", "axes": {"W": {}}})", "axes: 'W' is not an axis"},
        {R"({"format": "compbox-twin/1", "axes": {"X": {"travel_mm": [5, 5],
            "max_velocity_mm_per_min": 1, "acceleration_mm_per_s2": 1}}})",
         "axes.X.travel_mm: must be at least 1 mm long"},
        {with_axis_x(R"(, "sped": 1)"), "the file: the key 'sped' is unknown"},
        {with_axis_x(R"(, "seed": -1)"), "seed: must be a whole number"},
        {with_axis_x(R"(, "seed": 1.5)"), "seed: must be a whole number"},
        {with_axis_x(R"(, "runs": true)"), "runs: must be a number"},
        {with_axis_x(R"(, "runs": 2.5)"), "runs: must be a whole number"},
        {with_axis_x(R"(, "runs": 0)"), "runs: 0 is not between 1 and 1000"},
        {with_axis_x(R"(, "laser_um": -0.1)"), "laser_um: -0.1 is not between 0 and 1000"},
        {with_axis_x(R"(, "straightness_um": "1.5")"), "straightness_um: must be a number"},
        {with_axis_x(R"(, "errors": {"FZX": {}})"), "errors.FZX: is not an ISO 230-1 error name"},
        {with_axis_x(R"(, "errors": {"EZY": {"amplitude_um": 1}})"),
         "errors.EZY: the machine has no axis Y"},
        {with_axis_x(R"(, "errors": {"EAX": {"amplitude_um": 1}})"),
         "errors.EAX: the key 'amplitude_um' is unknown"},
        {with_axis_x(R"(, "errors": {"EXX": {"points": [[0, 1], [0, 2]]}})"),
         "errors.EXX.points[1]: positions must ascend"},
        {with_axis_x(R"(, "errors": {"EXX": {"points": [[0, 1]]}})"),
         "errors.EXX.points: must be two or more [mm, value]"},
        {with_axis_x(R"(, "errors": {"EXX": {"points": [[0, 1], [1, 1]], "amplitude_um": 1}})"),
         "errors.EXX: has points and an amplitude"},
        {with_axis_x(R"(, "chain": "fXY")"),
         "chain: must name the foundation f and each axis once"},
        {with_axis_x(R"(, "stages": {"Y": {}})"), "stages: the machine has no axis Y"},
        {with_axis_x(R"(, "stages": {"X": {"span_mm": 9, "drives": {"X1": {"amplitude_um": 1}}}})"),
         "stages.X.drives: must be two drives by name"},
        {with_axis_x(R"(, "squareness_urad": {"C0Z": 1})"),
         "squareness_urad: the key 'C0Z' is unknown"},
        {with_axis_x(R"(, "unexplained": {"percent": -1})"),
         "unexplained.percent: -1 is not between 0 and 100"},
        {with_axis_x(R"(, "errors": {"EZX": {}})"),
         "errors.EZX: the key 'amplitude_um' is missing"},
        {with_axis_x(R"(, "nc": {"compensation_sign": {"X": 0.5}})"),
         "nc.compensation_sign.X: must be 1 or -1"},
        {with_axis_x(R"(, "program": [{"move_to_mm": {"X": 1001}, "feed_mm_per_min": 1}])"),
         "program[0].move_to_mm.X: 1001 mm is outside the travel 0 to 1000 mm"},
        {with_axis_x(R"(, "program": [{"dwell_s": 1}, {}])"),
         "program[1]: needs 'move_to_mm' or 'dwell_s'"},
        {with_axis_x(R"(, "program": [{"move_to_mm": {"X": 1}}])"),
         "program[0]: the key 'feed_mm_per_min' is missing"},
        {with_axis_x(R"(, "start_mm": {"Y": 0})"), "start_mm: the machine has no axis Y"},
        {with_axis_x(R"(, "channels": {"X1": "Q"})"), "channels.X1: 'Q' is not an axis"},
        {with_axis_x(R"(, "plc": {"size_um": "200"})"), "plc.size_um: must be a number"},
        {with_axis_x(R"(, "plc": {"size_um": -1})"), "plc.size_um"},
        {with_axis_x(R"(, "plc": {"size_um": {"Y": 5}})"),
         "plc.size_um: the machine has no axis Y"},
        {with_axis_x(R"(, "plc": {"ahead_mm": -1})"), "plc.ahead_mm"},
        {R"({"format": "compbox-twin/1",)", "is not valid JSON here"},
    };
    for (const auto &[text, expected] : cases) {
        EXPECT_NE(complaint(text).find(expected), std::string::npos)
            << text << "\n  gives: " << complaint(text);
    }
}

twin_plc plc_of(const std::string &keys) {
    const std::string path = compbox_test::temporary("sizes.json");
    formats::write_file(path, with_axis_x(R"(, "plc": {)" + keys + "}"));
    return load_twin(path).plc;
}

TEST(TwinFile, TheLargestOffsetIsOneNumberOrThatOfEachAxis) {
    EXPECT_EQ(plc_of("").size_um, 500.0);
    EXPECT_EQ(plc_of("").ahead_mm, 40.0);
    const twin_plc same = plc_of(R"("size_um": 120, "ahead_mm": 60)");
    EXPECT_EQ(same.size_um, 120.0);
    EXPECT_EQ(same.ahead_mm, 60.0);
    EXPECT_FALSE(same.axis_size_um[0]);
    const twin_plc own = plc_of(R"("size_um": {"X": 80})");
    EXPECT_EQ(own.axis_size_um[0], 80.0);
    EXPECT_FALSE(own.axis_size_um[1]);
}

// ---- the axes

twin_config two_axes() {
    twin_config config;
    config.axes[0] = {true, 0.0, 1000.0, 100.0, 500.0, 50.0, 250.0, 1};
    config.axes[1] = {true, -500.0, 500.0, 50.0, 1000.0, 50.0, 250.0, 1};
    config.nc = {0.004, 0.01};
    return config;
}

twin_step move_to(double x, double y, double feed_mm_per_s) {
    twin_step step;
    step.target_mm = {x, y, std::nullopt};
    step.feed_mm_per_s = feed_mm_per_s;
    return step;
}

TEST(Motion, NoLimitIsEverExceededAndEveryTargetIsReached) {
    const twin_config config = two_axes();
    nc_motion nc(config);
    random_stream random(4, "moves");
    xyz before = nc.position_mm(), velocity_before = {};
    const double dt = config.nc.interpolation_s;
    for (int i = 0; i < 60; ++i) {
        const double range = i % 3 ? 1.0 : 0.01;  // short moves never reach their feed
        const xyz target = {500.0 + 500.0 * range * random.symmetric(1.0),
                            500.0 * range * random.symmetric(1.0), 0.0};
        nc.queue(move_to(target[0], target[1], 0.5 + 150.0 * random.uniform()));
        while (nc.moving()) {
            nc.step();
            for (std::size_t a = 0; a < 2; ++a) {
                const double velocity = (nc.position_mm()[a] - before[a]) / dt;
                const double acceleration = (velocity - velocity_before[a]) / dt;
                ASSERT_LE(std::fabs(velocity), config.axes[a].max_velocity_mm_per_s * (1.0 + 1e-9));
                ASSERT_LE(std::fabs(acceleration),
                          config.axes[a].acceleration_mm_per_s2 * (1.0 + 1e-6));
                velocity_before[a] = velocity;
            }
            before = nc.position_mm();
        }
        EXPECT_EQ(nc.position_mm()[0], target[0]);
        EXPECT_EQ(nc.position_mm()[1], target[1]);
    }
}

TEST(Motion, AxesMoveTogetherAlongAStraightLineAtTheFeed) {
    twin_config config = two_axes();
    config.start_mm = {100.0, -300.0, 0.0};
    nc_motion nc(config);
    nc.queue(move_to(900.0, 300.0, 40.0));  // 1000 mm of path: 0.8, 0.6
    double peak = 0.0;
    xyz before = nc.position_mm();
    while (nc.moving()) {
        nc.step();
        const xyz p = nc.position_mm();
        EXPECT_NEAR((p[0] - 100.0) / 800.0, (p[1] + 300.0) / 600.0, 1e-12);
        peak = std::max(peak, std::hypot(p[0] - before[0], p[1] - before[1]) / 0.004);
        before = p;
    }
    EXPECT_NEAR(peak, 40.0, 1e-9);
    // X allows 500/0.8 = 625, Y 1000/0.6 = 1667 mm/s²: 1000/40 + 40/625 s.
    EXPECT_NEAR(nc.time_s(), 25.064, 0.008);
}

TEST(Motion, DwellLastsAndTheNextStepFollows) {
    nc_motion nc(two_axes());
    twin_step dwell;
    dwell.dwell_s = 0.1;
    nc.queue(dwell);
    nc.queue(move_to(10.0, 0.0, 100.0));
    for (int i = 0; i < 24; ++i) nc.step();
    EXPECT_EQ(nc.position_mm()[0], 0.0);
    for (int i = 0; i < 200; ++i) nc.step();
    EXPECT_EQ(nc.position_mm()[0], 10.0);
    EXPECT_FALSE(nc.moving());
}

TEST(Motion, RefusesWhatTheMachineCannotDo) {
    nc_motion nc(two_axes());
    EXPECT_THROW(nc.queue(move_to(1000.1, 0.0, 10.0)), input_error);
    EXPECT_THROW(nc.queue(move_to(NAN, 0.0, 10.0)), input_error);
    EXPECT_THROW(nc.queue(move_to(1.0, 0.0, 0.0)), input_error);
    EXPECT_THROW(nc.queue(move_to(1.0, 0.0, NAN)), input_error);
    twin_step z;
    z.target_mm[2] = 1.0;
    z.feed_mm_per_s = 1.0;
    EXPECT_THROW(nc.queue(z), input_error);
    EXPECT_FALSE(nc.moving());
}

TEST(Compensation, StepIsTheOneOfTheManual) {
    twin_config config = two_axes();
    config.axes[0].max_velocity_mm_per_s = 10000.0 / 60.0;
    config.nc = {0.012, 0.01};
    EXPECT_NEAR(nc_motion(config).max_step_um(0), 20.0, 1e-9);  // 10 m/min, 0.01, 12 ms: 0.02 mm
}

TEST(Compensation, ExcessIsSpreadOverLaterCyclesAndTheWholeArrives) {
    nc_motion nc(two_axes());
    const double x_step = nc.max_step_um(0), y_step = nc.max_step_um(1);
    EXPECT_NEAR(x_step, 4.0, 1e-12);
    EXPECT_NEAR(y_step, 2.0, 1e-12);
    nc.set_compensation_um({10.0, -10.0, 0.0});
    const double x[] = {4, 8, 10, 10, 10, 10}, y[] = {-2, -4, -6, -8, -10, -10};
    for (int i = 0; i < 6; ++i) {
        nc.step();
        EXPECT_DOUBLE_EQ(nc.entered_um()[0], x[i]);
        EXPECT_DOUBLE_EQ(nc.entered_um()[1], y[i]);
    }
    random_stream random(5, "asked");
    for (int i = 0; i < 5000; ++i) {
        const xyz before = nc.entered_um();
        if (i % 7 == 0) {
            nc.set_compensation_um({random.symmetric(50.0), random.symmetric(50.0), 0.0});
        }
        nc.step();
        ASSERT_LE(std::fabs(nc.entered_um()[0] - before[0]), x_step * (1.0 + 1e-12));
        ASSERT_LE(std::fabs(nc.entered_um()[1] - before[1]), y_step * (1.0 + 1e-12));
    }
}

TEST(Compensation, SignBelongsToTheControlAndPositionsDoNotShowIt) {
    twin_config config = two_axes();
    config.axes[1].compensation_sign = -1;
    nc_motion nc(config);
    nc.set_compensation_um({1.0, 1.0, 0.0});
    nc.step();
    EXPECT_EQ(nc.displacement_um()[0], 1.0);
    EXPECT_EQ(nc.displacement_um()[1], -1.0);
    EXPECT_EQ(nc.position_mm()[0], 0.0);
}

}  // namespace
}  // namespace compbox::twin
