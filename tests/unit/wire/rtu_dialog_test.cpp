// SPDX-License-Identifier: MIT
// The rule by which a master on a serial line asks, against a slave and a line in virtual time that
// do everything a serial line can do except change the order of the slave's replies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <deque>

#include "tests/support/dice.h"

extern "C" {
#include "firmware/config/rtu_budget.h"
#include "firmware/wire/rtu_dialog.h"
#include "hal/rtu_exchange.h"
}

using namespace compbox_test;

namespace {

constexpr std::int64_t PERIOD_US = 30000, DEADLINE_US = 24000, READ_US = 9000, PROBE_US = 5000;

cb_plc_config plc_of(std::uint16_t read = 24, std::uint16_t write = 8) {
    cb_plc_config plc{};
    plc.serial.line = {115200, CB_PARITY_EVEN, 1};
    plc.serial.slave_delay_us = 1000;
    plc.exchange = CB_EXCHANGE_FC3_FC16;
    plc.read = {0, read, false};
    plc.write = {100, write, false};
    return plc;
}

cb_rtu_dialog started() {
    cb_rtu_dialog dialog;
    const auto plc = plc_of();
    const auto manners = cb_rtu_manners_of(&plc);
    cb_rtu_dialog_start(&dialog, &manners, 0);
    return dialog;
}

const cb_modbus_request READING = cb_modbus_read(0, 24);
const std::uint16_t WORDS[8] = {};
const cb_modbus_request WRITING = cb_modbus_write(100, 8, WORDS);

// ---- what it says, step by step ----

struct steps {
    cb_rtu_dialog dialog = started();
    std::int64_t until_us = 0;

