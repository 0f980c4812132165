// SPDX-License-Identifier: MIT
#include "host-tools/view/feed.h"

#include <gtest/gtest.h>

#include "host-tools/view/page.h"

using namespace compbox::view;

namespace {

// Reads all that there is, in pieces of so many bytes.
std::string read_all(const feed &from, feed::reader &who, std::size_t size = 7) {
    std::string text, piece(size, '\0');
    while (const std::size_t got = from.read(who, piece.data(), size)) text.append(piece, 0, got);
    return text;
}

}  // namespace

TEST(view_feed, a_reader_gets_the_newest_text_and_later_events) {
    feed all;
    all.add_event("0");
    all.set_live("1");
    auto who = all.begin();
    EXPECT_EQ(read_all(all, who), "retry: 2000\n\nevent: live\ndata: 1\n\n");
    EXPECT_EQ(read_all(all, who), "");
    all.add_event("2");
    all.add_event("3");
    all.set_live("4");
    EXPECT_EQ(read_all(all, who),
              "event: event\ndata: 2\n\nevent: event\ndata: 3\n\nevent: live\ndata: 4\n\n");
    all.beat();
    EXPECT_EQ(read_all(all, who), ":\n\n");
    all.beat();
    all.set_live("5");
    EXPECT_EQ(read_all(all, who), "event: live\ndata: 5\n\n") << "no silence to fill";
}

TEST(view_feed, a_slow_reader_ends_its_message_and_skips_to_the_newest) {
    feed all;
    all.set_live("first");
    auto who = all.begin();
    char bytes[20];
    EXPECT_EQ(all.read(who, bytes, 13), 13u);
    EXPECT_EQ(all.read(who, bytes, 7), 7u);
    for (int i = 0; i < 1000; ++i) all.set_live(std::to_string(i));
    EXPECT_EQ(read_all(all, who), "live\ndata: first\n\nevent: live\ndata: 999\n\n");
}

TEST(view_feed, of_many_events_a_slow_reader_gets_the_newest) {
    feed all;
    auto who = all.begin();
    for (int i = 0; i < 1000; ++i) all.add_event(std::to_string(i));
    const std::string text = read_all(all, who);
    EXPECT_EQ(text.find("data: 900\n"), std::string("retry: 2000\n\nevent: event\n").size());
    EXPECT_NE(text.find("data: 999\n"), std::string::npos);
}

TEST(view_feed, what_was_read_is_forgotten) {
    feed all;
    auto who = all.begin();
    read_all(all, who);
    EXPECT_EQ(who.part, nullptr);
}

TEST(view_bodies, their_bytes_are_limited_and_given_back) {
    body_store store(1000);
    body one = store.keep(std::string(900, 'x'));
    ASSERT_NE(one, nullptr);
    EXPECT_EQ(store.keep(std::string(200, 'y')), nullptr);
    one.reset();
    EXPECT_EQ(store.held_bytes(), 0u);
    EXPECT_NE(store.keep(std::string(200, 'y')), nullptr);
}

TEST(view_page, each_file_is_found_by_its_name) {
    ASSERT_NE(find_page("/"), nullptr);
    EXPECT_EQ(find_page("/"), find_page("/index.html"));
    EXPECT_EQ(find_page("/")->type, "text/html; charset=utf-8");
    EXPECT_EQ(find_page("/")->content.substr(0, 15), "<!DOCTYPE html>");
    for (unsigned i = 0; i < page_files_count; ++i) {
        EXPECT_EQ(find_page("/" + std::string(page_files[i].name)), &page_files[i]);
    }
    for (const char *path : {"", "index.html", "//", "/../page.h", "/index.htm", "/zzz"}) {
        EXPECT_EQ(find_page(path), nullptr) << path;
    }
}
