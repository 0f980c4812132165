// SPDX-License-Identifier: MIT
// The folded network against the definition in bpnet.h, evaluated unfolded in double; and the
// guard of its training range.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

extern "C" {
#include "models/bpnet.h"
#include "models/num.h"
#include "models/training_range.h"
#include "tests/support/training_range_hold.h"
}

namespace {

using vec = std::vector<float>;

// A network as trained, with inputs like a machine's: positions to 14 m, temperatures, speeds.
struct network {
    std::uint8_t inputs, hidden, outputs, activation;
    bool has_linear;
    vec w1, b1, w2, b2, linear, in_offset, in_scale, out_offset, out_scale;

    cb_bpnet_source source() const {
        return {w1.data(),
                b1.data(),
                w2.data(),
                b2.data(),
                has_linear ? linear.data() : nullptr,
                in_offset.data(),
                in_scale.data(),
                out_offset.data(),
                out_scale.data(),
                inputs,
                hidden,
                outputs,
                activation};
    }
};

network random_network(std::mt19937 &random, std::uint8_t inputs, std::uint8_t hidden,
                       std::uint8_t outputs, std::uint8_t activation, bool has_linear) {
    std::uniform_real_distribution<float> unit(-1, 1);
    const auto fill = [&](std::size_t count, float size) {
        vec v(count);
        for (float &x : v) x = size * unit(random);
        return v;
    };
    network n{inputs, hidden, outputs, activation, has_linear, {}, {}, {}, {}, {}, {}, {}, {}, {}};
    n.w1 = fill(hidden * inputs, 1.5f);
    n.b1 = fill(hidden, 2);
    n.w2 = fill(outputs * hidden, 1);
    n.b2 = fill(outputs, 1);
    n.linear = fill(outputs * inputs, 1);
    for (unsigned j = 0; j < inputs; ++j) {
        const float centre[] = {7150, 1500, 24, 40, 12000}, half[] = {7150, 1500, 9, 22, 12000};
        n.in_offset.push_back(centre[j % 5]);
        n.in_scale.push_back(1 / half[j % 5]);
    }
    for (unsigned k = 0; k < outputs; ++k) {
        n.out_offset.push_back(20 * unit(random));
        n.out_scale.push_back(80 + 40 * unit(random));
    }
    return n;
}

struct exact_result {
    std::vector<double> y, bound, slope;
};

// The formula of bpnet.h in double, the error bound of bpnet.c, and the derivative by `input`.
exact_result exact(const network &n, const vec &x, unsigned input) {
    constexpr double u = 0x1p-24;
    std::vector<double> normal(n.inputs), h(n.hidden), h_error(n.hidden), h_slope(n.hidden);
    for (unsigned j = 0; j < n.inputs; ++j)
        normal[j] = (double(x[j]) - n.in_offset[j]) * double(n.in_scale[j]);
    for (unsigned i = 0; i < n.hidden; ++i) {
        double s = n.b1[i], size = std::fabs(n.b1[i]);
        for (unsigned j = 0; j < n.inputs; ++j) {
            const double w = n.w1[i * n.inputs + j];
            s += w * normal[j];
            size += std::fabs(w * n.in_scale[j]) * (std::fabs(x[j]) + std::fabs(n.in_offset[j]));
        }
        const double d = n.w1[i * n.inputs + input] * double(n.in_scale[input]);
        const double t = n.activation == CB_BPNET_TANSIG ? std::tanh(s) : std::tanh(s / 2);
        h[i] = n.activation == CB_BPNET_TANSIG ? t : 0.5 + 0.5 * t;
        h_slope[i] = d * (1 - t * t) * (n.activation == CB_BPNET_TANSIG ? 1 : 0.25);
        h_error[i] = (n.inputs + 3) * u * size + 2.3 * u;
    }
    exact_result result;
    for (unsigned k = 0; k < n.outputs; ++k) {
        double m = n.b2[k], size = std::fabs(m), carried = 0, slope = 0;
        for (unsigned i = 0; i < n.hidden; ++i) {
            const double w = n.w2[k * n.hidden + i];
            m += w * h[i];
            size += std::fabs(w);
            carried += std::fabs(w) * h_error[i];
            slope += w * h_slope[i];
        }
        for (unsigned j = 0; n.has_linear && j < n.inputs; ++j) {
            const double a = n.linear[k * n.inputs + j];
            m += a * normal[j];
            size += std::fabs(a * n.in_scale[j]) * (std::fabs(x[j]) + std::fabs(n.in_offset[j]));
        }
        if (n.has_linear) slope += n.linear[k * n.inputs + input] * double(n.in_scale[input]);
        const double scale = n.out_scale[k];
        result.y.push_back(n.out_offset[k] + scale * m);
        result.slope.push_back(scale * slope);
        size = size * std::fabs(scale) + std::fabs(n.out_offset[k]);
        result.bound.push_back((n.hidden / 4.0 + n.inputs / 4.0 + 8) * u * size +
                               std::fabs(scale) * carried);
    }
    return result;
}

vec random_input(std::mt19937 &random, const network &n) {
    std::uniform_real_distribution<float> unit(-1.2f, 1.2f);
    vec x;
    for (unsigned j = 0; j < n.inputs; ++j)
        x.push_back(n.in_offset[j] + unit(random) / n.in_scale[j]);
    return x;
}

struct shape {
    std::uint8_t inputs, hidden, outputs;
};

const shape shapes[] = {{19, 20, 3}, {1, 1, 1},   {64, 64, 8}, {3, 4, 1},  {5, 7, 2},
                        {2, 9, 8},   {43, 12, 5}, {7, 63, 1},  {64, 1, 4}, {1, 64, 3}};

TEST(bpnet, equals_its_definition_for_every_shape) {
    std::mt19937 random(7);
    for (const shape s : shapes) {
        for (int kind = 0; kind < 4; ++kind) {
            const network n =
                random_network(random, s.inputs, s.hidden, s.outputs,
                               kind & 1 ? CB_BPNET_LOGSIG : CB_BPNET_TANSIG, kind & 2);
            vec weights(cb_bpnet_floats(s.inputs, s.hidden, s.outputs, n.has_linear));
            const cb_bpnet_source source = n.source();
            cb_bpnet net;
            ASSERT_TRUE(cb_bpnet_fold(&source, weights.data(), &net));
            for (int trial = 0; trial < 50; ++trial) {
                const vec x = random_input(random, n);
                const unsigned input = unsigned(random() % s.inputs);
                const exact_result want = exact(n, x, input);
                float y[CB_BPNET_MAX_OUTPUTS], slope[CB_BPNET_MAX_OUTPUTS];
                cb_bpnet_evaluate(&net, x.data(), y);
                cb_bpnet_slope(&net, x.data(), std::uint8_t(input), slope);
                for (unsigned k = 0; k < s.outputs; ++k) {
                    ASSERT_NEAR(y[k], want.y[k], want.bound[k])
                        << int(s.inputs) << " kind " << kind;
                    const double slope_bound = 8 * want.bound[k] * n.in_scale[input];
                    ASSERT_NEAR(slope[k], want.slope[k], slope_bound);
                }
            }
        }
    }
}

// The analytic slope is that of the very function that is evaluated: by central differences.
TEST(bpnet, slope_by_differences) {
    std::mt19937 random(8);
    const network n = random_network(random, 19, 20, 3, CB_BPNET_TANSIG, true);
    vec weights(cb_bpnet_floats(19, 20, 3, true));
    const cb_bpnet_source source = n.source();
    cb_bpnet net;
    ASSERT_TRUE(cb_bpnet_fold(&source, weights.data(), &net));
    for (std::uint8_t input = 0; input < 19; ++input) {
        vec x = random_input(random, n), up = x, down = x;
        up[input] += 0.01f / n.in_scale[input];
        down[input] -= 0.01f / n.in_scale[input];
        float high[8], low[8], slope[8];
        cb_bpnet_evaluate(&net, up.data(), high);
        cb_bpnet_evaluate(&net, down.data(), low);
        cb_bpnet_slope(&net, x.data(), input, slope);
        for (unsigned k = 0; k < 3; ++k)
            EXPECT_NEAR((high[k] - low[k]) / (up[input] - down[input]), slope[k],
                        0.02 * n.in_scale[input] * n.out_scale[k]);
    }
}

// Offsets a hundred half ranges away (a thermometer in K): folding itself loses nothing.
TEST(bpnet, folding_far_from_zero) {
    std::mt19937 random(9);
    network n = random_network(random, 6, 8, 2, CB_BPNET_LOGSIG, true);
    for (unsigned j = 0; j < 6; ++j) n.in_offset[j] = 295.15f, n.in_scale[j] = 1 / 3.0f;
    vec weights(cb_bpnet_floats(6, 8, 2, true));
    const cb_bpnet_source source = n.source();
    cb_bpnet net;
    ASSERT_TRUE(cb_bpnet_fold(&source, weights.data(), &net));
    for (int trial = 0; trial < 200; ++trial) {
        const vec x = random_input(random, n);
        const exact_result want = exact(n, x, 0);
        float y[8];
        cb_bpnet_evaluate(&net, x.data(), y);
        for (unsigned k = 0; k < 2; ++k) {
            EXPECT_NEAR(y[k], want.y[k], want.bound[k]);
            EXPECT_NEAR(y[k], want.y[k], 0.02);  // µm, of 300: what such units cost at most
        }
    }
}

// Each folded bias is that of the folded weights, correctly rounded but for a hair: a large offset
// takes away nothing that a float could hold. The layout is that of bpnet.h.
TEST(bpnet, folded_biases_are_rounded_once) {
    std::mt19937 random(12);
    for (std::uint8_t activation : {CB_BPNET_TANSIG, CB_BPNET_LOGSIG}) {
        const network n = random_network(random, 64, 8, 2, activation, true);
        vec weights(cb_bpnet_floats(64, 8, 2, true));
        const cb_bpnet_source source = n.source();
        cb_bpnet net;
        ASSERT_TRUE(cb_bpnet_fold(&source, weights.data(), &net));
        const bool logsig = activation == CB_BPNET_LOGSIG;
        const auto expect_rounded = [](float got, long double exact) {
            EXPECT_NEAR(got, (double)exact, 0.501 * std::ldexp(1.0, std::ilogb(got) - 23));
        };
        for (unsigned i = 0; i < 8; ++i) {
            long double bias = n.b1[i] * (logsig ? 0.5L : 1.0L);
            for (unsigned j = 0; j < 64; ++j)
                bias -= (long double)weights[(j + 1) * 8 + i] * n.in_offset[j];
            expect_rounded(weights[i], bias);
        }
        for (unsigned k = 0; k < 2; ++k) {
            const float *const row = weights.data() + 65 * 8 + k * (1 + 8 + 64);
            long double bias = n.out_offset[k] + (long double)n.out_scale[k] * n.b2[k];
            for (unsigned i = 0; logsig && i < 8; ++i) bias += row[1 + i];
            for (unsigned j = 0; j < 64; ++j) bias -= (long double)row[9 + j] * n.in_offset[j];
            expect_rounded(row[0], bias);
        }
    }
}

// Inputs at their offsets, zero weights of the first layer: the result is known in closed form, so
// bias, offset and the halves of the logistic function are where they belong.
TEST(bpnet, constants_come_out_exactly) {
    for (std::uint8_t activation : {CB_BPNET_TANSIG, CB_BPNET_LOGSIG}) {
        const network n{2,      2,   1,      activation, false,  {0, 0, 0, 0}, {0, 0},
                        {3, 5}, {1}, {0, 0}, {0, 0},     {1, 1}, {10},         {4}};
        vec weights(cb_bpnet_floats(2, 2, 1, false));
        const cb_bpnet_source source = n.source();
        cb_bpnet net;
        ASSERT_TRUE(cb_bpnet_fold(&source, weights.data(), &net));
        const float x[] = {123, -45};
        float y;
        cb_bpnet_evaluate(&net, x, &y);
        EXPECT_EQ(y, activation == CB_BPNET_TANSIG ? 14.0f : 30.0f);
    }
}

TEST(bpnet, sizes) {
    EXPECT_EQ(cb_bpnet_floats(19, 20, 3, false), 20u * 20 + 3 * 21);
    EXPECT_EQ(cb_bpnet_floats(19, 20, 3, true), 20u * 20 + 3 * 40);
    EXPECT_EQ(cb_bpnet_floats(1, 1, 1, false), 4u * 2 + 5);
    EXPECT_EQ(cb_bpnet_floats(64, 64, 8, true), 64u * 65 + 8 * 129);
}

TEST(bpnet, writes_exactly_what_it_says) {
    std::mt19937 random(10);
    for (const shape s : shapes) {
        const network n =
            random_network(random, s.inputs, s.hidden, s.outputs, CB_BPNET_TANSIG, true);
        const std::uint32_t count = cb_bpnet_floats(s.inputs, s.hidden, s.outputs, true);
        vec weights(count + 1, 777);
        const cb_bpnet_source source = n.source();
        cb_bpnet net;
        ASSERT_TRUE(cb_bpnet_fold(&source, weights.data(), &net));
        EXPECT_EQ(weights[count], 777.0f);
        float y[CB_BPNET_MAX_OUTPUTS + 1];
        y[s.outputs] = 777;
        cb_bpnet_evaluate(&net, random_input(random, n).data(), y);
        EXPECT_EQ(y[s.outputs], 777.0f);
    }
}

TEST(bpnet, refuses_what_does_not_fold) {
    std::mt19937 random(11);
    network n = random_network(random, 3, 4, 2, CB_BPNET_TANSIG, true);
    n.in_scale[1] = 3e38f;
    n.w1[1] = 100;
    vec weights(cb_bpnet_floats(3, 4, 2, true));
    const cb_bpnet_source source = n.source();
    cb_bpnet net{};
    EXPECT_FALSE(cb_bpnet_fold(&source, weights.data(), &net));
    EXPECT_EQ(net.weights, nullptr);  // unchanged
}

// A sum that overflows must not come out as a number.
TEST(bpnet, overflow_is_the_canonical_nan) {
    const network n{2,      1,      2,      CB_BPNET_TANSIG, true,
                    {1, 1}, {0},    {1, 1}, {0, 0},          {1e33f, -1e33f, 1, 1},
                    {0, 0}, {1, 1}, {0, 0}, {1, 1}};
    vec weights(cb_bpnet_floats(2, 1, 2, true));
    const cb_bpnet_source source = n.source();
    cb_bpnet net;
    ASSERT_TRUE(cb_bpnet_fold(&source, weights.data(), &net));
    const float x[] = {1e6f, 1e6f};
    float y[2], slope[2];
    cb_bpnet_evaluate(&net, x, y);
    EXPECT_EQ(cb_bits_of(y[0]), 0x7FC00000u);
    EXPECT_EQ(y[1], 2000001.0f);
    cb_bpnet_slope(&net, x, 0, slope);
    EXPECT_EQ(slope[1], 1.0f);
}

// ---- training range ----

const cb_training_range temperature{15, 35, 5, 1 / 10.0f};  // fades from 40 to 50, from 10 to 0

cb_training_verdict one(float x, float *inside) {
    return hold_in_training_ranges(&temperature, 1, &x, inside);
}

TEST(training_range, by_hand) {
    struct {
        float x, inside, weight;
        int extrapolated, beyond;
    } const rows[] = {
        {20, 20, 1, 0, 0},       {15, 15, 1, 0, 0},        {35, 35, 1, 0, 0},
        {38, 38, 1, 1, 0},       {40, 40, 1, 1, 0},        {45, 40, 0.5f, 1, 1},
        {50, 40, 0, 1, 1},       {500, 40, 0, 1, 1},       {12, 12, 1, 1, 0},
        {7.5f, 10, 0.75f, 1, 1}, {0, 10, 0, 1, 1},         {-3e38f, 10, 0, 1, 1},
        {INFINITY, 40, 0, 1, 1}, {-INFINITY, 10, 0, 1, 1}, {NAN, 10, 0, 1, 1},
    };
    for (const auto &row : rows) {
        float inside;
        const cb_training_verdict verdict = one(row.x, &inside);
        EXPECT_EQ(inside, row.inside) << row.x;
        EXPECT_EQ(verdict.weight, row.weight) << row.x;
        EXPECT_EQ(verdict.extrapolated, row.extrapolated) << row.x;
        EXPECT_EQ(verdict.beyond, row.beyond) << row.x;
    }
}

TEST(training_range, the_weakest_input_decides) {
    const cb_training_range ranges[] = {temperature, temperature, {0, 14300, 0, 1 / 100.0f}};
    float x[] = {42, 47.5f, 14310}, inside[3];
    cb_training_verdict verdict = hold_in_training_ranges(ranges, 3, x, inside);
    EXPECT_EQ(verdict.weight, 0.25f);
    EXPECT_EQ(verdict.weakest, 1);
    EXPECT_EQ(verdict.weight_slope, -0.1f);
    EXPECT_EQ(verdict.extrapolated, 3);
    EXPECT_EQ(verdict.beyond, 3);
    x[1] = 5;
    verdict = hold_in_training_ranges(ranges, 3, x, x);  // in place
    EXPECT_EQ(verdict.weight, 0.5f);
    EXPECT_EQ(verdict.weight_slope, 0.1f);
    EXPECT_EQ(x[1], 10.0f);
}

// Never a jump: everything it gives is Lipschitz in every input, over the whole float range.
TEST(training_range, never_jumps) {
    float inside, inside_before = 0, weight_before = 0, x_before = -20;
    one(x_before, &inside_before);
    weight_before = one(x_before, &inside).weight;
    for (float x = -20; x < 80; x += 0.013f) {
        const cb_training_verdict verdict = one(x, &inside);
        const float step = x - x_before;
        ASSERT_LE(std::fabs(verdict.weight - weight_before), step / 10 + 1e-6f) << x;
        ASSERT_LE(std::fabs(inside - inside_before), step + 1e-6f) << x;
        ASSERT_TRUE(verdict.weight >= 0 && verdict.weight <= 1);
        x_before = x, weight_before = verdict.weight, inside_before = inside;
    }
}

// No margin, no width: still no NaN and no number outside.
TEST(training_range, degenerate_ranges) {
    const cb_training_range point{20, 20, 0, 1e30f};
    for (float x : {20.0f, 20.000002f, 19.999998f, 1e30f, -1e30f, INFINITY}) {
        float inside;
        const cb_training_verdict verdict = hold_in_training_ranges(&point, 1, &x, &inside);
        EXPECT_EQ(inside, 20.0f);
        EXPECT_EQ(verdict.weight, x == 20.0f ? 1.0f : 0.0f) << x;
    }
}

}  // namespace