    explicit steps(std::uint32_t reserve_us = 0) {
        dialog.manners.reserve_us = reserve_us;
        dialog.doubtful = false;
        cb_rtu_dialog_begin(&dialog, &READING, DEADLINE_US);
    }
    cb_rtu_send next(std::int64_t now_us) { return cb_rtu_dialog_next(&dialog, now_us, &until_us); }
    void ended(cb_rtu_end end) { cb_rtu_dialog_ended(&dialog, end); }
};

TEST(rtu_dialog, nobody_knows_what_was_asked_before_the_start) {
    cb_rtu_dialog dialog = started();
    std::int64_t until_us;
    cb_rtu_dialog_begin(&dialog, &READING, DEADLINE_US);
    EXPECT_EQ(cb_rtu_dialog_next(&dialog, 0, &until_us), CB_RTU_SEND_PROBE);
    EXPECT_EQ(cb_rtu_probe(&dialog)->function, CB_MODBUS_READ);
    EXPECT_EQ(cb_rtu_probe(&dialog)->read_count, 1);
    cb_rtu_dialog_ended(&dialog, CB_RTU_END_REPLY);
    EXPECT_EQ(cb_rtu_dialog_next(&dialog, 5000, &until_us), CB_RTU_SEND_REQUEST);
    cb_rtu_dialog_ended(&dialog, CB_RTU_END_REPLY);
    EXPECT_EQ(cb_rtu_dialog_next(&dialog, 14000, &until_us), CB_RTU_SEND_NOTHING);
    EXPECT_EQ(dialog.outcome, CB_TRANSFER_OK);
}

TEST(rtu_dialog, a_damaged_reply_is_asked_for_again_at_once) {
    steps s;
    EXPECT_EQ(s.next(0), CB_RTU_SEND_REQUEST);
    s.ended(CB_RTU_END_DAMAGED);
    EXPECT_EQ(s.next(11000), CB_RTU_SEND_REQUEST);
    s.ended(CB_RTU_END_DAMAGED);
    EXPECT_EQ(s.next(22000), CB_RTU_SEND_NOTHING);
    EXPECT_EQ(s.dialog.outcome, CB_TRANSFER_UNKNOWN);
    EXPECT_FALSE(s.dialog.doubtful);
}

TEST(rtu_dialog, whatever_else_came_or_did_not_is_followed_by_a_probe) {
    for (const auto end : {CB_RTU_END_RUBBISH, CB_RTU_END_SILENT, CB_RTU_END_STRAY}) {
        steps s;
        EXPECT_EQ(s.next(0), CB_RTU_SEND_REQUEST);
        s.ended(end);
        EXPECT_EQ(s.next(1000), CB_RTU_SEND_PROBE);
        s.ended(CB_RTU_END_SILENT);
        EXPECT_TRUE(s.dialog.doubtful);
        cb_rtu_dialog_begin(&s.dialog, &WRITING, PERIOD_US + DEADLINE_US);
        EXPECT_EQ(s.next(PERIOD_US), CB_RTU_SEND_PROBE);
        s.ended(CB_RTU_END_DAMAGED);  // is an answer all the same
        EXPECT_EQ(s.next(PERIOD_US + 6000), CB_RTU_SEND_REQUEST);
    }
}

// A probe's length is no block's, and lies within one.
TEST(rtu_dialog, two_probes_of_lengths_that_no_block_has) {
    for (std::uint16_t read = 2; read < 9; ++read)
        for (std::uint16_t write = 3; write < 9; ++write) {
            const auto plc = plc_of(read, write);
            const auto second = cb_rtu_second_probe(&plc);
            EXPECT_EQ(second == 0, read < 4 && write < 4 && read == 2) << read << " " << write;
            EXPECT_TRUE(second != read && second != write && second != 1);
            EXPECT_LT(second, std::max(read, write));
        }
}

// The slave may still answer the second probe of a doubt in the next one: that has another length.
TEST(rtu_dialog, each_doubt_has_its_own_probe) {
    steps s;
    std::uint16_t before = cb_rtu_probe(&s.dialog)->read_count;
    for (int doubts = 0; doubts < 4; ++doubts) {
        s.next(0);
        s.ended(CB_RTU_END_SILENT);
        EXPECT_EQ(s.next(0), CB_RTU_SEND_PROBE);
        EXPECT_NE(cb_rtu_probe(&s.dialog)->read_count, before);
        before = cb_rtu_probe(&s.dialog)->read_count;
        s.ended(CB_RTU_END_SILENT);
        EXPECT_EQ(s.next(0), CB_RTU_SEND_PROBE);
        EXPECT_EQ(cb_rtu_probe(&s.dialog)->read_count, before);
        s.ended(CB_RTU_END_REPLY);
        cb_rtu_dialog_begin(&s.dialog, &READING, DEADLINE_US);
    }
}

TEST(rtu_dialog, an_exception_to_the_probe_leaves_the_doubt) {
    steps s;
    s.dialog.doubtful = true;
    EXPECT_EQ(s.next(0), CB_RTU_SEND_PROBE);
    s.ended(CB_RTU_END_REFUSED);
    EXPECT_EQ(s.next(1000), CB_RTU_SEND_NOTHING);
    EXPECT_EQ(s.dialog.outcome, CB_TRANSFER_REFUSED);
    EXPECT_TRUE(s.dialog.doubtful);
}

// A first try may have been done: only when nothing was sent before is a refusal one.
TEST(rtu_dialog, a_refusal_after_a_try_says_little) {
    steps s;
    EXPECT_EQ(s.next(0), CB_RTU_SEND_REQUEST);
    s.ended(CB_RTU_END_DAMAGED);
    EXPECT_EQ(s.next(1000), CB_RTU_SEND_REQUEST);
    s.ended(CB_RTU_END_REFUSED);
    EXPECT_EQ(s.next(2000), CB_RTU_SEND_NOTHING);
    EXPECT_EQ(s.dialog.outcome, CB_TRANSFER_UNKNOWN);
}

// A reading of 24 takes 9.3 ms at least, and 1 ms more at most; the probe 5.1.
TEST(rtu_dialog, waits_for_a_reply_only_as_long_as_there_is_time_to_ask_again) {
    steps s;
    s.next(0);
    EXPECT_EQ(s.until_us, DEADLINE_US);  // 10.3 + 6.1 + 10.3 is more
    cb_rtu_dialog_begin(&s.dialog, &READING, 30000);
    s.next(0);
    EXPECT_LT(s.until_us, 30000 - 15000);
    EXPECT_GT(s.until_us, 10300);
}

TEST(rtu_dialog, what_could_not_be_answered_in_time_is_not_asked) {
    steps s;
    EXPECT_EQ(s.next(DEADLINE_US - 8000), CB_RTU_SEND_NOTHING);
    EXPECT_EQ(s.dialog.outcome, CB_TRANSFER_FAILED);
    EXPECT_EQ(s.next(DEADLINE_US - 9500), CB_RTU_SEND_REQUEST);
}

TEST(rtu_dialog, a_repetition_leaves_the_time_of_the_write) {
    steps s(8000);
    s.next(0);
    s.ended(CB_RTU_END_DAMAGED);
    EXPECT_EQ(s.next(7000), CB_RTU_SEND_NOTHING);
    steps t(8000);
    t.next(0);
    t.ended(CB_RTU_END_DAMAGED);
    EXPECT_EQ(t.next(5500), CB_RTU_SEND_REQUEST);
}

TEST(rtu_dialog, a_line_that_spoils_everything_is_asked_so_often_and_no_more) {
    steps s;
    cb_rtu_dialog_begin(&s.dialog, &READING, INT64_C(1) << 40);
    int requests = 0;
    while (s.next(requests) != CB_RTU_SEND_NOTHING) {
        ++requests;
        s.ended(CB_RTU_END_RUBBISH);
    }
    EXPECT_EQ(requests, CB_RTU_TRIES);
}

// ---- against an enemy ----

enum class shape { probe, longer_probe, reading, written };

struct frame {
    std::int64_t at_us;  // its last byte is there
    shape what;
    unsigned of;  // the frame it answers
    bool damaged, refused;
};

// Loses, damages and delays what it likes, by up to ten periods, and answers one after the other.
struct enemy {
    dice roll{1};
    bool spiteful = true;
    bool believes_everything = false;  // a master without the rule, to see that this test can fail
    std::int64_t now_us = 0, replied_us = 0;
    unsigned sent = 0, wrong = 0, good = 0, refused_by = 0;
    std::deque<frame> line;
    cb_rtu_dialog dialog{};

