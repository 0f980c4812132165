// SPDX-License-Identifier: MIT
// What a person reads: every kind of line has its own limit, and what is left out is reported.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>

extern "C" {
#include "firmware/box/mode.h"
#include "firmware/signals/canopen.h"
#include "hal/linux/daemon/log.h"
#include "hal/linux/files/cause_words.h"
}

namespace {

constexpr int64_t s = 1000000;

// stderr is a pipe meanwhile; log_text() reads it.
struct log_lines : ::testing::Test {
    log_lines() {
        EXPECT_EQ(pipe(ends), 0);
        kept = dup(STDERR_FILENO);
        dup2(ends[1], STDERR_FILENO);
        cb_canopen_start(row->can.nodes);
        config->nodes_count = 1;
        config->nodes[0] = {5, false, 300};
    }
    ~log_lines() override {
        dup2(kept, STDERR_FILENO);
        for (int fd : {ends[0], ends[1], kept}) close(fd);
        unsetenv("JOURNAL_STREAM");
    }
    void start() { cb_log_start(log.get(), "192.0.2.7:502", 0); }
    void step(int64_t time_us) {
        row->time_us = time_us;
        cb_log_row(log.get(), box_config.get(), row.get());
        cb_log_can(log.get(), config.get(), row.get());
        cb_log_catch_up(log.get(), time_us, false);
    }
    // Everything since the last call.
    std::string log_text() {
        fflush(stderr);
        const char end = '\0';
        EXPECT_EQ(write(ends[1], &end, 1), 1);
        std::string text;
        for (char c; read(ends[0], &c, 1) == 1 && c != end;) text += c;
        return text;
    }
    static unsigned count(const std::string &text, const std::string &what) {
        unsigned n = 0;
        for (size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += what.size()) ++n;
        return n;
    }
    int ends[2], kept;
    std::unique_ptr<cb_log> log = std::make_unique<cb_log>();
    std::unique_ptr<cb_row> row = std::make_unique<cb_row>();
    std::unique_ptr<cb_config> box_config = std::make_unique<cb_config>();
    std::unique_ptr<cb_can_config> config = std::make_unique<cb_can_config>();
};

// The thread was held: it looks at the clock, and then takes the rows of meanwhile.
TEST_F(log_lines, rows_that_are_older_than_the_last_look_take_no_allowance_back) {
    start();
    for (int i = 0; i < 40; ++i) {
        row->mode = i % 2 ? CB_MODE_ACTIVE : CB_MODE_HOLD;
        step(i * 1000);
    }
    cb_log_catch_up(log.get(), 60 * s, false);
    log_text();
    row->mode = CB_MODE_FAULT;
    step(1 * s);
    EXPECT_EQ(count(log_text(), "FAULT: "), 1u);
}

// The line of a mode that lasts is left out: it comes when the mode is quiet, once.
TEST_F(log_lines, a_mode_that_was_left_out_is_told_when_it_lasts) {
    start();
    for (int i = 0; i < 42; ++i) {
        row->mode = i % 2 ? CB_MODE_ACTIVE : CB_MODE_HOLD;
        step(i * 1000);
    }
    EXPECT_EQ(count(log_text(), "compboxd: "), 20u);
    step(1 * s);
    EXPECT_EQ(log_text(), "");
    step(3 * s);
    EXPECT_EQ(count(log_text(), "ACTIVE: "), 1u);
    step(9 * s);
    EXPECT_EQ(log_text(), "");
}

// A node that flickers for ten seconds; in the middle the box changes its mode.
TEST_F(log_lines, a_bus_that_flickers_hides_no_change_of_mode) {
    start();
    for (int i = 0; i < 333; ++i) {
        row->can.nodes[0].state = i % 2 ? CB_CANOPEN_STOPPED : CB_CANOPEN_OPERATIONAL;
        row->mode = i < 150 ? CB_MODE_ACTIVE : CB_MODE_HOLD;
        step(i * 30000);
    }
    const std::string text = log_text();
    EXPECT_EQ(count(text, "ACTIVE: "), 1u);
    EXPECT_EQ(count(text, "HOLD: "), 1u) << text;
    const unsigned lines = count(text, "node 5 is ");
    EXPECT_GE(lines, 30u);
    EXPECT_LE(lines, 41u);
    EXPECT_NE(text.find("about the CAN bus left out)"), std::string::npos);
    EXPECT_EQ(text.find("about the mode"), std::string::npos);
}

// The line names the signal, its value and its bound; another signal that is missing is another
// line.
TEST_F(log_lines, a_change_of_mode_names_its_cause) {
    start();
    row->mode = CB_MODE_HOLD;
    row->reason = CB_REASON_SIGNAL;
    row->cause = {{CB_CAUSE_ABOVE, 1, 1000.5f, 1000}, "Y", "mm"};
    step(0);
    row->cause.cause.value = 1001;
    step(30000);
    EXPECT_EQ(
        log_text(),
        "compboxd:     0.000 s: HOLD: an essential signal is missing or implausible: signal Y "
        "reads 1000.5 mm and its max is 1000\n");
    row->cause = {{CB_CAUSE_NEVER, 0, 0, 90}, "X", ""};
    step(60000);
    EXPECT_EQ(count(log_text(), "signal X has had no plausible value yet\n"), 1u);
    row->cause.cause.index = 3;
    step(70000);
    EXPECT_EQ(count(log_text(), "has had no plausible value yet\n"), 1u) << "another signal";
    row->mode = CB_MODE_FAULT;
    row->reason = CB_REASON_DEMAND;
    row->cause = {{CB_CAUSE_DEMAND, 2, -412.25f, 400}, "Z", ""};
    step(90000);
    EXPECT_EQ(
        count(log_text(), "error limit: channel Z wants -412.25 um and its error_um is 400\n"), 1u);
}

// A value that is missing has no unit; one that is below, above or too fast has its signal's.
TEST_F(log_lines, a_cause_has_the_unit_of_its_signal_where_it_has_a_value) {
    const auto box = std::make_unique<cb_box>();
    std::strcpy(box->config.signals[0].name, "X");
    std::strcpy(box->config.signals[0].unit, "mm");
    const auto unit_of = [&](uint8_t kind) {
        box->cause = {kind, 0, 1, 2};
        return std::string(cb_name_cause(box.get()).unit);
    };
    for (const uint8_t kind : {CB_CAUSE_BELOW, CB_CAUSE_ABOVE, CB_CAUSE_FAST})
        EXPECT_EQ(unit_of(kind), "mm") << int{kind};
    EXPECT_EQ(unit_of(CB_CAUSE_NEVER), "");
}

TEST_F(log_lines, what_was_left_out_is_reported_by_itself_and_once) {
    start();
    for (int i = 0; i < 100; ++i) cb_log_limited(log.get(), CB_LOG_FILES, 0, "line %d", i);
    EXPECT_EQ(count(log_text(), "line"), 20u);
    cb_log_catch_up(log.get(), s, false);
    EXPECT_EQ(log_text(), "") << "it may go on";
    cb_log_catch_up(log.get(), 2 * s, false);
    EXPECT_EQ(log_text(), "compboxd:     2.000 s: (80 lines about files left out)\n");
    cb_log_catch_up(log.get(), 9 * s, true);
    EXPECT_EQ(log_text(), "");
}

TEST_F(log_lines, the_end_says_what_was_left_out) {
    start();
    for (int i = 0; i < 21; ++i) cb_log_limited(log.get(), CB_LOG_MODE, 0, "line");
    log_text();
    cb_log_catch_up(log.get(), 1, true);
    EXPECT_EQ(log_text(), "compboxd:     0.000 s: (1 line about the mode left out)\n");
}

TEST_F(log_lines, a_reader_that_does_not_read_stalls_nothing_and_is_reported_later) {
    start();
    const std::string full(4096, '.');
    fcntl(ends[1], F_SETFL, O_NONBLOCK);
    while (write(ends[1], full.data(), full.size()) > 0) continue;
    fcntl(ends[1], F_SETFL, 0);
    cb_log_line(log.get(), 0, "nobody reads this");
    cb_log_catch_up(log.get(), 0, true);
    std::string dots(1 << 16, ' ');
    EXPECT_GT(read(ends[0], dots.data(), dots.size()), 0);
    cb_log_line(log.get(), s, "but this");
    const std::string text = log_text();
    EXPECT_EQ(text,
              "compboxd:     1.000 s: (1 line about start and end left out)\n"
              "compboxd:     1.000 s: but this\n");
}

TEST_F(log_lines, a_function_that_the_plc_does_not_have_is_one_sentence) {
    start();
    for (int i = 0; i < 300; ++i) {
        row->tcp.exceptions = row->tcp.exceptions_by_code[1] = static_cast<uint32_t>(i);
        row->peer.refused_functions = 1u << 23;
        step(i * 30000);
    }
    const std::string text = log_text();
    EXPECT_EQ(count(text,
                    "function 23 (exception 1, illegal function): set plc.exchange to "
                    "\"fc3+fc16\""),
              1u)
        << text;
    EXPECT_EQ(count(text, "exceptions"), 0u) << text;
    row->tcp.exceptions++;
    row->tcp.exceptions_by_code[2]++;
    step(20 * s);
    EXPECT_NE(log_text().find("exceptions: 1; exception 2 (illegal data address)"),
              std::string::npos);
    for (const int code : {7, 15}) {
        row->tcp.exceptions++;
        row->tcp.exceptions_by_code[code]++;
        step((30 + code) * s);
        EXPECT_NE(log_text().find("exceptions: 1; exception " + std::to_string(code) +
                                  " (of a code that has no name)"),
                  std::string::npos);
    }
}

TEST_F(log_lines, an_odd_reply_is_named_once_for_each_kind_and_connection) {
    start();
    row->link.connects = 1;
    const auto odd = [&](cb_odd kind, uint16_t got, uint16_t expected, int64_t time_us) {
        row->peer.odd[kind] = {row->peer.odd[kind].count + 1, got, expected};
        step(time_us);
        return log_text();
    };
    EXPECT_NE(odd(CB_ODD_UNIT, 1, 255, 0).find("a reply from unit 1 to a request for unit 255"),
              std::string::npos);
    EXPECT_EQ(odd(CB_ODD_UNIT, 1, 255, s), "");
    EXPECT_EQ(odd(CB_ODD_UNIT, 2, 255, 2 * s), "") << "the kind is known";
    EXPECT_NE(odd(CB_ODD_FUNCTION, 4, 3, 3 * s).find("function 4 to a request for function 3"),
              std::string::npos);
    EXPECT_NE(odd(CB_ODD_LENGTH, 10, 26, 4 * s).find("10 bytes"), std::string::npos);
    row->link.connects = 2;
    step(5 * s);
    log_text();
    EXPECT_EQ(odd(CB_ODD_UNIT, 1, 255, 6 * s), "") << "the same, a few seconds later";
    EXPECT_NE(odd(CB_ODD_UNIT, 7, 255, 7 * s).find("from unit 7"), std::string::npos);
    row->link.connects = 3;
    step(200 * s);
    log_text();
    EXPECT_NE(odd(CB_ODD_UNIT, 7, 255, 201 * s).find("from unit 7"), std::string::npos);
    row->link.connects = 4;
    EXPECT_NE(odd(CB_ODD_UNIT, 7, 1, 202 * s).find("to a request for unit 1"), std::string::npos);
}

TEST_F(log_lines, slow_replies_are_reported_with_the_period_that_fits) {
    start();
    box_config->period_us = 30000;
    box_config->plc.exchange = CB_EXCHANGE_FC3_FC16;
    box_config->plc.profile = CB_PROFILE_GENERIC;
    row->mode = CB_MODE_ACTIVE;
    row->peer.reply_us[3] = 20100;
    step(0);
    EXPECT_EQ(count(log_text(), "replies take"), 0u) << "contact is not lost";
    row->mode = CB_MODE_HOLD;
    row->reason = CB_REASON_UNCONFIRMED;
    for (int i = 1; i < 100; ++i) step(i * 30000);
    const std::string text = log_text();
    EXPECT_EQ(count(text,
                    "replies take up to 20.1 ms: plc.exchange \"fc3+fc16\" needs "
                    "cycle.period_ms of 51 at least, or \"fc23\" and 26"),
              1u)
        << text;
    row->reason = 0;
    step(4 * s);
    row->peer.reply_us[3] = 4000;
    row->reason = CB_REASON_UNCONFIRMED;
    step(5 * s);
    EXPECT_EQ(count(log_text(), "replies take"), 0u) << "they are fast enough";
}

// fc23 is proposed where it is another way, and one that the PLC has.
TEST_F(log_lines, slow_replies_are_answered_by_fc23_only_where_the_plc_has_it) {
    start();
    box_config->period_us = 30000;
    row->reason = CB_REASON_NO_PLC;
    row->peer.reply_us[0] = 40000;
    const auto proposes = [&](cb_exchange exchange, uint32_t refused, int64_t time_us) {
        box_config->plc.exchange = exchange;
        row->peer.refused_functions = refused;
        log->slow = false;
        step(time_us);
        const std::string text = log_text();
        EXPECT_EQ(count(text, "replies take"), 1u) << text;
        return count(text, ", or \"fc23\" and ") == 1;
    };
    EXPECT_TRUE(proposes(CB_EXCHANGE_FC3_FC16, 0, 0));
    EXPECT_FALSE(proposes(CB_EXCHANGE_FC3_FC16, 1u << 23, s));
    EXPECT_FALSE(proposes(CB_EXCHANGE_FC23, 0, 2 * s));
}

TEST_F(log_lines, a_long_sentence_comes_whole) {
    start();
    const std::string sentence(560, 'x');
    cb_log_line(log.get(), 0, "%s", sentence.c_str());
    EXPECT_NE(log_text().find(sentence + "\n"), std::string::npos);
}

// systemd says which device and file its journal is; another stderr is not it.
TEST_F(log_lines, the_journal_has_time_and_name_already) {
    struct stat there;
    fstat(ends[1], &there);
    const std::string device = std::to_string(there.st_dev) + ":";
    setenv("JOURNAL_STREAM", (device + std::to_string(there.st_ino)).c_str(), 1);
    start();
    cb_log_line(log.get(), 0, "a line");
    EXPECT_EQ(log_text(), "a line\n");
    setenv("JOURNAL_STREAM", (device + std::to_string(there.st_ino + 1)).c_str(), 1);
    start();
    cb_log_line(log.get(), 0, "a line");
    EXPECT_EQ(log_text(), "compboxd:     0.000 s: a line\n");
}

}  // namespace
