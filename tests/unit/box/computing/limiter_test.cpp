// SPDX-License-Identifier: MIT
// The limiter against a model PLC: an enemy that decides which of the unanswered writes took
// effect, with random files, targets, times and outages.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/support/box_fixture.h"

extern "C" {
#include "firmware/config/derive.h"
#include "firmware/config/grid.h"
}

namespace compbox {
namespace {

constexpr double period_s = 0.030;

// One channel as the PLC sees it, in double precision and by its own arithmetic.
struct held_value {
    double um = 0;
    double time_s = 0;  // of the step that made it
};

// A write without an answer. It may still take effect until the PLC's program ran for so long, or
// the PLC served requests for twice as long.
struct late_write {
    std::vector<held_value> values;
    int64_t lives_us, serves_us;
};

struct limiter_rig {
    config_builder builder;
    std::vector<cb_channel_state> states;
    cb_counters counters{};
    std::vector<held_value> plc;
    std::vector<bool> coarse;  // a step allowed less than one unit of the register
    std::vector<late_write> late;
    double now_s = 0;
    uint32_t elapsed_us = 0;  // of the last step
    bool alive = true;        // the PLC's program

    explicit limiter_rig(const config_builder &b) : states(16), plc(16), coarse(16) {
        *builder.config = *b.config;
        cb_config_derive(builder.config.get());
    }
    const cb_config &config() const { return *builder.config; }
    unsigned channels() const { return config().channels_count; }

    // One step; out: what would be written.
    void step(const std::vector<float> &target, double elapsed_s, float ramp = 0,
              bool writing = true) {
        now_s += elapsed_s;
        elapsed_us = static_cast<uint32_t>(std::llround(elapsed_s * 1e6));
        for (unsigned i = 0; i < channels(); ++i) {
            const cb_channel_config &c = config().channels[i];
            if (c.slew_um_per_s * elapsed_s < unit(c)) coarse[i] = true;
        }
        const cb_motion motion = {static_cast<float>(std::min(elapsed_s, 2 * period_s)),
                                  static_cast<float>(2 * period_s), ramp, writing};
        cb_limiter_step(&config(), states.data(), &counters, target.data(), &motion);
    }
    void result(cb_transfer result) {
        cb_limiter_written(&config(), states.data(), result, elapsed_us, alive);
        for (late_write &write : late) {
            write.lives_us -= alive ? elapsed_us : 0;
            write.serves_us -= alive || result == CB_TRANSFER_OK ? elapsed_us : 0;
        }
        late.erase(std::remove_if(late.begin(), late.end(),
                                  [](const late_write &write) {
                                      return write.lives_us <= 0 || write.serves_us <= 0;
                                  }),
                   late.end());
        if (result != CB_TRANSFER_UNKNOWN) return;
        const int64_t late_us = cb_limiter_late_us(&config());
        late.push_back({{}, late_us, 2 * late_us});
        for (unsigned i = 0; i < channels(); ++i) late.back().values.push_back({output(i), now_s});
    }
    static double unit(const cb_channel_config &c) {
        return cb_number_is_integer(static_cast<cb_number_type>(c.type)) ? c.scale : 0;
    }
    double output(unsigned i = 0) const { return states[i].output_um; }

