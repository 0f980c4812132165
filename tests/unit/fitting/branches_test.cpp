// SPDX-License-Identifier: MIT
// compbox fit: forward and backward branches, the zero at a reference position, and the band.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "tests/support/fitting_fixture.h"

namespace compbox::fitting {
namespace {

double lost(double x) {
    return 3.0 + 0.0005 * x;
}

// Odd runs forward, even ones backward.
measurement both_ways(int runs, double noise, unsigned seed = 1) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    measurement data;
    data.file = "test.csv";
    for (int r = 0; r < runs; ++r) {
        measured_run run;
        run.direction = r % 2 ? -1 : 1;
        for (int i = 0; i < 41; ++i) {
            const double x = 100.0 * i;
            run.position.push_back(x);
            run.error.push_back(wave(x) + 0.5 * run.direction * lost(x) + noise * normal(engine));
            run.sigma.push_back(1.0);
        }
        data.runs.push_back(run);
    }
    average_runs(data);
    return data;
}

template <typename Truth>
double rms_error(const fitted_curve &curve, const Truth &truth) {
    double squares = 0.0;
    for (int i = 0; i <= 1000; ++i) {
        const double off = curve.value(4.0 * i) - truth(4.0 * i);
        squares += off * off / 1001.0;
    }
    return std::sqrt(squares);
}

fit_options with_branches() {
    fit_options options;
    options.branches = true;
    return options;
}

TEST(FitBranches, BothAreNearTheirTruth) {
    const fit_result fit = fit_curve(both_ways(6, 0.5), with_branches());
    ASSERT_EQ(fit.backward.size(), 1u);
    // Less than one reading of three in each direction leaves: the other direction helps.
    EXPECT_LT(rms_error(fit.curve, [](double x) { return wave(x) + 0.5 * lost(x); }), 0.2);
    EXPECT_LT(rms_error(fit.backward[0].curve, [](double x) { return wave(x) - 0.5 * lost(x); }),
              0.2);
}

TEST(FitBranches, AreWrittenAsTheLoaderReadsThem) {
    for (const fit_method method : {fit_method::bspline, fit_method::bspline_lmc,
                                    fit_method::polynomial, fit_method::polyline}) {
        fit_options options = with_branches();
        options.method = method;
        options.reversal_mm = 0.25;
        const json term = fragment_of(fit_curve(both_ways(4, 0.2), options))["terms"][0];
        EXPECT_EQ(term["reversal_mm"], 0.25);
        for (const auto &[key, value] : term["backward"].items()) {
            EXPECT_TRUE(term.contains(key)) << key;
            EXPECT_EQ(value.type(), term[key].type()) << key;
        }
        EXPECT_FALSE(term["backward"].contains("signal"));
        EXPECT_GE(term["backward"].size(), 2u);
    }
    const json single = fragment_of(fit_curve(both_ways(4, 0.2), {}))["terms"][0];
    EXPECT_FALSE(single.contains("backward"));
    EXPECT_FALSE(single.contains("reversal_mm"));
}

TEST(FitBranches, ATolerancesHoldsInEach) {
    fit_options options = with_branches();
    options.tolerance_um = 0.1;
    const fit_result fit = fit_curve(both_ways(4, 0.5), options);
    EXPECT_TRUE(fit.converged);
    EXPECT_LE(std::abs(fit.summary.worst), 0.1);
    EXPECT_LE(std::abs(fit.backward[0].summary.worst), 0.1);
}

TEST(FitBranches, APositionReachedOneWayOnlyIsTaken) {
    measurement data = both_ways(6, 0.3);
    data.runs[1].position.pop_back();
    data.runs[1].error.pop_back();
    data.runs[3].position.pop_back();
    data.runs[3].error.pop_back();
    data.runs[5].position.pop_back();
    data.runs[5].error.pop_back();
    average_runs(data);
    const fit_result fit = fit_curve(data, with_branches());
    EXPECT_EQ(fit.data.position.size(), 41u);
    EXPECT_EQ(fit.backward[0].data.position.size(), 40u);
    EXPECT_LT(rms_error(fit.curve, [](double x) { return wave(x) + 0.5 * lost(x); }), 0.4);
}

TEST(FitBranches, NeedBothDirections) {
    measurement data = both_ways(4, 0.2);
    for (auto &run : data.runs) run.direction = 1;
    average_runs(data);
    try {
        fit_curve(data, with_branches());
        FAIL();
    } catch (const input_error &error) {
        EXPECT_STREQ(error.what(),
                     "test.csv: has no positions reached forward and backward; --branches needs a "
                     "column direction with both");
    }
}

TEST(FitZero, IsAtTheReferenceForEveryMethod) {
    for (const fit_method method : {fit_method::bspline, fit_method::bspline_lmc,
                                    fit_method::polynomial, fit_method::polyline}) {
        for (const double at : {0.0, 1234.5, 4000.0}) {
            fit_options options;
            options.method = method;
            const fit_result free = fit_curve(both_ways(4, 0.2), options);
            options.zero_at_mm = at;
            const fit_result fit = fit_curve(both_ways(4, 0.2), options);
            EXPECT_NEAR(fit.curve.value(at), 0.0, 4e-6) << name_of(method) << " " << at;
            EXPECT_NEAR(fit.zero_offset, free.curve.value(at), 1e-4);
            EXPECT_NEAR(fit.summary.worst, free.summary.worst, 1e-4);
            EXPECT_EQ(fragment_of(fit)["provenance"]["EXX"]["zero_at_mm"], at);
        }
    }
}

TEST(FitZero, MovesBothBranchesAlike) {
    fit_options options = with_branches();
    options.zero_at_mm = 2000.0;
    const fit_result fit = fit_curve(both_ways(6, 0.1), options);
    EXPECT_NEAR(fit.curve.value(2000.0), 0.0, 4e-6);
    EXPECT_NEAR(fit.backward[0].curve.value(2000.0), -lost(2000.0), 0.2);
}

TEST(FitZero, OutsideTheTravelIsRefused) {
    fit_options options;
    options.zero_at_mm = 4001.0;
    EXPECT_THROW(fit_curve(both_ways(4, 0.2), options), input_error);
}

// How often the truth is inside +-k sigma of the written curve, over 20 measurements.
double coverage(double k, int runs, double noise) {
    int inside = 0, all = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
        const fit_result fit = fit_curve(both_ways(runs, noise, seed), {});
        for (std::size_t i = 0; i < fit.best.x.size(); i += 3) {
            const double off = fit.curve.value(fit.best.x[i]) - wave(fit.best.x[i]);
            inside += std::abs(off) <= k * band_sigma(fit, i);
            ++all;
        }
    }
    return static_cast<double>(inside) / all;
}

TEST(FitBand, HoldsTheTruthAsOftenAsItSays) {
    EXPECT_NEAR(coverage(1.0, 6, 0.5), 0.68, 0.12);
    EXPECT_NEAR(coverage(2.0, 6, 0.5), 0.954, 0.045);
    EXPECT_NEAR(coverage(2.0, 6, 3.0), 0.954, 0.045);
    EXPECT_NEAR(coverage(2.0, 2, 0.3), 0.954, 0.1);  // the noise is assumed, not measured
}

TEST(FitBand, IsATable) {
    const fit_result fit = fit_curve(both_ways(4, 0.3), {});
    std::istringstream text(band_of(fit));
    std::string line;
    std::getline(text, line);
    EXPECT_EQ(line, "position_mm,curve_um,sigma_um");
    std::size_t rows = 0;
    while (std::getline(text, line)) ++rows;
    EXPECT_EQ(rows, fit.best.x.size());
    const std::string both = band_of(fit_curve(both_ways(4, 0.3), with_branches()));
    EXPECT_EQ(both.substr(0, both.find('\n')),
              "position_mm,curve_um,sigma_um,backward_um,backward_sigma_um");
}

}  // namespace
}  // namespace compbox::fitting
