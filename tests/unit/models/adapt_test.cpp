// SPDX-License-Identifier: MIT
// Bounded adaptation: against a Kalman filter in double, its gate by hand, and its bounds under
// hostile probes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

extern "C" {
#include "models/adapt.h"
#include "models/num.h"
}
#include "tests/support/cases.h"

namespace {

cb_adapt_settings usual() {
    return {30, 0.5f, 5, 6, 0.5f, 1.5f, 60};
}

// No bound is reached.
cb_adapt_settings wide() {
    return {1e6f, 10, 1e6f, 6, 0.5f, 1.5f, 0};
}

struct filter {
    cb_adapt_settings settings;
    cb_adapt state;

    explicit filter(const cb_adapt_settings &with = usual()) : settings(with) {
        cb_adapt_start(&state);
    }
    cb_adapt_outcome probe(float probed_um, float model_um, float hours = 1,
                           const cb_sigma *own = nullptr) {
        cb_adapt_wait(&settings, &state, hours);
        return cb_adapt_probe(&settings, &state, probed_um, model_um, own);
    }
    float y(float m) const { return cb_adapt_value(&settings, state.bias_um, state.gain, m); }
};

// The filter of the textbook: a full covariance matrix, in double.
struct textbook {
    double b = 0, g = 0, bb = 1, bg = 0, gg = 0.25;

    void wait(const cb_adapt_settings &s, double hours) {
        bb += double(s.drift_um_per_sqrt_h) * s.drift_um_per_sqrt_h * hours;
        gg += double(s.gain_drift_per_sqrt_h) * s.gain_drift_per_sqrt_h * hours;
    }
    void take(const cb_adapt_settings &s, double z, double m) {
        const double pb = bb + bg * m, pg = bg + gg * m;
        const double all = pb + pg * m + double(s.sigma_um) * s.sigma_um;
        const double innovation = z - (b + (1 + g) * m);
        b += pb / all * innovation;
        g += pg / all * innovation;
        bb -= pb * pb / all;
        bg -= pb * pg / all;
        gg -= pg * pg / all;
    }
    double sigma(double m) const { return std::sqrt(bb + 2 * bg * m + gg * m * m); }
};

TEST(adapt, starts_as_the_model_itself) {
    filter f;
    for (const float m : {0.0f, -0.0f, 12.345f, -71.9f, 1e6f, 1e-30f}) EXPECT_EQ(f.y(m), m);
    EXPECT_FLOAT_EQ(cb_adapt_sigma(&f.state, 0, nullptr), 1);
    EXPECT_FLOAT_EQ(cb_adapt_sigma(&f.state, 20, nullptr), std::sqrt(101.0f));
}

TEST(adapt, equals_a_kalman_filter_in_double) {
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0, 1);
    filter f(wide());
    textbook t;
    float b = 0, g = 0;
    for (int i = 0; i < compbox_test::cases(20000); ++i) {
        const float hours = i % 3 == 0 ? 0.02f : 1;
        b += 0.6f * noise(random) * std::sqrt(hours);
        g = 0.98f * g + 0.05f * noise(random) * std::sqrt(hours);
        const float m = 40 * std::sin(0.1f * float(i)) + noise(random);
        const float z = b + (1 + g) * m + 0.5f * noise(random);
        ASSERT_EQ(f.probe(z, m, hours), CB_ADAPT_TAKEN) << i;
        t.wait(f.settings, hours);
        t.take(f.settings, z, m);
        ASSERT_NEAR(f.state.bias_um, t.b, 2e-3) << i;
        ASSERT_NEAR(f.state.gain, t.g, 1e-4) << i;
        ASSERT_NEAR(cb_adapt_sigma(&f.state, m, nullptr), t.sigma(m), 1e-3 * t.sigma(m)) << i;
        ASSERT_NEAR(cb_adapt_sigma(&f.state, 50, nullptr), t.sigma(50), 1e-3 * t.sigma(50)) << i;
    }
}