    // The PLC takes the outputs over: here all promises are checked.
    void take() {
        for (unsigned i = 0; i < channels(); ++i) {
            const cb_channel_config &c = config().channels[i];
            const double o = output(i);
            const double elapsed_s = std::min(now_s - plc[i].time_s, 2 * period_s);
            const double most = c.slew_um_per_s * elapsed_s + (coarse[i] ? unit(c) : 0);
            ASSERT_TRUE(std::isfinite(o));
            ASSERT_LE(std::fabs(o - plc[i].um), most * (1 + 1e-5) + 1e-6 * c.limit_um)
                << "channel " << i << " at " << now_s;
            plc[i] = {o, now_s};
        }
        for (unsigned p = 0; p < config().pairs_count; ++p) {
            const cb_pair_config &pair = config().pairs[p];
            ASSERT_LE(std::fabs(plc[pair.a].um - plc[pair.b].um),
                      pair.max_difference_um * (1 + 1e-6) + 1e-6 * std::fabs(plc[pair.a].um));
        }
    }
    // A write that nobody waits for any more takes effect after all, behind a later one.
    void take_late(const late_write &write) {
        for (unsigned i = 0; i < channels(); ++i) {
            const cb_channel_config &c = config().channels[i];
            const double between_s = std::fabs(plc[i].time_s - write.values[i].time_s);
            const double most =
                c.slew_um_per_s * std::min(between_s, 2 * period_s) + (coarse[i] ? unit(c) : 0);
            ASSERT_LE(std::fabs(write.values[i].um - plc[i].um),
                      most * (1 + 1e-5) + 1e-6 * c.limit_um)
                << "channel " << i << " late at " << now_s;
        }
        plc = write.values;
        plc.resize(16);
    }
    // What must hold of every output, taken or not.
    void check_values() const {
        for (unsigned i = 0; i < channels(); ++i) {
            const cb_channel_config &c = config().channels[i];
            ASSERT_LE(std::fabs(output(i)), static_cast<double>(c.limit_um));
            uint16_t registers[2];
            const float units = states[i].output_um / c.scale;
            ASSERT_TRUE(cb_number_encode(static_cast<cb_number_type>(c.type), units, registers));
            const double printed = static_cast<double>(cb_number_decode(
                                       static_cast<cb_number_type>(c.type), registers)) *
                                   static_cast<double>(c.scale);
            ASSERT_LE(std::fabs(printed), c.limit_um * (1 + 1e-7));
            if (c.unit_um > 0) {
                ASSERT_EQ(
                    cb_number_decode(static_cast<cb_number_type>(c.type), registers) * c.scale,
                    states[i].output_um);
            }
        }
    }
};

config_builder one_channel() {
    config_builder b;
    b.channel("Z", {}, 4);
    return b;
}

TEST(limiter, moves_at_the_slew_rate_and_arrives_exactly) {
    limiter_rig rig(one_channel());
    for (double expected : {15.0, 30.0, 40.0, 40.0}) {
        rig.step({40}, period_s);
        rig.result(CB_TRANSFER_OK);
        EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), static_cast<float>(expected));
    }
    EXPECT_EQ(rig.counters.outputs_slewed, 2u);
}

TEST(limiter, ramps_at_the_ramp_rate_or_the_slew_rate_whichever_is_lower) {
    config_builder b = one_channel();
    limiter_rig rig(b);
    rig.step({15}, period_s);
    rig.result(CB_TRANSFER_OK);
    rig.step({0}, period_s, 50);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 13.5f);
    rig.result(CB_TRANSFER_OK);
    rig.builder.config->channels[0].slew_um_per_s = 20;
    rig.step({0}, period_s, 50);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 12.9f);
}

TEST(limiter, a_long_pause_counts_as_two_periods) {
    limiter_rig rig(one_channel());
    rig.step({300}, 10.0);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 30);
}

TEST(limiter, unanswered_writes_stop_two_periods_from_all_that_the_plc_may_hold) {
    limiter_rig rig(one_channel());
    for (double expected : {15.0, 30.0, 30.0, 30.0}) {
        rig.step({300}, period_s);
        rig.result(CB_TRANSFER_UNKNOWN);
        EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), static_cast<float>(expected));
    }
    EXPECT_EQ(rig.states[0].possible_min_um, 0);
    EXPECT_EQ(rig.states[0].possible_max_um, 30);
    // Back: the PLC may hold 30 since just now, so the way down is as slow as any.
    rig.step({-300}, period_s);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 15);
    rig.result(CB_TRANSFER_UNKNOWN);
    rig.step({-300}, period_s);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 0);
    rig.result(CB_TRANSFER_UNKNOWN);
    rig.step({-300}, period_s);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 0);  // 30 is still possible …
    // … and, confirmed writes or not, for as long as one of the others may still take effect.
    const double late_s = cb_limiter_late_us(&rig.config()) * 1e-6;
    for (int n = 0; n <= static_cast<int>(late_s / period_s); ++n) {
        rig.result(CB_TRANSFER_OK);
        rig.step({-300}, period_s);
        EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 0) << n;
    }
    rig.result(CB_TRANSFER_OK);
    rig.step({-300}, period_s);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), -15);
}

