// SPDX-License-Identifier: MIT
// Four side by side give the bits of each by itself; on targets without such registers there is
// nothing to test.
#include <gtest/gtest.h>

#include <cstdint>
#include <random>

extern "C" {
#include "models/four.h"
#include "models/transcendental.h"
}

namespace {

#ifdef CB_FOUR
void expect_same(const float *x) {
    float y[4];
    cb_four_store(y, cb_four_tanh(cb_four_load(x)));
    for (int k = 0; k < 4; ++k)
        EXPECT_EQ(cb_bits_of(cb_canonical(y[k])), cb_bits_of(cb_canonical(cb_tanh(x[k])))) << x[k];
}

TEST(four, tanh_has_the_bits_of_tanh) {
    std::mt19937 random(4);
    for (int i = 0; i < 2000000; ++i) {
        float x[4];
        for (float &one : x) one = cb_float_of(static_cast<std::uint32_t>(random()));
        expect_same(x);
    }
}

TEST(four, tanh_has_the_bits_of_tanh_at_the_seams) {
    const float seams[] = {0.0f, 0.549306154f, 9.25f, 9.011f, FLT_MIN, FLT_MAX};
    for (const float seam : seams) {
        for (std::uint32_t i = 0; i < 2000; ++i) {
            const std::uint32_t bits = cb_bits_of(seam) + i - (seam > 0.0f ? 1000u : 0u);
            const float x = cb_float_of(bits);
            const float four[] = {x, -x, x * 0.5f, x + 1.0f};
            expect_same(four);
        }
    }
}
#endif

}  // namespace