TEST(adapt, takes_a_probe_inside_of_the_gate_at_once) {
    filter f;
    EXPECT_EQ(f.probe(23, 20), CB_ADAPT_TAKEN);
    EXPECT_NEAR(f.y(20), 23, 0.1);
    EXPECT_FLOAT_EQ(f.state.innovation_um, 3);
    // S = sigma² + variance of b after an hour + (20 sigma of g)²
    EXPECT_NEAR(f.state.expected_um, std::sqrt(2.25 + 37 + 400 * 0.5), 1e-4);
}

TEST(adapt, asks_before_it_takes_a_wrong_probe_and_takes_the_next_right_one) {
    filter f;
    f.probe(3, 2);
    const cb_adapt before = f.state;
    EXPECT_EQ(f.probe(102, 2), CB_ADAPT_ASK);
    EXPECT_EQ(f.state.bias_um, before.bias_um);
    EXPECT_EQ(f.state.gain, before.gain);
    EXPECT_EQ(f.state.pending, 1);
    EXPECT_EQ(f.probe(3.5f, 2, 0.01f), CB_ADAPT_TAKEN);  // early, but it was asked for
    EXPECT_EQ(f.state.pending, 0);
    EXPECT_LT(f.y(2), 4);
    EXPECT_EQ(f.probe(3.5f, 2, 0.01f), CB_ADAPT_EARLY);
}

TEST(adapt, takes_two_that_agree_and_follows_by_the_step) {
    filter f;
    f.probe(0, 0);
    const float before = f.y(0);
    EXPECT_EQ(f.probe(32, 0), CB_ADAPT_ASK);
    EXPECT_EQ(f.y(0), before);
    EXPECT_EQ(f.probe(32.5f, 0, 0.02f), CB_ADAPT_CONFIRMED);
    EXPECT_NEAR(f.y(0), before + 5, 1e-4);
    // the rest stays pending, so the next one that agrees is taken at once, unless it is early
    EXPECT_EQ(f.probe(32, 0, 0.01f), CB_ADAPT_EARLY);
    EXPECT_EQ(f.probe(32, 0, 0.01f), CB_ADAPT_CONFIRMED);
    EXPECT_NEAR(f.y(0), before + 10, 1e-4);
    // back inside of the gate
    EXPECT_EQ(f.probe(f.y(0) + 1, 0, 1), CB_ADAPT_TAKEN);
    EXPECT_EQ(f.state.pending, 0);
}

TEST(adapt, takes_the_median_of_three_that_disagree) {
    filter f;
    f.settings.step_max_um = 1000;
    f.settings.bias_max_um = 1000;
    f.probe(0, 0);
    EXPECT_EQ(f.probe(100, 0), CB_ADAPT_ASK);
    EXPECT_EQ(f.probe(-200, 0, 0.02f), CB_ADAPT_ASK);
    EXPECT_EQ(f.state.pending, 2);
    EXPECT_EQ(f.probe(400, 0, 0.02f), CB_ADAPT_MEDIAN);
    EXPECT_NEAR(f.y(0), 100, 8);
    EXPECT_EQ(f.state.pending, 0);
}

// Two wrong ones to the same side agree as well as two right ones: beyond the bounds three decide.
TEST(adapt, asks_for_a_third_where_two_agree_beyond_its_bounds) {
    filter f;
    f.probe(0, 0);
    EXPECT_EQ(f.probe(100, 0), CB_ADAPT_ASK);
    EXPECT_EQ(f.probe(100.5f, 0, 0.02f), CB_ADAPT_ASK);
    EXPECT_EQ(f.state.bias_um, 0);
    filter g = f;
    EXPECT_EQ(f.probe(1, 0, 0.02f), CB_ADAPT_TAKEN);  // inside of the gate: it alone
    EXPECT_EQ(g.probe(101, 0, 0.02f), CB_ADAPT_MEDIAN);
    EXPECT_NEAR(g.y(0), 5, 1e-3);  // one step towards the bound
    filter m;                      // the gain reaches further where the model does: 30 + 0.5 * 100
    EXPECT_EQ(m.probe(100, 100), CB_ADAPT_TAKEN);
    m.settings.gain_drift_per_sqrt_h = 0;
    m.state.gain_d = 1e-6f, m.state.u = 0;
    EXPECT_EQ(m.probe(175, 100), CB_ADAPT_ASK);
    EXPECT_EQ(m.probe(175, 100, 0.02f), CB_ADAPT_CONFIRMED);
}