// A PLC whose program is stopped and whose server goes on.
TEST(limiter, a_late_write_stays_possible_for_two_turns_while_the_plc_does_not_live) {
    limiter_rig rig(one_channel());
    const auto serve = [&rig](cb_transfer result, double turns) {
        const double turn_s = 2e-6 * cb_limiter_late_us(&rig.config());
        for (int n = static_cast<int>(turns * turn_s / period_s); n > 0; --n) {
            rig.step({-300}, period_s);
            rig.result(result);
        }
    };
    rig.step({300}, period_s);
    rig.result(CB_TRANSFER_UNKNOWN);
    rig.alive = false;
    serve(CB_TRANSFER_FAILED, 10);  // that shows no service
    serve(CB_TRANSFER_OK, 1.9);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), -15);
    EXPECT_EQ(rig.states[0].possible_max_um, 15);
    serve(CB_TRANSFER_OK, 0.5);
    EXPECT_LT(rig.output(), -15);
    EXPECT_LT(rig.states[0].possible_max_um, 15);
}

// Whatever a stage before it makes of an output, by a mistake or a flipped bit.
TEST(limiter, the_last_word_bounds_an_output_that_is_not_a_number_or_far_too_large) {
    const float wrong[] = {std::numeric_limits<float>::infinity(),
                           std::numeric_limits<float>::quiet_NaN(),
                           std::numeric_limits<float>::max()};
    for (float value : wrong) {
        for (float sign : {1.0f, -1.0f}) {
            limiter_rig rig(one_channel());
            rig.states[0].output_um = sign * value;
            rig.states[0].sent_um = 12;
            rig.step({0}, 0);
            EXPECT_TRUE(std::isfinite(rig.output()));
            EXPECT_LE(std::fabs(rig.output()), 300);
        }
    }
}

TEST(limiter, the_sites_ceiling_wins_over_all) {
    config_builder b = one_channel();
    b.config->ceiling_um = 50.005f;
    limiter_rig rig(b);
    rig.builder.config->channels[0].top_um = 50.005f;  // as cb_ceiling_apply() leaves it
    for (int n = 0; n < 20; ++n) {
        rig.step({300}, period_s);
        rig.result(CB_TRANSFER_OK);
        EXPECT_LE(rig.output(), 50.005);
    }
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 50);
}

TEST(limiter, refused_and_failed_writes_change_nothing_of_what_the_plc_holds) {
    for (cb_transfer result : {CB_TRANSFER_REFUSED, CB_TRANSFER_FAILED, CB_TRANSFER_NONE}) {
        limiter_rig rig(one_channel());
        for (int i = 0; i < 10; ++i) {
            rig.step({300}, period_s);
            rig.result(result);
        }
        EXPECT_EQ(rig.states[0].possible_max_um, 0);
        EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 30);
    }
}

TEST(limiter, whole_units_only_and_the_rest_is_carried) {
    config_builder b = one_channel();
    b.config->channels[0].scale = 1;  // FANUC: least increment 1 µm
    limiter_rig rig(b);
    rig.step({100}, period_s);
    rig.result(CB_TRANSFER_OK);
    EXPECT_EQ(rig.output(), 15);
    std::vector<double> ramp;
    for (int i = 0; i < 10; ++i) {  // 50 µm/s: 1.5 µm a period
        rig.step({0}, period_s, 50);
        rig.result(CB_TRANSFER_OK);
        ramp.push_back(rig.output());
    }
    EXPECT_EQ(ramp, (std::vector<double>{14, 12, 11, 9, 8, 6, 5, 3, 2, 0}));
}

TEST(limiter, a_unit_coarser_than_a_step_is_taken_when_earned) {
    config_builder b = one_channel();
    b.config->channels[0].scale = 10;
    b.config->channels[0].slew_um_per_s = 100;  // 3 µm a period
    limiter_rig rig(b);
    std::vector<double> seen;
    for (int i = 0; i < 8; ++i) {
        rig.step({100}, period_s);
        rig.result(CB_TRANSFER_OK);
        seen.push_back(rig.output());
    }
    EXPECT_EQ(seen, (std::vector<double>{0, 0, 0, 10, 10, 10, 20, 20}));
}

TEST(limiter, nearest_rounds_half_away_but_never_beyond_the_limit) {
    cb_channel_config c = one_channel().config->channels[0];
    c.scale = 1;
    c.limit_um = 10.6f;
    cb_channel_derive(&c);
    EXPECT_EQ(cb_channel_nearest(&c, 2.5f), 3);
    EXPECT_EQ(cb_channel_nearest(&c, -2.5f), -3);
    EXPECT_EQ(cb_channel_nearest(&c, 10.55f), 10);
    EXPECT_EQ(cb_channel_nearest(&c, 1e30f), 10);
    EXPECT_EQ(cb_channel_nearest(&c, -std::numeric_limits<float>::infinity()), -10);
    EXPECT_EQ(cb_channel_nearest(&c, std::numeric_limits<float>::quiet_NaN()), 0);
}