    shape probe() const {
        return cb_rtu_probe(&dialog)->read_count == 1 ? shape::probe : shape::longer_probe;
    }

    bool chance(unsigned percent) { return spiteful && roll(size_t{100}) < percent; }

    void answer(shape what) {
        if (chance(15)) return;  // it did not hear
        const auto delay_us =
            static_cast<std::int64_t>(chance(15) ? roll(size_t{10 * PERIOD_US}) : 500u);
        const std::int64_t takes_us = what == shape::reading ? READ_US - 2500 : PROBE_US - 2500;
        replied_us = std::max(replied_us, now_us + 2500 + delay_us) + takes_us;
        if (!chance(10)) line.push_back({replied_us, what, sent, chance(10), chance(5)});
    }

    cb_rtu_end send(cb_rtu_send what, shape wanted, std::int64_t until_us) {
        bool stray = false;
        while (!line.empty() && line.front().at_us <= now_us) line.pop_front(), stray = true;
        if (stray && what == CB_RTU_SEND_REQUEST) return CB_RTU_END_STRAY;
        ++sent;
        answer(wanted);
        while (!line.empty() && line.front().at_us <= until_us) {
            const frame came = line.front();
            line.pop_front();
            now_us = std::max(now_us, came.at_us);
            const bool writes = came.what == shape::written;
            const bool refuses = came.refused && writes == (wanted == shape::written);
            if (refuses && !came.damaged) {
                if (what == CB_RTU_SEND_REQUEST) refused_by = came.of;
                return CB_RTU_END_REFUSED;
            }
            if (came.refused || came.what != wanted) {
                if (what == CB_RTU_SEND_PROBE) continue;
                return CB_RTU_END_RUBBISH;
            }
            if (came.damaged) return CB_RTU_END_DAMAGED;
            if (what == CB_RTU_SEND_REQUEST) {
                wrong += came.of != sent;
                ++good;
            }
            return CB_RTU_END_REPLY;
        }
        now_us = until_us;
        return CB_RTU_END_SILENT;
    }

    cb_transfer exchange(const cb_modbus_request &request, std::int64_t deadline_us) {
        const cb_rtu_wire wire = {
            this, [](void *self) { return static_cast<enemy *>(self)->now_us; },
            [](void *self, cb_rtu_send what, const cb_modbus_request *sent_now, std::uint16_t *,
               std::int64_t until_us) {
                auto *const me = static_cast<enemy *>(self);
                const bool writes = sent_now->function == CB_MODBUS_WRITE;
                const auto end = me->send(what,
                                          what == CB_RTU_SEND_PROBE ? me->probe()
                                          : writes                  ? shape::written
                                                                    : shape::reading,
                                          until_us);
                if (me->believes_everything) me->dialog.doubtful = false;
                return end;
            }};
        if (believes_everything) dialog.doubtful = false;
        refused_by = 0;
        const auto done = cb_rtu_exchange_on(&wire, &dialog, &request, nullptr, deadline_us);
        wrong += done == CB_TRANSFER_REFUSED && refused_by != 0 && refused_by != sent;
        return done;
    }

    void run(int cycles) {
        for (int cycle = 0; cycle < cycles; ++cycle) {
            const std::int64_t tick_us = (now_us / PERIOD_US + 1) * PERIOD_US;
            now_us = tick_us;
            exchange(READING, tick_us + DEADLINE_US);
            exchange(WRITING, tick_us + DEADLINE_US);
            ASSERT_LE(now_us, tick_us + DEADLINE_US);
        }
    }
};

enemy begun() {
    enemy e;
    e.dialog = started();
    return e;
}

TEST(rtu_dialog, no_reply_is_ever_taken_for_that_to_another_frame) {
    enemy e = begun();
    e.run(100000);
    EXPECT_EQ(e.wrong, 0u);
    EXPECT_GT(e.good, 10000u);
}

TEST(rtu_dialog, without_the_rule_the_enemy_would_be_believed) {
    enemy e = begun();
    e.believes_everything = true;
    e.run(2000);
    EXPECT_GT(e.wrong, 20u);
}

TEST(rtu_dialog, after_all_that_it_goes_on_as_before) {
    for (unsigned seed = 0; seed < 50; ++seed) {
        enemy e = begun();
        e.roll = dice(seed);
        e.run(40);
        e.spiteful = false;
        e.run(12);  // what is still to come is up to ten periods late
        const unsigned before = e.good, sent = e.sent;
        e.run(10);
        EXPECT_EQ(e.good - before, 20u) << seed;
        EXPECT_EQ(e.sent - sent, 20u) << seed;
    }
}

}  // namespace
