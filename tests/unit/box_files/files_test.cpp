// SPDX-License-Identifier: MIT
// The files of compboxd as other programs read them: grown, renamed, emptied, torn, hostile.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host-tools/box_files/event_log.h"
#include "host-tools/box_files/snapshot.h"
#include "tests/support/temporary.h"

using namespace compbox;
using namespace compbox::box_files;

namespace {

// A path that no other test has.
std::string own_file() {
    return compbox_test::temporary(testing::UnitTest::GetInstance()->current_test_info()->name());
}

void append(const std::string &path, const std::string &text) {
    std::ofstream(path, std::ios::app) << text;
}

void replace(const std::string &path, const std::string &text) {
    std::ofstream(path + ".new") << text;
    std::filesystem::rename(path + ".new", path);
}

std::vector<std::string> read_all(followed_file &file) {
    std::vector<std::string> lines;
    file.poll(1u << 20, {nullptr, [&](std::string_view line) { lines.emplace_back(line); }});
    return lines;
}

using texts = std::vector<std::string>;

const char *const good =
    R"({"snapshot":1,"mode":"ACTIVE","reason":"all is well","signals":[],"terms":[],"channels":[]})";

}  // namespace

TEST(box_files_followed_file, lines_come_once_and_whole) {
    const auto path = own_file();
    followed_file file(path, 10);
    EXPECT_EQ(read_all(file), texts());
    append(path, "one\ntw");
    EXPECT_EQ(read_all(file), texts{"one"});
    EXPECT_EQ(read_all(file), texts());
    append(path, "o\nthree\n");
    EXPECT_EQ(read_all(file), (texts{"two", "three"}));
}

TEST(box_files_followed_file, a_line_that_is_too_long_is_left_out) {
    const auto path = own_file();
    followed_file file(path, 10);
    append(path, std::string(300000, 'x') + "\nshort\n" + std::string(11, 'y') + "\nlast\n");
    EXPECT_EQ(read_all(file), (texts{"short", "last"}));
}

TEST(box_files_followed_file, the_rest_of_a_renamed_file_comes_before_the_new_one) {
    const auto path = own_file();
    followed_file file(path, 10);
    append(path, "a\n");
    EXPECT_EQ(read_all(file), texts{"a"});
    append(path, "b\n");
    std::filesystem::rename(path, path + ".1");
    EXPECT_EQ(read_all(file), texts{"b"}) << "the new file is not there yet";
    append(path, "c\n");
    EXPECT_EQ(read_all(file), texts{"c"});
}

TEST(box_files_followed_file, a_file_that_was_emptied_begins_anew) {
    const auto path = own_file();
    followed_file file(path, 10);
    append(path, "first\nsecond\n");
    EXPECT_EQ(read_all(file).size(), 2u);
    std::ofstream(path) << "third\n";
    EXPECT_EQ(read_all(file), texts{"third"});
}

TEST(box_files_followed_file, a_folder_and_a_pipe_have_no_lines) {
    const auto path = own_file();
    ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
    followed_file pipe(path, 10), folder("/", 10);
    EXPECT_EQ(read_all(pipe), texts());
    EXPECT_EQ(read_all(folder), texts());
}

TEST(box_files_snapshot, a_new_file_is_read_once) {
    const auto path = own_file();
    replace(path, good);
    snapshot_file file(path);
    EXPECT_TRUE(file.poll());
    EXPECT_FALSE(file.poll());
    EXPECT_EQ(file.text(), good);
    EXPECT_EQ(file.why_not(unix_now_s()), "");
    replace(path, good);
    EXPECT_TRUE(file.poll());
}

TEST(box_files_snapshot, what_is_no_snapshot_is_no_box_and_says_why) {
    const auto path = own_file();
    snapshot_file file(path);
    EXPECT_FALSE(file.poll());
    EXPECT_NE(file.why_not(0).find("is compboxd running with --snapshot?"), std::string::npos);
    const std::string deep(100000, '[');
    const std::pair<std::string, const char *> faults[] = {
        {std::string(good).substr(0, 40), "is not valid JSON"},
        {"", "is not valid JSON"},
        {deep, "is not valid JSON"},
        {"[]", "is no JSON object"},
        {R"({"snapshot":2})", "has another version than 1"},
        {R"({"snapshot":1,"mode":3})", "lacks \"mode\""},
        {R"({"snapshot":1,"mode":"","reason":"","signals":[{}]})", "lacks the list \"signals\""},
        {R"({"snapshot":1,"mode":"","reason":"","signals":[{"name":1}]})", "\"signals\""},
        {R"({"snapshot":1,"mode":"","reason":"","signals":[],"terms":{}})", "\"terms\""},
        {std::string(good) + std::string(300000, ' '), "bytes, more than 262144"},
        {"{\"snapshot\":1,\"mode\":\"\xff\"}", "is not valid JSON"},
    };
    for (const auto &[text, fault] : faults) {
        replace(path, good);
        EXPECT_TRUE(file.poll());
        replace(path, text);
        EXPECT_FALSE(file.poll());
        EXPECT_NE(file.why_not(0).find(fault), std::string::npos) << file.why_not(0);
        const json live = json::parse(file.live_text(0));
        EXPECT_TRUE(live.at("snapshot").is_null() && live.at("stale") == true);
    }
    std::filesystem::remove(path);
    EXPECT_FALSE(file.poll());
    EXPECT_FALSE(file.age_s(0).has_value());
}

TEST(box_files_snapshot, an_old_file_and_an_ended_run_are_stale) {
    const auto path = own_file();
    replace(path, good);
    snapshot_file file(path);
    file.poll();
    const double now = unix_now_s();
    EXPECT_EQ(file.why_not(now + 2.0), "");
    EXPECT_NE(file.why_not(now + 60.0).find("60 s old"), std::string::npos);
    EXPECT_NEAR(*file.age_s(now + 60.0), 60.0, 1.0);
    EXPECT_EQ(*file.age_s(now - 60.0), 0.0) << "the clock went back";
    json ended = json::parse(good);
    ended["finished"] = true;
    replace(path, ended.dump());
    EXPECT_TRUE(file.poll());
    EXPECT_EQ(file.why_not(now), "compboxd has ended; this is its last snapshot");
}

TEST(box_files_events, the_newest_of_all_files_in_their_order) {
    const auto path = own_file();
    append(path + ".2", "{\"n\":1}\n{\"n\":2}\n");
    append(path + ".1", "{\"n\":3}\nno json\n[4]\n{\"n\":");
    append(path, "{\"n\":4}\n");
    event_log log(path);
    texts fresh;
    const auto take = [&fresh](const std::string &one) { fresh.push_back(one); };
    log.poll(take);
    EXPECT_EQ(fresh, texts()) << "what was there is no news";
    EXPECT_EQ(log.text(1000), R"([{"n":1},{"n":2},{"n":3},{"n":4}])");
    append(path, "{\"n\" : 5}\n");
    log.poll(take);
    EXPECT_EQ(fresh, texts{"{\"n\":5}"});
    EXPECT_EQ(log.text(2), R"([{"n":4},{"n":5}])");
}

TEST(box_files_events, their_number_is_limited) {
    const auto path = own_file();
    std::string lines;
    for (int i = 0; i < 3000; ++i) lines += "{\"n\":" + std::to_string(i) + "}\n";
    append(path, lines);
    event_log log(path);
    log.poll([](const std::string &) {});
    const json all = json::parse(log.text(100000));
    EXPECT_EQ(all.size(), event_log_lines);
    EXPECT_EQ(all.back().at("n"), 2999);
}