// a leads (fast), b follows (slow), D = 50.
config_builder pair_of(float slew_a, float slew_b) {
    config_builder b;
    b.channel("X1", {}, 4).slew_um_per_s = slew_a;
    b.channel("X2", {}, 6).slew_um_per_s = slew_b;
    b.pair(0, 1, 50);
    return b;
}

TEST(limiter, the_faster_of_a_pair_waits_for_the_slower) {
    limiter_rig rig(pair_of(500, 100));
    for (int i = 0; i < 4; ++i) {
        rig.step({200, 200}, period_s);
        rig.result(CB_TRANSFER_OK);
    }
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(0)), 60);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(1)), 12);
    rig.step({200, 200}, period_s);
    rig.result(CB_TRANSFER_OK);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(0)), 65);  // 15 + 50
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(1)), 15);
    for (int i = 0; i < 100; ++i) {
        rig.step({200, 200}, period_s);
        rig.result(CB_TRANSFER_OK);
    }
    EXPECT_EQ(rig.output(0), 200);
    EXPECT_EQ(rig.output(1), 200);
    EXPECT_EQ(rig.counters.pairs_limited, 0u);
}

TEST(limiter, targets_too_far_apart_both_give_way) {
    limiter_rig rig(pair_of(500, 500));
    for (int i = 0; i < 50; ++i) {
        rig.step({-100, -20}, period_s);
        rig.result(CB_TRANSFER_OK);
    }
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(0)), -85);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(1)), -35);
    EXPECT_EQ(rig.counters.pairs_limited, 50u);
}

TEST(limiter, a_pair_with_unequal_limits_stays_in_both) {
    config_builder b = pair_of(500, 500);
    b.config->channels[1].limit_um = 10;
    limiter_rig rig(b);
    for (int i = 0; i < 50; ++i) {
        rig.step({300, 300}, period_s);
        rig.result(CB_TRANSFER_OK);
    }
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(0)), 60);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(1)), 10);
}

TEST(limiter, outputs_beyond_a_new_limit_go_there_at_the_slew_rate) {
    limiter_rig rig(one_channel());
    const cb_start start[1] = {{100, true}};
    cb_limiter_place(&rig.config(), rig.states.data(), start);
    rig.builder.config->channels[0].limit_um = 80;
    cb_config_derive(rig.builder.config.get());
    rig.step({300}, period_s);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 85);
    rig.result(CB_TRANSFER_OK);
    rig.step({300}, period_s);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output()), 80);
}

TEST(limiter, a_pair_beyond_a_new_difference_closes_without_widening) {
    limiter_rig rig(pair_of(500, 20));
    rig.builder.config->pairs[0].max_difference_um = 500;
    const cb_start start[2] = {{200, true}, {-100, true}};
    cb_limiter_place(&rig.config(), rig.states.data(), start);
    rig.builder.config->pairs[0].max_difference_um = 50;
    double before = 300;
    for (int i = 0; i < 800; ++i) {
        rig.step({290, 300}, period_s);
        rig.result(CB_TRANSFER_OK);
        const double difference = std::fabs(rig.output(0) - rig.output(1));
        ASSERT_LE(difference, std::max(before, 50.0001)) << i;
        before = difference;
    }
    EXPECT_EQ(rig.output(0), 290);
    EXPECT_EQ(rig.output(1), 300);
}

// The slack of "the box's own value" must not grow with the reading.
TEST(limiter, an_infinite_or_huge_reading_is_never_taken_for_the_boxs_own) {
    const float readings[] = {std::numeric_limits<float>::infinity(),
                              std::numeric_limits<float>::max(), 1e30f, 1e9f};
    for (float reading : readings) {
        for (float sign : {1.0f, -1.0f}) {
            config_builder b = one_channel();
            b.config->channels[0].type = CB_NUMBER_FLOAT32;
            limiter_rig rig(b);
            const cb_start start[1] = {{sign * reading, true}};
            cb_limiter_place(&rig.config(), rig.states.data(), start);
            rig.check_values();
            EXPECT_LE(std::fabs(rig.states[0].sent_um), 300);
        }
    }
}

