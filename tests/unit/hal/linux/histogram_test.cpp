// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

extern "C" {
#include "hal/linux/files/histogram.h"
}

namespace {

// The definition, on all values: the smallest one that `share` of all do not exceed.
int64_t exact_percentile(std::vector<int64_t> values, double share) {
    std::sort(values.begin(), values.end());
    const double rank = std::ceil(share * static_cast<double>(values.size()));
    return values[static_cast<size_t>(std::max(rank, 1.0)) - 1];
}

TEST(histogram, is_zero_when_empty) {
    auto h = std::make_unique<cb_histogram>();
    EXPECT_EQ(cb_histogram_percentile(h.get(), 0.5), 0);
    EXPECT_EQ(cb_histogram_mean(h.get()), 0.0);
}

TEST(histogram, is_exact_for_one_value_whatever_its_size) {
    for (int64_t value : {int64_t{0}, int64_t{1}, int64_t{31}, int64_t{32}, int64_t{33},
                          int64_t{54321}, int64_t{30000000}, int64_t{1} << 41, int64_t{1} << 60}) {
        auto h = std::make_unique<cb_histogram>();
        cb_histogram_add(h.get(), value);
        EXPECT_EQ(cb_histogram_percentile(h.get(), 0.5), value);
        EXPECT_EQ(h->min_ns, value);
        EXPECT_EQ(h->max_ns, value);
    }
}

TEST(histogram, takes_negative_times_as_zero) {
    auto h = std::make_unique<cb_histogram>();
    cb_histogram_add(h.get(), -5);
    EXPECT_EQ(h->max_ns, 0);
    EXPECT_EQ(h->count, 1u);
}

TEST(histogram, percentiles_are_within_a_64th_of_the_definition) {
    std::mt19937 random(7);
    for (double decades : {1.0, 3.0, 6.0, 10.0}) {
        auto h = std::make_unique<cb_histogram>();
        std::vector<int64_t> values;
        double sum = 0;
        std::uniform_real_distribution<double> exponent(0, decades);
        for (int i = 0; i < 20001; i++) {
            values.push_back(static_cast<int64_t>(std::pow(10.0, exponent(random))));
            cb_histogram_add(h.get(), values.back());
            sum += static_cast<double>(values.back());
        }
        for (double share : {0.0, 0.01, 0.5, 0.9, 0.99, 0.999, 1.0}) {
            const double exact = static_cast<double>(exact_percentile(values, share));
            const double got = static_cast<double>(cb_histogram_percentile(h.get(), share));
            EXPECT_NEAR(got, exact, exact / 64 + 0.5) << decades << " " << share;
        }
        EXPECT_NEAR(cb_histogram_mean(h.get()), sum / 20001, sum * 1e-12);
    }
}

}  // namespace