// An hour later the machine itself may differ, so two probes agree within its drift.
TEST(adapt, agreement_grows_with_the_time_between_two_probes) {
    for (const float hours : {0.02f, 1.0f}) {
        filter f;
        f.probe(0, 0);
        EXPECT_EQ(f.probe(25, 0), CB_ADAPT_ASK);
        EXPECT_EQ(f.probe(33, 0, hours), hours < 1 ? CB_ADAPT_ASK : CB_ADAPT_CONFIRMED);
    }
}

TEST(adapt, takes_no_probe_before_its_time) {
    filter f;
    EXPECT_EQ(f.probe(1, 0, 0), CB_ADAPT_TAKEN);  // the first one may come at once
    const cb_adapt before = f.state;
    EXPECT_EQ(f.probe(2, 0, 59 / 3600.0f), CB_ADAPT_EARLY);
    EXPECT_EQ(f.state.bias_um, before.bias_um);
    EXPECT_EQ(f.probe(2, 0, 1 / 3600.0f), CB_ADAPT_TAKEN);
    // a minute in steps of the box's wait
    for (int i = 0; i < 60; ++i) cb_adapt_wait(&f.settings, &f.state, 1 / 3600.0f);
    EXPECT_EQ(cb_adapt_probe(&f.settings, &f.state, 2, 0, nullptr), CB_ADAPT_TAKEN);
}

// A reload may lengthen the interval while the PLC already touches again.
TEST(adapt, takes_a_repetition_that_it_asked_for_before_the_interval_grew) {
    filter f;
    f.probe(0, 0);
    EXPECT_EQ(f.probe(100, 0), CB_ADAPT_ASK);
    f.settings.min_interval_s = 86400;
    cb_adapt_resume(&f.settings, &f.state);
    EXPECT_EQ(f.probe(0, 0, 0.02f), CB_ADAPT_TAKEN);
    EXPECT_EQ(f.probe(0, 0, 1), CB_ADAPT_EARLY);
}

TEST(adapt, lets_nothing_implausible_in) {
    const float inf = std::numeric_limits<float>::infinity(), nan = std::nanf("");
    filter f;
    f.probe(1, 5);
    for (const float wrong : {inf, -inf, nan, 1.1e6f, -3e38f}) {
        const cb_adapt before = f.state;
        EXPECT_EQ(cb_adapt_probe(&f.settings, &f.state, wrong, 5, nullptr), CB_ADAPT_IMPLAUSIBLE);
        EXPECT_EQ(cb_adapt_probe(&f.settings, &f.state, 5, wrong, nullptr), CB_ADAPT_IMPLAUSIBLE);
        EXPECT_EQ(std::memcmp(&before, &f.state, sizeof before), 0);
    }
    const cb_adapt before = f.state;
    for (const float hours : {0.0f, -1.0f, -inf, nan}) cb_adapt_wait(&f.settings, &f.state, hours);
    EXPECT_EQ(std::memcmp(&before, &f.state, sizeof before), 0);
}

