// SPDX-License-Identifier: MIT
// The mode machine: every state with every combination of events against rules written down here
// one by one, and the stories of docs/faults.md.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

extern "C" {
#include "firmware/base/counters.h"
#include "firmware/box/mode.h"
}
#include "tests/support/paths.h"

namespace {

constexpr uint32_t max_hold_us = 500000;

// The rules, each from docs/DESIGN.md §5 or docs/decisions/0004-enable.md.
struct rules {
    cb_mode_state s;
    cb_mode_events e;
    uint32_t elapsed_us, hold_limit_us;

    bool healthy() const {
        return e.plc_ok && e.writes_ok && e.heartbeat_ok && e.essentials_ok && e.clock_ok;
    }
    bool new_edge() const { return healthy() && e.enable && !s.enable_was; }
    bool permitted() const { return !s.lost || e.permit_resume || new_edge(); }
    bool plc_says_no() const { return e.plc_ok && (!e.enable || !e.referenced); }
    bool alarmed() const { return e.nc_alarm && s.mode == CB_MODE_ACTIVE; }
    // The configuration in memory has changed: for good, whatever was before.
    bool corrupt() const {
        return e.fault == CB_REASON_CONFIG_CORRUPT && s.mode != CB_MODE_STOPPED;
    }
    bool new_fault() const { return (e.fault != 0 || alarmed()) && s.mode != CB_MODE_FAULT; }
    bool conditions() const {
        return healthy() && e.enable && e.referenced && !e.nc_alarm && !e.stop;
    }

    // All that ACTIVE needs; what is in ACTIVE needs no new permission.
    bool runs() const {
        if (s.mode == CB_MODE_STOPPED || s.mode == CB_MODE_FAULT || e.fault) return false;
        return conditions() && (s.mode == CB_MODE_ACTIVE || permitted());
    }
    bool ends() const {
        const bool resting =
            s.mode == CB_MODE_STANDBY || s.mode == CB_MODE_RAMP || s.mode == CB_MODE_FAULT;
        return resting && !corrupt() && !new_fault() && e.stop && e.all_zero && e.zero_written;
    }
    bool holds() const {
        if (e.fault || e.stop || plc_says_no() || runs()) return false;
        if (s.mode == CB_MODE_ACTIVE) return hold_limit_us > 0;
        return s.mode == CB_MODE_HOLD &&
               static_cast<uint64_t>(s.hold_us) + elapsed_us < hold_limit_us;
    }
    bool stays_in_fault() const {
        if (s.mode != CB_MODE_FAULT || ends()) return false;
        const bool cause = e.fault || (s.reason == CB_REASON_DEMAND && e.excessive) ||
                           (s.reason == CB_REASON_NC_ALARM && e.nc_alarm);
        return cause || !e.plc_ok || !e.reset_edge;
    }

