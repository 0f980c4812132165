// SPDX-License-Identifier: MIT
// When a coefficient file counts as changed: every way in which editors, people and machines put
// another one in its place; what may be loaded; what may take over at once, and what only at rest.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/config_fixture.h"
#include "tests/support/temporary.h"

extern "C" {
#include "hal/linux/daemon/reload.h"
#include "hal/linux/daemon/widening.h"
#include "hal/linux/files/ceiling_words.h"
#include "hal/linux/realtime.h"
}

namespace {

namespace fs = std::filesystem;

struct reload_file : ::testing::Test {
    reload_file() {
        folder = compbox_test::temporary("reload");
        fs::remove_all(folder);
        fs::create_directories(folder);
        path = (folder / "c.json").string();
        write(path, "first");
    }
    static void write(const fs::path &to, const std::string &text) { std::ofstream(to) << text; }
    // As cb_reload_offer() does before it reads.
    void start() { cb_reload_start(&reload, path.c_str(), &site); }
    // One look, a second after the last one.
    bool look() { return cb_reload_file_changed(&reload, now_us += CB_RELOAD_LOOK_US); }
    // How many looks it takes; 9: it never counts as changed.
    int looks() {
        for (int n = 1; n < 9; ++n)
            if (look()) return n;
        return 9;
    }
    fs::path folder;
    std::string path;
    cb_site site = {{0, 0}, nullptr};
    cb_reload reload;
    int64_t now_us = 1000000000;
};

TEST_F(reload_file, that_stays_is_never_read_again) {
    start();
    EXPECT_EQ(looks(), 9);
}

TEST_F(reload_file, is_looked_at_once_a_second) {
    start();
    EXPECT_FALSE(look());
    write(path, "another one");
    EXPECT_FALSE(look()) << "it may still be changing";
    EXPECT_FALSE(cb_reload_file_changed(&reload, now_us + CB_RELOAD_LOOK_US - 1));
    EXPECT_TRUE(look());
}

TEST_F(reload_file, renamed_over_is_seen_also_with_the_old_ones_size_and_time) {
    start();
    const auto time = fs::last_write_time(path);
    write(folder / "new", "other");
    fs::last_write_time(folder / "new", time);
    fs::rename(folder / "new", path);
    EXPECT_EQ(looks(), 2);
}

TEST_F(reload_file, that_grows_is_read_when_it_stopped) {
    start();
    std::ofstream file(path, std::ios::trunc);
    for (int i = 0; i < 4; ++i) {
        file << "piece" << std::flush;
        EXPECT_FALSE(look()) << i;
    }
    EXPECT_TRUE(look());
}

TEST_F(reload_file, written_in_place_with_the_same_size_and_time_is_seen) {
    start();
    const auto time = fs::last_write_time(path);
    usleep(20000);  // the kernel's clock of files is that coarse
    write(path, "other");
    fs::last_write_time(path, time);
    EXPECT_EQ(looks(), 2);
}

TEST_F(reload_file, with_a_time_of_long_ago_is_read) {
    start();
    fs::last_write_time(path, fs::last_write_time(path) - std::chrono::hours(1));
    EXPECT_EQ(looks(), 2);
}

TEST_F(reload_file, touched_is_read) {
    start();
    usleep(20000);
    ASSERT_EQ(utimensat(AT_FDCWD, path.c_str(), nullptr, 0), 0);
    EXPECT_EQ(looks(), 2);
}

// As Kubernetes does it: c.json -> ..data/c.json, ..data -> a folder; ..data is replaced.
TEST_F(reload_file, behind_a_link_to_a_folder_that_is_replaced_is_seen) {
    for (const char *version : {"v1", "v2"}) {
        fs::create_directories(folder / version);
        write(folder / version / "c.json", "first");
    }
    fs::create_directory_symlink("v1", folder / "data");
    fs::remove(path);
    fs::create_symlink("data/c.json", path);
    start();
    EXPECT_EQ(looks(), 9);
    fs::create_directory_symlink("v2", folder / "data.new");
    fs::rename(folder / "data.new", folder / "data");
    EXPECT_EQ(looks(), 2);
}

TEST_F(reload_file, that_is_away_did_not_change_and_another_in_its_place_did) {
    start();
    fs::remove(path);
    EXPECT_EQ(looks(), 9);
    write(path, "second");
    EXPECT_EQ(looks(), 2);
}

TEST_F(reload_file, that_was_not_there_at_the_start_is_read_when_it_comes) {
    fs::remove(path);
    start();
    EXPECT_EQ(looks(), 9);
    write(path, "first");
    EXPECT_EQ(looks(), 2);
}

// Where keys are enrolled, a signature may arrive after its file.
TEST_F(reload_file, whose_signature_changes_counts_as_changed_where_keys_are_enrolled) {
    for (const char *keys : {static_cast<const char *>(nullptr), folder.c_str()}) {
        site.keys = keys;
        fs::remove(path + ".minisig");
        start();
        EXPECT_EQ(looks(), 9);
        write(path + ".minisig", "arrives");
        EXPECT_EQ(looks(), keys == nullptr ? 9 : 2);
        start();
        write(path + ".minisig", "is replaced");
        EXPECT_EQ(looks(), keys == nullptr ? 9 : 2);
        start();
        fs::remove(path + ".minisig");
        EXPECT_EQ(looks(), keys == nullptr ? 9 : 2);
    }
}

// ---- what may be loaded ----

struct load_file : reload_file {
    bool load(const std::string &from) {
        return cb_load_file(&config, from.c_str(), &site, &loaded);
    }
    void refuses(const std::string &from, const std::string &why) {
        EXPECT_FALSE(load(from));
        EXPECT_EQ(std::string(loaded.message), from + ": cannot be read: " + why);
    }
    cb_config config;
    cb_loaded loaded;
};

const char *const no_file = "it is not a regular file; put the file itself there";

TEST_F(load_file, a_pipe_without_a_writer_is_refused_without_waiting) {
    const std::string pipe = (folder / "pipe").string();
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    refuses(pipe, no_file);
    fs::create_symlink(pipe, folder / "link");
    refuses((folder / "link").string(), no_file);
}

TEST_F(load_file, a_device_or_a_folder_is_refused) {
    refuses("/dev/zero", no_file);
    refuses(folder.string(), "Is a directory");
    refuses((folder / "none").string(), "No such file or directory");
}

TEST_F(load_file, names_channels_that_the_ceiling_lowers_as_far_as_there_is_room) {
    config = *compbox_test::load(compbox_test::full_example).config;
    char text[16];
    cb_lowered_names(&config, 0, text, sizeof text);
    EXPECT_STREQ(text, "");
    cb_lowered_names(&config, 0b101, text, sizeof text);
    EXPECT_STREQ(text, "Z, Y2");
    cb_lowered_names(&config, 0b111, text, 6);
    EXPECT_STREQ(text, "Z, Y1");
    cb_lowered_names(&config, 0b111, text, 5);
    EXPECT_STREQ(text, "Z, Y");
}

// ---- what may take over, and when ----

using change = std::vector<std::pair<std::string, std::string>>;

std::string changed(const change &edits) {
    std::string text = compbox_test::full_example;
    for (const auto &[from, to] : edits) {
        const auto at = text.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        text.replace(at, from.size(), to);
    }
    return text;
}

// A loop that does not run: its offers stay where they are.
struct reload_offer : reload_file {
    reload_offer() {
        cb_loop_init(loop.get());
        loop->box->config = *compbox_test::load(compbox_test::full_example).config;
        start();
    }
    cb_reload_outcome offer(const change &edits) {
        write(path, changed(edits));
        return ::cb_reload_offer(&reload, loop.get());
    }
    std::string last() const { return reload.last; }
    std::unique_ptr<cb_loop> loop = std::make_unique<cb_loop>();
};

TEST_F(reload_offer, of_new_curves_is_taken_at_once) {
    EXPECT_EQ(offer({{"10.5", "11.5"}}), CB_RELOAD_OFFERED);
    EXPECT_TRUE(reload.offered);
    EXPECT_FALSE(reload.pending);
    EXPECT_FALSE(loop->at_rest_only);
    EXPECT_FALSE(cb_reload_ready(&reload, loop.get())) << "the loop is about to take it";
}

TEST_F(reload_offer, of_an_older_revision_is_refused_unless_that_is_permitted) {
    const change older = {{"\"revision\": 7", "\"revision\": 6"}};
    EXPECT_EQ(offer(older), CB_RELOAD_REFUSED);
    EXPECT_EQ(last(), path +
                          ": revision 6 is older than the running one, 7; raise it, or start "
                          "compboxd with --allow-older");
    EXPECT_EQ(reload.refused, 1u);
    EXPECT_FALSE(reload.offered);
    reload.allow_older = true;
    EXPECT_EQ(offer(older), CB_RELOAD_OFFERED);
}

// It could be compared with nothing; a good file that the loop no longer takes is withdrawn.
TEST_F(reload_offer, to_a_configuration_that_changed_in_memory_is_refused) {
    EXPECT_EQ(offer({{"10.5", "11.5"}}), CB_RELOAD_OFFERED);
    loop->box->config_corrupt = true;
    EXPECT_TRUE(cb_reload_ready(&reload, loop.get()));
    EXPECT_EQ(offer({{"10.5", "12.5"}}), CB_RELOAD_REFUSED);
    EXPECT_EQ(last(), path +
                          ": is not taken, because the running configuration has changed in "
                          "memory; restart compboxd");
    EXPECT_TRUE(cb_loop_answered(loop.get())) << "nothing is offered";
    EXPECT_EQ(reload.refused, 1u);
}

TEST_F(reload_offer, of_the_same_revision_with_another_content_is_taken) {
    EXPECT_EQ(offer({{"10.5", "11.5"}}), CB_RELOAD_OFFERED);
}

TEST_F(reload_offer, of_a_larger_limit_is_pending_and_reported_once) {
    const change wider = {{"\"limit_um\": 300", "\"limit_um\": 350"},
                          {"\"revision\": 7", "\"revision\": 8"}};
    EXPECT_EQ(offer(wider), CB_RELOAD_PENDING);
    EXPECT_EQ(last(), path +
                          ": revision 8 is pending: channel Z: limit_um is 350, not 300; it is "
                          "taken with enable off and all outputs at zero; revision 7 "
                          "goes on");
    EXPECT_TRUE(loop->at_rest_only);
    EXPECT_TRUE(cb_reload_ready(&reload, loop.get()));
    EXPECT_EQ(offer(wider), CB_RELOAD_SAME);
    EXPECT_TRUE(cb_reload_ready(&reload, loop.get()));
    EXPECT_EQ(offer({{"\"limit_um\": 300", "\"limit_um\": 351"}}), CB_RELOAD_PENDING)
        << "a newer file is reported";
}

TEST_F(reload_offer, replaces_a_pending_one_also_by_a_file_that_is_refused) {
    EXPECT_EQ(offer({{"\"limit_um\": 300", "\"limit_um\": 350"}}), CB_RELOAD_PENDING);
    EXPECT_TRUE(cb_reload_ready(&reload, loop.get()));
    EXPECT_EQ(offer({{"\"limit_um\": 300", "\"limit_um\": -1"}}), CB_RELOAD_REFUSED);
    EXPECT_FALSE(reload.pending);
    EXPECT_TRUE(cb_loop_answered(loop.get())) << "nothing is left to take";
    EXPECT_TRUE(cb_reload_ready(&reload, loop.get()));
}

TEST_F(reload_offer, in_the_loops_hand_is_not_withdrawn) {
    EXPECT_EQ(offer({{"\"limit_um\": 300", "\"limit_um\": 350"}}), CB_RELOAD_PENDING);
    loop->offer = CB_LOOP_OFFER_IN_HAND;
    EXPECT_FALSE(cb_reload_ready(&reload, loop.get()));
    EXPECT_FALSE(cb_reload_taken(&reload, loop.get()));
    EXPECT_TRUE(reload.pending);
}

TEST_F(reload_offer, counts_limits_as_the_ceiling_leaves_them) {
    reload.site.ceiling = {300, 500};
    EXPECT_EQ(offer({{"\"limit_um\": 300", "\"limit_um\": 350"}}), CB_RELOAD_OFFERED);
    EXPECT_EQ(reload.loaded.lowered, 0b001u);
    EXPECT_EQ(cb_loop_spare(loop.get())->config.channels[0].limit_um, 300);
}

// One line for each difference that must wait; the word that the sentence has.
TEST_F(reload_offer, of_anything_that_lets_outputs_go_further_or_elsewhere_is_pending) {
    const std::vector<std::pair<change, std::string>> wider = {
        {{{"\"error_um\": 400", "\"error_um\": 401"}}, "channel Z: error_um is 401, not 400"},
        {{{"\"slew_um_per_s\": 50,", "\"slew_um_per_s\": 50.5,"}},
         "channel Y1: slew_um_per_s is 50.5, not 50"},
        {{{"\"sign\": -1", "\"sign\": 1"}}, "channel Z: sign differs"},
        {{{"\"scale\": 0.01,", "\"scale\": 0.02,"}}, "channel Z: scale differs"},
        {{{"\"plc\": 104, \"type\": \"int32\"", "\"plc\": 104, \"type\": \"float32\""}},
         "channel Z: type differs"},
        {{{"\"plc\": 104", "\"plc\": 110"}}, "channel Z: plc differs"},
        {{{"\"applied\": 24", "\"applied\": 26"}}, "channel Z: applied differs"},
        {{{", \"applied\": 24", ""}}, "channel Z: applied differs"},
        {{{"\"name\": \"Z\"", "\"name\": \"W\""}}, "channel W is new"},
        {{{"\"max_difference_um\": 50", "\"max_difference_um\": 51"}},
         "the pair of channels Y1 and Y2: max_difference_um is 51, not 50"},
        {{{"{\"channels\": [\"Y1\", \"Y2\"], \"max_difference_um\": 50}", ""}},
         "the pair of channels Y1 and Y2 is gone"},
        {{{"\"sign\": -1, ",
           "\"sign\": -1, \"tangent\": {\"signal\": \"X\", \"slope_plc\": 108, \"slope_type\": "
           "\"int32\", \"slope_scale\": 1e-8, \"slope_limit\": 2e-4, \"slope_slew_per_s\": 1e-3, "
           "\"reference_plc\": 110, \"reference_type\": \"int32\", \"reference_scale\": 0.001}, "}},
         "channel Z: tangent differs"}};
    for (const auto &[edits, word] : wider) {
        EXPECT_EQ(offer(edits), CB_RELOAD_PENDING) << word << ": " << last();
        EXPECT_NE(last().find(word), std::string::npos) << last();
        EXPECT_TRUE(cb_reload_ready(&reload, loop.get()));
    }
}

TEST_F(reload_offer, of_a_channel_that_goes_away_is_pending) {
    const std::string text = compbox_test::full_example;
    const auto from = text.find("{\"name\": \"Z\", \"sum\""), to = text.find("{\"name\": \"Y1\"");
    EXPECT_EQ(offer({{text.substr(from, to - from), ""}}), CB_RELOAD_PENDING) << last();
    EXPECT_NE(last().find("channel Z is gone"), std::string::npos) << last();
}

TEST_F(reload_offer, of_smaller_limits_and_a_closer_pair_is_taken_at_once) {
    EXPECT_EQ(offer({{"\"limit_um\": 300, \"error_um\": 400", "\"limit_um\": 30, \"error_um\": 30"},
                     {"\"slew_um_per_s\": 500", "\"slew_um_per_s\": 5"},
                     {"\"max_difference_um\": 50", "\"max_difference_um\": 20"}}),
              CB_RELOAD_OFFERED)
        << last();
}

// The connection and the ticks: one line for each key that a running box cannot change.
TEST_F(reload_offer, of_another_connection_or_period_takes_a_restart) {
    const std::string tcp = R"({"tcp": {"host": "127.0.0.1", "port": 1502, "unit": 1}})";
    const std::string serial =
        R"({"rtu": {"device": "/dev/ttyS0", "baud": 230400, "parity": "even", "stop_bits": 1}})";
    const auto refuses = [&](const change &edits, const std::string &key) {
        EXPECT_EQ(offer(edits), CB_RELOAD_REFUSED) << edits.back().second;
        EXPECT_EQ(last(),
                  path + ": " + key + " differs from the running file's, which takes a restart");
    };
    refuses({{tcp, serial}}, "plc.transport");
    refuses({{"127.0.0.1", "127.0.0.2"}}, "plc.transport");
    refuses({{"1502", "1503"}}, "plc.transport");
    refuses({{"\"unit\": 1}}", "\"unit\": 2}}"}}, "plc.transport");
    if (CB_HAS_LIBMODBUS)
        refuses({{"\"unit\": 1}}", "\"unit\": 1, \"client\": \"libmodbus\"}}"}}, "plc.transport");
    refuses({{"fc3+fc16", "fc23"}, {"sinumerik-840d", "generic"}}, "plc.exchange");
    refuses({{"\"count\": 32", "\"count\": 33"}}, "plc.read");
    refuses({{"{\"start\": 0, \"count\": 32}", "{\"start\": 1, \"count\": 32}"},
             {"\"control\": 0", "\"control\": 3"}},
            "plc.read");
    refuses({{"\"count\": 16", "\"count\": 17"}}, "plc.write");
    refuses({{"\"start\": 100, \"count\": 16", "\"start\": 99, \"count\": 16"}}, "plc.write");
    refuses({{"\"period_ms\": 30", "\"period_ms\": 40"}}, "cycle.period_ms");

    loop->box->config = *compbox_test::load(changed({{tcp, serial}})).config;
    EXPECT_EQ(offer({{tcp, serial}}), CB_RELOAD_OFFERED) << last();
    for (const auto &[piece, other] : change{{"ttyS0", "ttyS2"},
                                             {"230400", "460800"},
                                             {"even", "odd"},
                                             {"\"stop_bits\": 1", "\"stop_bits\": 2"},
                                             {"\"baud\"", "\"slave_delay_ms\": 5, \"baud\""},
                                             {"\"baud\"", "\"rs485\": true, \"baud\""}})
        refuses({{tcp, serial}, {piece, other}}, "plc.transport");
}

// Two motors are a pair in either order.
TEST_F(reload_offer, of_a_pair_the_other_way_round_is_taken_at_once) {
    EXPECT_EQ(offer({{"[\"Y1\", \"Y2\"]", "[\"Y2\", \"Y1\"]"}}), CB_RELOAD_OFFERED) << last();
}

// out: the sentence about the pair Y1 and Y2 of 50 µm, in a file with such a pair of 40 µm
std::string widened_by(unsigned a, unsigned b) {
    const auto now = std::make_unique<cb_config>();
    now->channels_count = 4;
    for (unsigned i = 0; i < 4; ++i) std::snprintf(now->channels[i].name, 4, "Y%u", i + 1);
    now->pairs_count = 1;
    now->pairs[0] = {0, 1, 50};
    const auto fresh = std::make_unique<cb_config>(*now);
    fresh->pairs[0].a = static_cast<uint8_t>(a);
    fresh->pairs[0].b = static_cast<uint8_t>(b);
    fresh->pairs[0].max_difference_um = 40;
    char text[200] = "";
    return cb_widening_find(now.get(), fresh.get(), text, sizeof text) ? text : "";
}

TEST(widening, a_pair_is_one_of_both_channels_in_either_order) {
    EXPECT_EQ(widened_by(0, 1), "");
    EXPECT_EQ(widened_by(1, 0), "");
    for (const auto &[a, b] :
         std::vector<std::pair<unsigned, unsigned>>{{0, 2}, {2, 0}, {1, 2}, {2, 1}, {2, 3}})
        EXPECT_EQ(widened_by(a, b), "the pair of channels Y1 and Y2 is gone") << a << b;
}

TEST_F(reload_offer, of_another_reference_of_a_tangent_is_pending) {
    const change tangent = {
        {"\"sign\": -1, ",
         "\"sign\": -1, \"tangent\": {\"signal\": \"X\", \"slope_plc\": 108, \"slope_type\": "
         "\"int32\", \"slope_scale\": 1e-8, \"slope_limit\": 2e-4, \"slope_slew_per_s\": 1e-3, "
         "\"reference_plc\": 110, \"reference_type\": \"int32\", \"reference_scale\": 0.001}, "},
        {"{\"name\": \"B\", \"unit\": \"deg\"", "{\"name\": \"B\", \"unit\": \"mm\""}};
    loop->box->config = *compbox_test::load(changed(tangent)).config;
    EXPECT_EQ(offer(tangent), CB_RELOAD_OFFERED) << last();
    loop->offer = CB_LOOP_OFFER_NONE;
    for (const auto &edit :
         change{{"\"reference_plc\": 110", "\"reference_plc\": 112"},
                {"\"reference_type\": \"int32\"", "\"reference_type\": \"float32\""},
                {"\"reference_scale\": 0.001", "\"reference_scale\": 0.01"},
                {"{\"signal\": \"X\", \"slope", "{\"signal\": \"B\", \"slope"}}) {
        change edits = tangent;
        edits.push_back(edit);
        EXPECT_EQ(offer(edits), CB_RELOAD_PENDING) << edit.second << ": " << last();
        EXPECT_NE(last().find("channel Z: tangent differs"), std::string::npos) << last();
        EXPECT_TRUE(cb_reload_ready(&reload, loop.get()));
    }
}

void *nothing(void *) {
    return nullptr;
}

TEST(realtime, a_processor_that_is_not_there_starts_no_thread) {
    pthread_t thread;
    const cb_schedule schedule = {0, CPU_SETSIZE - 1};
    EXPECT_EQ(cb_start_thread(&thread, &schedule, nothing, nullptr), EINVAL);
}

}  // namespace