// Another client zeroes one motor while the box is out of reach: each value may be one of the
// box's, but no write had both.
TEST(limiter, two_own_values_further_apart_than_the_pair_are_forced_together) {
    limiter_rig rig(pair_of(500, 500));
    for (int i = 0; i < 3; ++i) {
        rig.step({0, 45}, period_s);
        rig.result(CB_TRANSFER_OK);
    }
    rig.step({10, 60}, period_s);
    rig.result(CB_TRANSFER_UNKNOWN);
    const cb_start start[2] = {{0, true}, {60, true}};
    cb_limiter_place(&rig.config(), rig.states.data(), start);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(0)), 5);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(1)), 55);
}

TEST(limiter, place_forces_anything_into_the_limits) {
    limiter_rig rig(pair_of(500, 500));
    rig.states[0].carry_um = 0.009f;
    const cb_start start[2] = {{std::numeric_limits<float>::infinity(), true}, {-77.777f, true}};
    cb_limiter_place(&rig.config(), rig.states.data(), start);
    rig.check_values();
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(0)), 136.11f);
    EXPECT_FLOAT_EQ(static_cast<float>(rig.output(1)), 86.11f);
    EXPECT_EQ(rig.states[0].carry_um, 0);
}

// ---- the property, against random files and an enemy

using random_source = std::mt19937;

double uniform(random_source &r, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(r);
}
double log_uniform(random_source &r, double low, double high) {
    return std::exp(uniform(r, std::log(low), std::log(high)));
}
unsigned pick(random_source &r, unsigned below) {
    return static_cast<unsigned>(r() % below);
}

// finest_pair: the smallest difference of a pair, in units of its coarser register.
config_builder random_config(random_source &r, double finest_pair) {
    config_builder b;
    const unsigned channels = 1 + pick(r, 6);
    const cb_number_type types[] = {CB_NUMBER_INT16, CB_NUMBER_INT32, CB_NUMBER_FLOAT32,
                                    CB_NUMBER_INT16_LE, CB_NUMBER_INT32_CDAB};
    for (unsigned i = 0; i < channels; ++i) {
        cb_channel_config &c = b.channel("c", {}, 2 * i);
        c.type = static_cast<uint8_t>(types[pick(r, 5)]);
        c.limit_um = static_cast<float>(log_uniform(r, 1, 10000));
        c.slew_um_per_s = static_cast<float>(log_uniform(r, 0.5, 5000));
        const bool is_16 = c.type == CB_NUMBER_INT16 || c.type == CB_NUMBER_INT16_LE;
        const double finest = is_16 ? c.limit_um / 30000 : c.limit_um / 4e6;
        c.scale = static_cast<float>(log_uniform(r, std::max(finest, 1e-4), c.limit_um));
        c.sign = pick(r, 2) ? 1 : -1;
    }
    for (unsigned i = 0; i + 1 < channels; i += 2) {
        if (pick(r, 3) == 0) continue;
        const double unit = std::max(b.config->channels[i].scale, b.config->channels[i + 1].scale);
        b.pair(i, i + 1, static_cast<float>(log_uniform(r, finest_pair * unit, 1000 * unit)));
    }
    return b;
}

float random_target(random_source &r, float limit_um) {
    switch (pick(r, 12)) {
        case 0:
            return std::numeric_limits<float>::quiet_NaN();
        case 1:
            return -std::numeric_limits<float>::infinity();
        case 2:
            return 1e38f;
        case 3:
        case 4:
            return 0;
        case 5:
            return limit_um;
        default:
            return static_cast<float>(uniform(r, -1.5, 1.5) * limit_um);
    }
}

// The outcome of one write and, for an unknown one, whether it took effect.
void random_outcome(random_source &r, limiter_rig &rig, unsigned mood) {
    const bool trouble = pick(r, 4) < mood;
    if (!trouble) {
        rig.take();
        if (!rig.late.empty() && pick(r, 3) == 0)
            rig.take_late(rig.late[pick(r, static_cast<unsigned>(rig.late.size()))]);
        rig.result(CB_TRANSFER_OK);
        return;
    }
    const cb_transfer results[] = {CB_TRANSFER_FAILED, CB_TRANSFER_REFUSED, CB_TRANSFER_UNKNOWN,
                                   CB_TRANSFER_UNKNOWN, CB_TRANSFER_UNKNOWN};
    const cb_transfer result = results[pick(r, 5)];
    if (result == CB_TRANSFER_UNKNOWN && pick(r, 2)) rig.take();
    rig.result(result);
}