TEST(adapt, sums_up_what_probes_differ_to_one_side) {
    std::mt19937 random(8);
    std::normal_distribution<float> noise(0, 1);
    filter f;
    float largest = 0;
    for (int i = 0; i < 500; ++i) {  // unbiased: as the filter expects
        const float z = f.y(0) + f.state.expected_um * 0.9f * noise(random);
        f.probe(z, 0);
        largest = std::max(largest, cb_adapt_cusum(&f.state));
    }
    EXPECT_LT(largest, CB_ADAPT_DRIFTED);
    f.settings.bias_max_um = 0;  // held back
    f.settings.gain_max = 0;
    cb_adapt_resume(&f.settings, &f.state);
    for (const float side : {-1.0f, 1.0f}) {
        int probes = 0;
        for (; cb_adapt_cusum(&f.state) <= CB_ADAPT_DRIFTED || (side > 0) == (f.state.above <= 0);
             ++probes) {
            ASSERT_LT(probes, 200);
            f.probe(side * 1.2f * f.state.expected_um, 0);
        }
        EXPECT_GT(probes, 5);
        EXPECT_GT(side < 0 ? f.state.below : f.state.above, CB_ADAPT_DRIFTED);
    }
}

TEST(adapt, sums_up_the_median_where_it_takes_it) {
    filter f;
    f.probe(0, 0);
    EXPECT_EQ(f.probe(100, 0), CB_ADAPT_ASK);
    EXPECT_EQ(f.probe(200, 0, 0.02f), CB_ADAPT_ASK);
    EXPECT_EQ(f.probe(-300, 0, 0.02f), CB_ADAPT_MEDIAN);
    EXPECT_EQ(f.state.above, 2.5f);
    EXPECT_EQ(f.state.below, 0);
}

TEST(adapt, a_limited_probe_leaves_the_uncertainty_that_it_did_not_remove) {
    filter limited, free(wide());
    limited.probe(15, 0);  // inside of the gate, further than one step
    free.probe(15, 0);
    EXPECT_NEAR(limited.y(0), 5, 1e-4);
    EXPECT_GT(cb_adapt_sigma(&limited.state, 0, nullptr), 3);
    EXPECT_LT(cb_adapt_sigma(&free.state, 0, nullptr), 1.5);
}

cb_sigma at(float place, std::uint32_t model = 1) {
    return {8, 4, {place, 0, 0, 0}, model};
}

TEST(adapt, takes_the_first_probe_of_a_model_that_may_be_far_off) {
    const cb_sigma own = at(1);  // sqrt(8² + 4²) µm
    filter without, with;
    EXPECT_EQ(without.probe(20, 0, 0.1f), CB_ADAPT_ASK);
    EXPECT_NEAR(cb_adapt_sigma(&with.state, 0, &own), std::sqrt(80.0f), 1e-4);
    EXPECT_EQ(with.probe(20, 0, 0.1f, &own), CB_ADAPT_TAKEN);
    EXPECT_NEAR(with.state.expected_um, std::sqrt(80 + 2.25f), 1e-4);
    // and no more than that: five sigmas are doubted
    filter far;
    const cb_adapt before = far.state;
    EXPECT_EQ(far.probe(50, 0, 0, &own), CB_ADAPT_ASK);
    EXPECT_EQ(far.state.bias_d, before.bias_d);
    EXPECT_EQ(far.state.model, 0u);
}

TEST(adapt, believes_a_probe_more_the_further_the_state_is_from_the_last_one) {
    filter f(wide());
    const cb_sigma here = at(1), there = at(-1.5f);
    f.probe(0, 0, 0, &here);
    const float known = cb_adapt_sigma(&f.state, 0, &here);
    EXPECT_EQ(known, cb_adapt_sigma(&f.state, 0, nullptr));
    EXPECT_NEAR(cb_adapt_sigma(&f.state, 0, &there), std::sqrt(known * known + 100), 1e-3);
    filter moved = f;
    f.probe(6, 0, 0.1f, &here);
    moved.probe(6, 0, 0.1f, &there);
    EXPECT_GT(moved.state.expected_um, 2 * f.state.expected_um);
    EXPECT_GT(moved.y(0), f.y(0) + 1);
    EXPECT_GT(moved.y(0), 5.7f);
    // the place was measured: an hour later nothing of it is left
    EXPECT_NEAR(cb_adapt_sigma(&moved.state, 0, &there), 1.5f, 0.2f);
}

