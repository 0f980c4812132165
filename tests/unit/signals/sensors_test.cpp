// SPDX-License-Identifier: MIT
// Sensors that check each other: which one is doubted, after what time, and when it is trusted
// again.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

extern "C" {
#include "firmware/config/config.h"
#include "firmware/signals/sensors.h"
}

namespace {

constexpr int64_t second_us = 1000000;

// `count` thermometers that follow two heat sources and the room, with noise of 0.1 K.
struct machine {
    explicit machine(unsigned count, unsigned seed = 1) : dice(seed) {
        std::normal_distribution<double> normal;
        mixing = Eigen::MatrixXd(count, 3).unaryExpr([&](double) { return normal(dice); });
        mixing.col(2).setOnes();
        const Eigen::Vector3d variance(25.0, 4.0, 100.0);
        Eigen::MatrixXd covariance = mixing * variance.asDiagonal() * mixing.transpose();
        covariance.diagonal().array() += 0.01;
        const Eigen::MatrixXd precision = covariance.inverse();
        config->signals_count = config->sensors_count = static_cast<uint8_t>(count);
        config->sensors.after_us = 120 * second_us;
        config->sensors.threshold_square = 36.0f;
        for (unsigned j = 0; j < count; ++j) {
            config->sensors.signal[j] = static_cast<uint8_t>(j);
            config->signals[j].min = -100.0f;
            config->signals[j].max = 100.0f;
            config->signals[j].max_age_ms = 2000;
            config->pool[j] = 20.0f;
            for (unsigned k = 0; k < count; ++k)
                config->pool[count + j * count + k] =
                    static_cast<float>(0.5 * (precision(j, k) + precision(k, j)));
        }
        signals.resize(CB_MAX_SIGNALS);
    }

    // One step of the box `after_us` later; fault(j, healthy value) is what sensor j reads.
    template <class Fault>
    void step(int64_t after_us, Fault fault) {
        std::normal_distribution<double> normal;
        const double fraction = static_cast<double>(after_us) / (3600.0 * second_us);
        for (int s = 0; s < 3; ++s)
            source[s] += std::sqrt(fraction) * normal(dice) - 0.2 * fraction * source[s];
        const Eigen::VectorXd healthy = mixing * source;
        now_us += after_us;
        for (unsigned j = 0; j < config->sensors_count; ++j) {
            const double value =
                fault(j, 20.0 + healthy[static_cast<Eigen::Index>(j)] + 0.1 * normal(dice));
            signals[j].known = std::isfinite(value);
            signals[j].value = static_cast<float>(signals[j].known ? value : 0.0);
            signals[j].time_us = now_us;
        }
        cb_sensors_watch(config.get(), signals.data(), &state, &counters, now_us);
    }
    template <class Fault>
    void run(int64_t time_us, int64_t period_us, Fault fault) {
        for (int64_t t = 0; t < time_us; t += period_us) step(period_us, fault);
    }
    std::vector<unsigned> doubted() const {
        std::vector<unsigned> all;
        for (unsigned j = 0; j < config->sensors_count; ++j)
            if (signals[j].doubted) all.push_back(j);
        return all;
    }