    cb_mode expected() const {
        if (s.mode == CB_MODE_STOPPED) return e.all_zero ? CB_MODE_STOPPED : CB_MODE_RAMP;
        if (ends()) return CB_MODE_STOPPED;
        if (new_fault() || stays_in_fault()) return CB_MODE_FAULT;
        if (runs()) return e.excessive ? CB_MODE_FAULT : CB_MODE_ACTIVE;
        if (holds()) return CB_MODE_HOLD;
        const bool moving = s.mode == CB_MODE_ACTIVE || s.mode == CB_MODE_HOLD;
        return moving || !e.all_zero ? CB_MODE_RAMP : CB_MODE_STANDBY;
    }
};

cb_mode_events events_of(unsigned bits, uint8_t fault) {
    cb_mode_events e;
    std::memset(&e, 0, sizeof e);
    bool *const flags[] = {&e.plc_ok,   &e.heartbeat_ok, &e.essentials_ok, &e.clock_ok,
                           &e.enable,   &e.referenced,   &e.reset_edge,    &e.permit_resume,
                           &e.stop,     &e.all_zero,     &e.zero_written,  &e.excessive,
                           &e.degraded, &e.limited,      &e.writes_ok,     &e.nc_alarm};
    for (bool *flag : flags) {
        *flag = bits & 1;
        bits >>= 1;
    }
    e.fault = fault;
    return e;
}
constexpr unsigned all_events = 1u << 16;

// The reason that belongs to the mode, as far as the rules fix it; -1: not fixed.
int expected_reason(const rules &before, uint8_t mode_after) {
    const cb_mode_events &e = before.e;
    if (before.corrupt()) return CB_REASON_CONFIG_CORRUPT;
    if (mode_after == CB_MODE_ACTIVE && e.degraded) return CB_REASON_DEGRADED;
    if (mode_after == CB_MODE_ACTIVE) return e.limited ? CB_REASON_LIMITED : CB_REASON_NONE;
    if (before.s.mode == CB_MODE_FAULT && mode_after == CB_MODE_FAULT) return before.s.reason;
    if (mode_after == CB_MODE_FAULT && before.alarmed() && e.fault == 0) return CB_REASON_NC_ALARM;
    if (mode_after == CB_MODE_FAULT && e.fault == 0) return CB_REASON_DEMAND;
    if (mode_after == CB_MODE_FAULT) return e.fault;
    if (mode_after == CB_MODE_STOPPED && before.s.mode == CB_MODE_STOPPED) return before.s.reason;
    if (before.s.mode == CB_MODE_STOPPED) return CB_REASON_STOP;
    if (e.stop) return CB_REASON_STOP;
    if (!e.clock_ok) return CB_REASON_CLOCK;
    if (!e.writes_ok) return CB_REASON_UNCONFIRMED;
    if (!e.plc_ok) return CB_REASON_NO_PLC;
    return -1;
}

// What is known of `lost` after the step; -1: not fixed. What was lost stays lost until ACTIVE or
// an edge with everything healthy.
int expected_lost(const rules &before, uint8_t mode_after) {
    if (before.s.mode == CB_MODE_STOPPED) return -1;
    if (mode_after == CB_MODE_ACTIVE) return 0;
    if (mode_after == CB_MODE_FAULT || before.s.mode == CB_MODE_FAULT) return 1;
    if (mode_after == CB_MODE_HOLD && before.s.mode == CB_MODE_ACTIVE) return 1;
    if (before.s.mode == CB_MODE_RAMP && !before.healthy()) return 1;
    if (before.s.mode == CB_MODE_ACTIVE) return !before.healthy() ? 1 : -1;
    return before.new_edge() ? 0 : before.s.lost;
}

using transitions = std::set<std::pair<uint8_t, uint8_t>>;

void check(const cb_mode_state &state, const cb_mode_events &events, uint32_t elapsed_us,
           uint32_t hold_limit_us, transitions &seen) {
    const rules before = {state, events, elapsed_us, hold_limit_us};
    cb_mode_state after = state;
    cb_mode_step(&after, &events, elapsed_us, hold_limit_us);
    ASSERT_EQ(after.mode, before.expected())
        << cb_mode_name(state.mode) << " hold " << state.hold_us;
    ASSERT_EQ(after.enable_was, events.enable);
    if (after.mode != state.mode) seen.insert({state.mode, after.mode});
    ASSERT_EQ(after.reason >= 16, after.mode == CB_MODE_FAULT);
    const int reason = expected_reason(before, after.mode),
              lost = expected_lost(before, after.mode);
    if (reason >= 0) {
        ASSERT_EQ(after.reason, reason);
    } else {
        ASSERT_NE(after.reason, CB_REASON_NONE);
    }
    if (lost >= 0) {
        ASSERT_EQ(after.lost, lost == 1);
    }
}

// Checks every state with every combination of events; out: the transitions that happened.
void explore(transitions &seen) {
    const struct {
        uint32_t spent_us, elapsed_us, limit_us;
    } holds[] = {{0, 30000, max_hold_us}, {470000, 30000, max_hold_us}, {0, 30000, 0}};
    for (uint8_t mode = CB_MODE_STANDBY; mode <= CB_MODE_STOPPED; ++mode) {
        for (unsigned flags = 0; flags < 4; ++flags) {
            for (const auto &hold : holds) {
                for (uint8_t fault :
                     {CB_REASON_NONE, CB_REASON_OVERRUN, CB_REASON_CONFIG_CORRUPT}) {
                    for (unsigned bits = 0; bits < all_events; ++bits) {
                        cb_mode_state state;
                        std::memset(&state, 0, sizeof state);
                        state.mode = mode;
                        const auto fault_was = bits & 1 ? CB_REASON_DEMAND : CB_REASON_NC_ALARM;
                        state.reason = mode == CB_MODE_FAULT ? fault_was : CB_REASON_NONE;
                        state.enable_was = flags & 1;
                        state.lost = flags & 2;
                        state.hold_us = hold.spent_us;
                        check(state, events_of(bits, fault), hold.elapsed_us, hold.limit_us, seen);
                        if (testing::Test::HasFatalFailure())
                            FAIL() << "events " << bits << " flags " << flags;
                    }
                }
            }
        }
    }
}

std::string text_of(const std::string &file) {
    std::ifstream in(from_source(file));
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

// Every state with every combination of events: the picture has each transition that they make, and
// no other.
TEST(mode, the_picture_is_that_of_the_machine) {
    transitions seen;
    explore(seen);
    const std::string dot = text_of("docs/mode.dot");
    const std::regex arrow("(\\w+) -> (\\w+)");
    std::set<std::string> drawn, made;
    for (std::sregex_iterator i(dot.begin(), dot.end(), arrow), end; i != end; ++i)
        drawn.insert((*i)[0]);
    for (const auto &[from, to] : seen)
        made.insert(std::string(cb_mode_name(from)) + " -> " + cb_mode_name(to));
    EXPECT_EQ(drawn, made);
    // That nothing is written after reason 17 is no transition: the node of FAULT says it.
    const std::string node = dot.substr(dot.find("FAULT [label="));
    EXPECT_NE(node.substr(0, node.find(']')).find("reason 17: no write until a restart"),
              std::string::npos);
}

TEST(mode, the_page_on_faults_names_everything) {
    const std::string page = text_of("docs/faults.md");
    const auto has = [&page](const std::string &text) {
        return page.find(text) != std::string::npos;
    };
#define CB_X(name, value, text) EXPECT_TRUE(has("| " #value " | " text " |")) << text;
    CB_MODES(CB_X)
    CB_REASONS(CB_X)
#undef CB_X
    const std::string remedies = text_of("docs/when-it-stops.md");
#define CB_X(name, value, text) \
    EXPECT_NE(remedies.find("\n### " #value " " text "\n"), std::string::npos) << text;
    CB_REASONS(CB_X)
#undef CB_X
    for (unsigned i = 0; i < CB_COUNTERS_COUNT; ++i)
        EXPECT_TRUE(has("| `" + std::string(cb_counter_name(i)) + "` |")) << cb_counter_name(i);
}

// ---- stories

struct story {
    cb_mode_state state;
    cb_mode_events e;

    story() {
        cb_mode_start(&state);
        std::memset(&e, 0, sizeof e);
        e.plc_ok = e.writes_ok = e.heartbeat_ok = e.essentials_ok = e.clock_ok = true;
        e.enable = e.referenced = true;
        e.all_zero = true;
    }
    cb_mode step(uint32_t elapsed_us = 30000) {
        cb_mode_step(&state, &e, elapsed_us, max_hold_us);
        return static_cast<cb_mode>(state.mode);
    }
};

// ACTIVE, with outputs that are not zero.
struct running_story : story {
    running_story() {
        EXPECT_EQ(step(), CB_MODE_ACTIVE);
        e.all_zero = false;
    }
};

TEST(mode, after_power_on_enable_is_a_level) {
    story s;
    EXPECT_EQ(s.state.mode, CB_MODE_STANDBY);
    EXPECT_EQ(s.state.reason, CB_REASON_NO_PLC);
    EXPECT_EQ(s.step(), CB_MODE_ACTIVE);
}

TEST(mode, hold_ends_after_its_time) {
    running_story s;
    s.e.essentials_ok = false;
    EXPECT_EQ(s.step(), CB_MODE_HOLD);
    for (int i = 1; i <= 16; ++i) EXPECT_EQ(s.step(), CB_MODE_HOLD) << i;  // 480 ms
    EXPECT_EQ(s.step(), CB_MODE_RAMP);                                     // 510 ms
    EXPECT_EQ(s.state.reason, CB_REASON_SIGNAL);
    s.e.all_zero = true;
    EXPECT_EQ(s.step(), CB_MODE_STANDBY);
}

TEST(mode, hold_time_does_not_wrap) {
    running_story s;
    s.e.plc_ok = false;
    EXPECT_EQ(s.step(), CB_MODE_HOLD);
    s.state.hold_us = UINT32_MAX - 10;
    EXPECT_EQ(s.step(UINT32_MAX), CB_MODE_RAMP);
}

TEST(mode, out_of_hold_only_with_permission) {
    running_story s;
    s.e.heartbeat_ok = false;
    EXPECT_EQ(s.step(), CB_MODE_HOLD);
    EXPECT_EQ(s.state.reason, CB_REASON_HEARTBEAT);
    s.e.heartbeat_ok = true;
    EXPECT_EQ(s.step(), CB_MODE_HOLD);
    EXPECT_EQ(s.state.reason, CB_REASON_WAIT_ENABLE);
    s.e.permit_resume = true;
    EXPECT_EQ(s.step(), CB_MODE_ACTIVE);
}

TEST(mode, a_plc_that_confirms_no_write_is_a_loss) {
    running_story s;
    s.e.writes_ok = false;
    EXPECT_EQ(s.step(), CB_MODE_HOLD);
    EXPECT_EQ(s.state.reason, CB_REASON_UNCONFIRMED);
    s.e.plc_ok = false;  // the same cause is reported while the connection is made anew
    EXPECT_EQ(s.step(), CB_MODE_HOLD);
    EXPECT_EQ(s.state.reason, CB_REASON_UNCONFIRMED);
    s.e.plc_ok = s.e.permit_resume = true;
    EXPECT_EQ(s.step(max_hold_us), CB_MODE_RAMP);
    s.e.writes_ok = true;
    EXPECT_EQ(s.step(), CB_MODE_ACTIVE);
}

TEST(mode, an_alarm_of_the_nc_is_a_fault_only_while_it_is_compensated) {
    running_story s;
    s.e.nc_alarm = true;
    EXPECT_EQ(s.step(), CB_MODE_FAULT);
    EXPECT_EQ(s.state.reason, CB_REASON_NC_ALARM);
    s.e.reset_edge = true;
    EXPECT_EQ(s.step(), CB_MODE_FAULT) << "the alarm is still there";
    s.e.nc_alarm = false;
    s.e.all_zero = true;
    EXPECT_EQ(s.step(), CB_MODE_STANDBY);
    s.e.reset_edge = false;
    s.e.nc_alarm = s.e.permit_resume = true;
    EXPECT_EQ(s.step(), CB_MODE_STANDBY) << "it waits for the alarm to go";
    EXPECT_EQ(s.state.reason, CB_REASON_NC);
    s.e.nc_alarm = false;
    EXPECT_EQ(s.step(), CB_MODE_ACTIVE);
}

TEST(mode, a_plc_that_applies_something_else_is_reported_and_goes_on) {
    running_story s;
    s.e.unapplied = s.e.degraded = s.e.limited = true;
    EXPECT_EQ(s.step(), CB_MODE_ACTIVE);
    EXPECT_EQ(s.state.reason, CB_REASON_UNAPPLIED);
}

TEST(mode, enable_taken_away_and_given_back_by_the_plc_is_no_loss) {
    running_story s;
    s.e.enable = false;
    EXPECT_EQ(s.step(), CB_MODE_RAMP);
    EXPECT_EQ(s.state.reason, CB_REASON_NOT_ENABLED);
    s.e.enable = true;
    EXPECT_EQ(s.step(), CB_MODE_ACTIVE);  // directly out of RAMP
}

TEST(mode, after_a_loss_in_standby_a_level_is_not_enough) {
    running_story s;
    s.e.plc_ok = false;
    s.step();
    s.e.all_zero = true;
    for (int i = 0; i < 20; ++i) s.step();
    EXPECT_EQ(s.state.mode, CB_MODE_STANDBY);
    s.e.plc_ok = true;
    EXPECT_EQ(s.step(), CB_MODE_STANDBY);
    EXPECT_EQ(s.state.reason, CB_REASON_WAIT_ENABLE);
    s.e.enable = false;
    EXPECT_EQ(s.step(), CB_MODE_STANDBY);
    s.e.enable = true;
    EXPECT_EQ(s.step(), CB_MODE_ACTIVE);
}

TEST(mode, an_edge_while_the_loss_lasts_does_not_count) {
    running_story s;
    s.e.heartbeat_ok = false;
    s.step();
    s.e.enable = false;
    EXPECT_EQ(s.step(), CB_MODE_RAMP);
    s.e.enable = true;
    EXPECT_EQ(s.step(), CB_MODE_RAMP);
    s.e.heartbeat_ok = true;
    EXPECT_EQ(s.step(), CB_MODE_RAMP);
    EXPECT_EQ(s.state.reason, CB_REASON_WAIT_ENABLE);
}

TEST(mode, an_edge_before_the_axes_are_referenced_counts) {
    running_story s;
    s.e.referenced = false;
    EXPECT_EQ(s.step(), CB_MODE_RAMP);
    EXPECT_EQ(s.state.reason, CB_REASON_NOT_REFERENCED);
    s.e.referenced = true;
    EXPECT_EQ(s.step(), CB_MODE_RAMP);  // a position was lost: it does not go on by itself
    s.e.referenced = false;
    s.e.enable = false;
    s.step();
    s.e.enable = true;
    EXPECT_EQ(s.step(), CB_MODE_RAMP);
    s.e.referenced = true;
    EXPECT_EQ(s.step(), CB_MODE_ACTIVE);
}

TEST(mode, a_fault_is_latched_until_reset_with_its_cause_gone) {
    running_story s;
    s.e.excessive = true;
    EXPECT_EQ(s.step(), CB_MODE_FAULT);
    EXPECT_EQ(s.state.reason, CB_REASON_DEMAND);
    s.e.reset_edge = true;
    EXPECT_EQ(s.step(), CB_MODE_FAULT);  // still too much
    s.e.excessive = false;
    s.e.reset_edge = false;
    EXPECT_EQ(s.step(), CB_MODE_FAULT);
    s.e.reset_edge = true;
    EXPECT_EQ(s.step(), CB_MODE_RAMP);  // not at zero yet
    s.e.all_zero = true;
    EXPECT_EQ(s.step(), CB_MODE_STANDBY);
    EXPECT_EQ(s.state.reason, CB_REASON_WAIT_ENABLE);  // a fault is a loss
    s.e.permit_resume = true;
    EXPECT_EQ(s.step(), CB_MODE_ACTIVE);
}

TEST(mode, too_much_is_a_fault_already_on_the_way_to_active) {
    story s;
    s.e.excessive = true;
    EXPECT_EQ(s.step(), CB_MODE_FAULT);
    story idle;
    idle.e.enable = false;
    idle.e.excessive = true;
    EXPECT_EQ(idle.step(), CB_MODE_STANDBY);  // without enable
}

TEST(mode, stop_ramps_and_waits_until_the_plc_holds_zero) {
    running_story s;
    s.e.stop = true;
    EXPECT_EQ(s.step(), CB_MODE_RAMP);
    EXPECT_EQ(s.state.reason, CB_REASON_STOP);
    s.e.all_zero = true;
    EXPECT_EQ(s.step(), CB_MODE_STANDBY);
    s.e.zero_written = true;
    EXPECT_EQ(s.step(), CB_MODE_STOPPED);
    s.e.stop = false;
    EXPECT_EQ(s.step(), CB_MODE_STOPPED);
}

TEST(mode, names_and_reasons_have_texts) {
    EXPECT_STREQ(cb_mode_name(CB_MODE_HOLD), "HOLD");
    EXPECT_STREQ(cb_mode_name(99), "a mode this version does not know");
    EXPECT_STREQ(cb_reason_text(CB_REASON_NONE), "all is well");
    EXPECT_STREQ(cb_reason_text(200), "a reason this version does not know");
}

}  // namespace