TEST(adapt, knows_nothing_of_another_model) {
    filter f(wide());
    const cb_sigma one = at(1), other = at(1, 2), silent = at(1, 0);
    f.probe(0, 0, 0, &one);
    EXPECT_NEAR(cb_adapt_sigma(&f.state, 0, &other), std::sqrt(80.0f), 1e-3);
    EXPECT_LT(cb_adapt_sigma(&f.state, 0, &silent), 1.6f);
    f.probe(0, 0, 0, &silent);
    EXPECT_EQ(f.state.model, 1u);
    f.probe(0, 0, 0, &other);
    EXPECT_EQ(f.state.model, 2u);
    EXPECT_LT(cb_adapt_sigma(&f.state, 0, &other), 1.6f);
}

TEST(adapt, a_probe_that_is_not_taken_leaves_the_uncertainty_as_it_was) {
    filter f;
    const cb_sigma here = at(0), there = at(2);
    f.probe(0, 0, 1, &here);
    for (const float wrong : {300.0f, -300.0f, std::nanf("")}) {
        const cb_adapt before = f.state;
        cb_adapt_probe(&f.settings, &f.state, wrong, 0, &there);
        EXPECT_EQ(f.state.bias_d, before.bias_d);
        EXPECT_EQ(f.state.place[0], 0);
    }
}

TEST(adapt, resumes_a_stored_state_under_new_bounds_and_starts_anew_from_a_broken_one) {
    filter f(wide());
    f.probe(15, 0);
    const cb_adapt good = f.state;
    ASSERT_GT(good.bias_um, 10);
    cb_adapt_resume(&f.settings, &f.state);
    EXPECT_EQ(std::memcmp(&good, &f.state, sizeof good), 0);
    f.settings.bias_max_um = 2;
    cb_adapt_resume(&f.settings, &f.state);
    EXPECT_EQ(f.state.bias_um, 2);
    EXPECT_EQ(f.state.bias_d, good.bias_d);
    const std::vector<float cb_adapt::*> fields = {
        &cb_adapt::bias_um,     &cb_adapt::gain,    &cb_adapt::bias_d,    &cb_adapt::gain_d,
        &cb_adapt::u,           &cb_adapt::since_h, &cb_adapt::pending_h, &cb_adapt::innovation_um,
        &cb_adapt::expected_um, &cb_adapt::above,   &cb_adapt::below};
    cb_adapt fresh;
    cb_adapt_start(&fresh);
    for (const auto field : fields) {
        cb_adapt broken = good;
        broken.*field = std::nanf("");
        cb_adapt_resume(&f.settings, &broken);
        EXPECT_EQ(broken.bias_um, 0);
        EXPECT_EQ(broken.bias_d, fresh.bias_d);
        EXPECT_EQ(broken.since_h, fresh.since_h);
    }
    const auto starts_anew = [&](const auto &spoil) {
        cb_adapt broken = good;
        spoil(broken);
        cb_adapt_resume(&f.settings, &broken);
        return std::memcmp(&broken, &fresh, sizeof fresh) == 0;
    };
    const float inf = std::numeric_limits<float>::infinity();
    EXPECT_TRUE(starts_anew([](cb_adapt &a) { a.place[2] = std::nanf(""); }));
    EXPECT_TRUE(starts_anew([](cb_adapt &a) { a.pending_um[0] = std::nanf(""); }));
    EXPECT_TRUE(starts_anew([](cb_adapt &a) { a.pending_um[1] = std::nanf(""); }));
    EXPECT_TRUE(starts_anew([](cb_adapt &a) { a.pending = 3; }));
    EXPECT_TRUE(starts_anew([](cb_adapt &a) { a.asked = 2; }));
    EXPECT_TRUE(starts_anew([&](cb_adapt &a) { a.above = inf; })) << "an alarm without an end";
    EXPECT_TRUE(starts_anew([&](cb_adapt &a) { a.below = inf; }));
    for (const float wrong : {0.0f, -1.0f, 1e30f}) {
        EXPECT_TRUE(starts_anew([&](cb_adapt &a) { a.bias_d = wrong; })) << wrong;
        EXPECT_TRUE(starts_anew([&](cb_adapt &a) { a.gain_d = wrong; })) << wrong;
    }
}