// The PLC is out of reach, for two periods at least: outputs move for themselves, then start from
// what it holds.
void random_outage(random_source &r, limiter_rig &rig, const std::vector<float> &target) {
    for (unsigned n = 2 + pick(r, 30); n > 0; --n) {
        rig.step(target, period_s, 50, false);
        rig.result(CB_TRANSFER_NONE);
        rig.check_values();
    }
    cb_start held[CB_MAX_CHANNELS];
    for (unsigned i = 0; i < rig.channels(); ++i)
        held[i] = {static_cast<float>(rig.plc[i].um), true};
    cb_limiter_place(&rig.config(), rig.states.data(), held);
    for (unsigned i = 0; i < rig.channels(); ++i) {
        ASSERT_EQ(rig.output(i), rig.plc[i].um) << "what it holds was an output: it is taken as is";
        rig.plc[i].time_s = rig.now_s;
    }
}

void fight(unsigned seed, int rounds, double finest_pair) {
    random_source r(seed);
    for (int round = 0; round < rounds; ++round) {
        SCOPED_TRACE(testing::Message() << "round " << round);
        limiter_rig rig(random_config(r, finest_pair));
        std::vector<float> target(rig.channels(), 0);
        unsigned mood = pick(r, 5);
        for (int n = 0; n < 300; ++n) {
            if (pick(r, 10) == 0) mood = pick(r, 5);
            if (pick(r, 30) == 0) rig.alive = !rig.alive;
            for (unsigned i = 0; i < rig.channels(); ++i) {
                if (pick(r, 20) == 0)
                    target[i] = random_target(r, rig.config().channels[i].limit_um);
            }
            const double elapsed_s =
                pick(r, 8) ? period_s : uniform(r, 0, pick(r, 4) ? 2 * period_s : 10);
            const float ramp = pick(r, 3) ? 0 : static_cast<float>(log_uniform(r, 1, 1000));
            rig.step(target, elapsed_s, ramp);
            rig.check_values();
            random_outcome(r, rig, mood);
            if (pick(r, 100) == 0) random_outage(r, rig, target);
            if (testing::Test::HasFatalFailure()) return;
        }
    }
}

TEST(limiter, keeps_all_its_promises_to_a_hostile_plc) {
    fight(20150715, 3000, 1);
}

// Nothing sensible can be done with such a file, but nothing unsafe is.
TEST(limiter, keeps_them_where_a_pair_is_closer_than_its_registers_can_say) {
    fight(2, 1000, 0.01);
}

TEST(limiter, always_arrives_once_writes_are_confirmed) {
    random_source r(7);
    for (int round = 0; round < 300; ++round) {
        SCOPED_TRACE(testing::Message() << "round " << round);
        limiter_rig rig(random_config(r, 1));
        std::vector<float> target(rig.channels());
        double longest_s = 0;
        for (unsigned i = 0; i < rig.channels(); ++i) {
            const cb_channel_config &c = rig.config().channels[i];
            target[i] = static_cast<float>(uniform(r, -1, 1) * c.limit_um);
            rig.builder.config->channels[i].slew_um_per_s =
                static_cast<float>(c.limit_um / log_uniform(r, 0.01, 30));
            longest_s = std::max(longest_s, 1.0 * c.limit_um / c.slew_um_per_s);
        }
        for (int n = 0; n < 20; ++n) {  // some trouble first
            rig.step(target, period_s);
            random_outcome(r, rig, 4);
        }
        rig.alive = pick(r, 2) == 0;
        // A unit that is not a whole part of a step costs up to half of the speed; a pair waits.
        const int held = static_cast<int>(4e-6 * cb_limiter_late_us(&rig.config()) / period_s);
        const int enough = static_cast<int>(4 * longest_s / period_s) + held + 4;
        for (int n = 0; n < enough; ++n) {
            rig.step(target, period_s);
            rig.take();
            rig.result(CB_TRANSFER_OK);
        }
        rig.counters = {};
        rig.step(target, period_s);
        EXPECT_EQ(rig.counters.outputs_slewed, 0u);
    }
}

}  // namespace
}  // namespace compbox