    std::mt19937 dice;
    std::unique_ptr<cb_config> config = std::make_unique<cb_config>();
    Eigen::MatrixXd mixing;
    Eigen::Vector3d source = Eigen::Vector3d::Zero();
    std::vector<cb_signal_state> signals;
    cb_sensors_state state{};
    cb_counters counters{};
    int64_t now_us = 1000 * second_us;
};

double healthy(unsigned, double value) {
    return value;
}

TEST(sensors, healthy_ones_are_not_doubted_in_a_month) {
    machine m(24);
    m.run(30 * 86400 * second_us, 20 * second_us, healthy);
    EXPECT_EQ(m.counters.sensors_doubted, 0u);
}

TEST(sensors, an_offset_is_found_at_its_sensor_and_at_no_other) {
    for (unsigned wrong = 0; wrong < 12; ++wrong) {
        machine m(12, wrong + 1);
        m.run(600 * second_us, second_us, healthy);
        const auto fault = [wrong](unsigned j, double v) { return j == wrong ? v - 5.0 : v; };
        m.run(100 * second_us, 30000, fault);
        EXPECT_TRUE(m.doubted().empty()) << wrong;
        m.run(60 * second_us, 30000, fault);
        EXPECT_EQ(m.doubted(), std::vector<unsigned>{wrong});
        EXPECT_EQ(m.counters.sensors_doubted, 1u);
        EXPECT_NEAR(m.signals[wrong].expected, m.signals[wrong].value + 5.0f, 1.5f);
    }
}

TEST(sensors, two_exchanged_ones_are_found) {
    machine m(12);
    m.source << 8.0, 3.0, 5.0;
    m.run(60 * second_us, second_us, healthy);
    double first = 0.0;
    m.run(600 * second_us, second_us, [&](unsigned j, double v) {
        if (j == 3) first = v;
        const auto row = [&](Eigen::Index i) { return 20.0 + m.mixing.row(i).dot(m.source); };
        if (j == 3) return row(7);
        return j == 7 ? row(3) : v;
    });
    EXPECT_GT(std::abs(m.mixing.row(3).dot(m.source) - m.mixing.row(7).dot(m.source)), 5.0);
    EXPECT_EQ(m.doubted(), (std::vector<unsigned>{3, 7}));
}

TEST(sensors, a_mended_one_is_trusted_again_after_twenty_minutes) {
    machine m(12);
    m.run(600 * second_us, second_us, [](unsigned j, double v) { return j == 4 ? v + 9.0 : v; });
    ASSERT_EQ(m.doubted(), std::vector<unsigned>{4});
    m.run(1100 * second_us, second_us, healthy);
    EXPECT_EQ(m.doubted(), std::vector<unsigned>{4});
    m.run(400 * second_us, second_us, healthy);
    EXPECT_TRUE(m.doubted().empty());
    EXPECT_EQ(m.state.doubted, 0u);
}

// Ten times this after_s is longer than 32 bits of microseconds, and noise leaves half of the
// threshold, which is three standard deviations, some sixteen times in it.
TEST(sensors, a_mended_one_is_trusted_again_however_long_after_s_is) {
    for (unsigned seed = 1; seed < 6; ++seed) {
        machine m(12, seed);
        m.config->sensors.after_us = 600 * second_us;
        m.run(1200 * second_us, second_us,
              [](unsigned j, double v) { return j == 4 ? v + 9.0 : v; });
        ASSERT_EQ(m.doubted(), std::vector<unsigned>{4}) << seed;
        m.run(5990 * second_us, second_us, healthy);
        EXPECT_EQ(m.doubted(), std::vector<unsigned>{4}) << seed;
        m.run(600 * second_us, second_us, healthy);
        EXPECT_TRUE(m.doubted().empty()) << seed;
    }
}

TEST(sensors, a_stale_one_accuses_no_other) {
    machine m(12);
    m.run(600 * second_us, second_us, healthy);
    m.run(86400 * second_us, 10 * second_us,
          [](unsigned j, double v) { return j == 2 ? std::nan("") : v; });
    EXPECT_EQ(m.counters.sensors_doubted, 0u);
}

// Its last readings stay in the comparison until its prediction takes their place.
TEST(sensors, a_wrong_one_that_falls_silent_accuses_no_other) {
    for (int64_t wrong_s = 110; wrong_s < 130; ++wrong_s) {
        machine m(12);
        m.run(600 * second_us, second_us, healthy);
        m.run(wrong_s * second_us, second_us,
              [](unsigned j, double v) { return j == 9 ? v + 60.0 : v; });
        m.run(10 * second_us, second_us,
              [](unsigned j, double v) { return j == 9 ? std::nan("") : v; });
        const auto doubted = m.doubted();
        EXPECT_TRUE(doubted.empty() || doubted == std::vector<unsigned>{9}) << wrong_s;
        EXPECT_LE(m.counters.sensors_doubted, 1u) << wrong_s;
    }
}

// Its last reading agreed, and is one of long ago.
// World seed 35002574: a healthy sensor was doubted behind another one.
TEST(sensors, the_last_reading_of_a_doubted_one_accuses_no_other) {
    machine m(12);
    m.run(600 * second_us, second_us, healthy);
    const auto fault = [](unsigned j, double v) { return j == 11 ? v - 30.0 : v; };
    while (m.counters.sensors_doubted == 0) m.step(30000, fault);
    EXPECT_EQ(m.doubted(), std::vector<unsigned>{11});
    EXPECT_NEAR(m.signals[11].expected, m.signals[11].value + 30.0, 2.0) << "of the others";
    for (int pass = 0; pass < 3; ++pass) {
        m.run(1100000, 30000, fault);
        for (unsigned j = 0; j < 11; ++j) EXPECT_EQ(m.state.us[j], 0u) << j;
    }
}

TEST(sensors, a_mended_one_that_is_silent_is_not_trusted_again) {
    machine m(12);
    m.run(600 * second_us, second_us, [](unsigned j, double v) { return j == 4 ? v + 9.0 : v; });
    ASSERT_EQ(m.doubted(), std::vector<unsigned>{4});
    std::vector<double> now(12);
    m.step(second_us, [&](unsigned j, double v) { return now[j] = v; });
    const cb_signal_state last = m.signals[4];
    const auto same = [&](unsigned j, double) { return now[j]; };
    const auto silent = [&](unsigned j, double) {
        if (j == 5) m.signals[4] = last;  // behind the step's own reading of sensor 4
        return now[j];
    };
    m.run(3600 * second_us, 60 * second_us, silent);
    EXPECT_EQ(m.doubted(), std::vector<unsigned>{4});
    m.run(1800 * second_us, 60 * second_us, same);
    EXPECT_TRUE(m.doubted().empty());
}

TEST(sensors, at_most_a_third_is_doubted) {
    machine m(9);
    m.run(3600 * second_us, second_us,
          [](unsigned j, double v) { return j % 2 == 0 ? v + 7.0 * (j + 1.0) : v; });
    EXPECT_LE(m.doubted().size(), 3u);
    EXPECT_EQ(m.doubted().size(), static_cast<size_t>(__builtin_popcount(m.state.doubted)));
}

TEST(sensors, rows_a_minute_apart_find_it_too) {
    machine m(12);
    m.run(3600 * second_us, 60 * second_us, healthy);
    m.run(240 * second_us, 60 * second_us,
          [](unsigned j, double v) { return j == 6 ? v + 6.0 : v; });
    EXPECT_EQ(m.doubted(), std::vector<unsigned>{6});
}

TEST(sensors, a_clock_that_goes_back_begins_a_pass_anew) {
    machine m(6);
    m.run(100 * second_us, second_us, healthy);
    m.now_us -= 90 * second_us;
    m.run(600 * second_us, second_us, [](unsigned j, double v) { return j == 1 ? v + 8.0 : v; });
    EXPECT_EQ(m.doubted(), std::vector<unsigned>{1});
}

TEST(sensors, a_step_compares_one_of_them) {
    machine m(10);
    m.run(3 * second_us, second_us, healthy);
    const uint8_t before = m.state.next;
    unsigned moved = 0;
    for (int i = 0; i < 10 && m.state.next != 10; ++i, ++moved) m.step(30000, healthy);
    EXPECT_GE(moved + before, 9u);
    for (int i = 0; i < 20; ++i) m.step(30000, healthy);
    EXPECT_EQ(m.state.next, 10);  // the next pass begins when the second is over
}

}  // namespace