// (1) in double, for any bits of b, g and m, and bounds of all sizes.
TEST(adapt, no_rounding_passes_the_bound) {
    std::mt19937 random(2);
    std::uniform_int_distribution<std::uint32_t> bits;
    std::uniform_real_distribution<float> power(-8, 6);
    for (int i = 0; i < compbox_test::cases(500000); ++i) {
        const cb_adapt_settings s = {i % 7 == 0 ? 0 : std::pow(10.0f, power(random)),
                                     i % 5 == 0 ? 0 : std::pow(10.0f, 0.5f * power(random) - 2),
                                     5,
                                     6,
                                     0.5f,
                                     1.5f,
                                     60};
        const float m = i % 2 == 0 ? std::pow(10.0f, power(random)) : cb_float_of(bits(random));
        if (!(std::fabs(m) <= 1e30f)) continue;
        const float y = cb_adapt_value(&s, cb_float_of(bits(random)), cb_float_of(bits(random)), m);
        ASSERT_LE(std::fabs(double(y) - m),
                  s.bias_max_um + double(s.gain_max) * std::fabs(double(m)))
            << i;
    }
}

// A number as a hostile or broken control may give it.
float hostile(std::mt19937 &random) {
    static const float odd[] = {0.0f,   -0.0f,   1e6f,     -1e6f, 30,   -30,
                                1e-40f, 3.4e38f, -3.4e38f, 100,   -100, 1e5f};
    switch (random() % 8) {
        case 0:
            return cb_float_of(std::uint32_t(random()));
        case 1:
            return std::nanf("");
        case 2:
        case 3:
            return odd[random() % 12];
        default:
            return std::normal_distribution<float>(0, 60)(random);
    }
}

cb_adapt_settings any_settings(std::mt19937 &random) {
    const auto pick = [&](std::vector<float> of) { return of[random() % of.size()]; };
    return {pick({0, 1e-3f, 30, 1e6f}), pick({0, 0.01f, 0.5f, 10}), pick({1e-3f, 5, 1e6f}),
            pick({0, 6, 1e3f}),         pick({0, 0.5f, 10}),        pick({1e-3f, 1.5f, 1e3f}),
            pick({0, 60, 86400})};
}

// in the ranges of models/sigma.h
cb_sigma any_sigma(std::mt19937 &random) {
    const auto pick = [&](std::vector<float> of) { return of[random() % of.size()]; };
    cb_sigma own = {pick({0, 1, 15, 1e6f}), pick({0, 2, 1e6f}), {}, std::uint32_t(random() % 3)};
    for (float &place : own.place) place = pick({0, 1, -2, 1e9f, -1e9f, 1e-30f});
    return own;
}

// in : a probe of a hostile stream; before, the state before it
void check_bounds(const filter &f, const cb_adapt &before, cb_adapt_outcome outcome, float m) {
    const cb_adapt_settings &s = f.settings;
    ASSERT_LE(std::fabs(f.state.bias_um), s.bias_max_um);
    ASSERT_LE(std::fabs(f.state.gain), s.gain_max);
    ASSERT_GT(f.state.bias_d, 0);
    ASSERT_GT(f.state.gain_d, 0);
    ASSERT_TRUE(std::isfinite(f.state.bias_d + f.state.gain_d + f.state.u +
                              cb_adapt_sigma(&f.state, 72, nullptr)));
    if (!cb_adapt_was_taken(outcome)) {
        ASSERT_EQ(before.bias_um, f.state.bias_um);
        ASSERT_EQ(before.gain, f.state.gain);
        return;
    }
    const double way =
        double(f.state.bias_um) - before.bias_um + (double(f.state.gain) - before.gain) * m;
    const double size = s.bias_max_um + std::fabs(double(m)) * s.gain_max;
    ASSERT_LE(std::fabs(way), s.step_max_um * (1 + 1e-6) + size * 3e-7);
}

TEST(adapt, no_stream_of_probes_breaks_a_bound) {
    const int cycles = compbox_test::long_tests() ? 10000000 : 200000;
    std::mt19937 random(3);
    filter f;
    int taken = 0;
    float z = 0, m = 0;
    for (int i = 0; i < cycles; ++i) {
        if (i % 1000 == 0) f = filter(any_settings(random));
        if (random() % 3 != 0) z = hostile(random);  // else the same again
        if (random() % 4 != 0) m = hostile(random);
        const cb_adapt before = f.state;
        const float hours = random() % 2 ? 30e-3f / 3600 : hostile(random);
        const cb_sigma own = any_sigma(random);
        const cb_adapt_outcome outcome = f.probe(z, m, hours, random() % 4 ? &own : nullptr);
        ASSERT_TRUE(std::isfinite(cb_adapt_sigma(&f.state, 72, &own))) << i;
        taken += cb_adapt_was_taken(outcome);
        ASSERT_NO_FATAL_FAILURE(check_bounds(f, before, outcome, m)) << i;
        if (!(std::fabs(m) <= 1e30f)) continue;
        const double bound =
            f.settings.bias_max_um + double(f.settings.gain_max) * std::fabs(double(m));
        ASSERT_LE(std::fabs(double(f.y(m)) - m), bound) << i;
    }
    EXPECT_GT(taken, cycles / 50);
}

// A year with a probe an hour: thermal days, a drift of weeks, ageing of the gain; every value is
// generated here.
double rms_of_a_year(double wrong_share) {
    std::mt19937 random(4), wrongs(5);
    std::normal_distribution<double> noise(0, 1);
    std::uniform_real_distribution<double> any(0, 1);
    filter f;
    f.settings.step_max_um = 15;
    double b = 0, g = 0.1, sum = 0;
    const int hours = 365 * 24, minutes = 4;  // of an hour: samples in between
    for (int i = 0; i < hours; ++i) {
        for (int k = 0; k < minutes; ++k) {
            const double day = 2 * M_PI * (i + double(k) / minutes) / 24;
            const double m =
                25 * std::sin(day) + 10 * std::sin(3.7 * day + 1) + 12 * std::sin(day / 41);
            b += 1.2 * noise(random) - 0.01 * b;
            g += 0.01 * noise(random) - 0.02 * (g - 0.1);
            const double error = b + (1 + g) * m;
            const double off = error - f.y(float(m));
            sum += off * off;
            if (k != 0) continue;
            double z = error + 1.5 * noise(random);
            const bool is_wrong = any(wrongs) < wrong_share;
            const double way = any(wrongs) < 0.5 ? -100 : 100;
            if (is_wrong) z += way;
            // a repetition, if one is asked for, is another probe of the control
            if (f.probe(float(z), float(m)) == CB_ADAPT_ASK)
                f.probe(float(error + 1.5 * noise(wrongs)), float(m), 0.02f);
        }
    }
    return std::sqrt(sum / hours / minutes);
}

TEST(adapt, wrong_probes_cost_at_most_a_tenth) {
    const double right = rms_of_a_year(0), wrong = rms_of_a_year(0.05);
    RecordProperty("right_um", std::to_string(right));
    RecordProperty("wrong_um", std::to_string(wrong));
    std::cout << "rms " << right << " µm, with wrong probes " << wrong << " µm\n";
    EXPECT_LT(right, 6);
    EXPECT_LE(wrong, 1.1 * right);
}

}  // namespace
