// SPDX-License-Identifier: MIT
#include "host-tools/view/access.h"

#include <gtest/gtest.h>

using namespace compbox;
using namespace compbox::view;

TEST(view_access, an_address_is_a_numeric_host_and_a_port) {
    for (const char *text : {"127.0.0.1:8090", "[::1]:0", "localhost:65535", "0.0.0.0:1"}) {
        EXPECT_TRUE(listen_address::parse(text)) << text;
    }
    for (const char *text : {"", "8090", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", ":8090",
                             "::1:80", "[::1]", "[::1]80", "[::1:80", "example.com:80", "1.2.3:4",
                             "127.0.0.1:-1", "127.0.0.1:80x", "[127.0.0.1]:80"}) {
        EXPECT_FALSE(listen_address::parse(text)) << text;
    }
    EXPECT_TRUE(listen_address::parse("127.9.9.9:1")->is_loopback());
    EXPECT_TRUE(listen_address::parse("[::1]:1")->is_loopback());
    EXPECT_FALSE(listen_address::parse("0.0.0.0:1")->is_loopback());
    EXPECT_FALSE(listen_address::parse("[::]:1")->is_loopback());
}

TEST(view_access, on_loopback_the_host_is_this_computer) {
    const access_rule rule({"127.0.0.1", 8090}, std::nullopt);
    for (const char *host : {"127.0.0.1", "127.0.0.1:8090", "localhost:1", "[::1]:8090", "[::1]"}) {
        EXPECT_TRUE(rule.accepts_host(host)) << host;
    }
    for (const char *host : {"", "evil.example", "127.0.0.1.evil.example", "localhost.evil:80",
                             "127.0.0.1:80x", "[::1", "127.0.0.1:80:80", "[::1]evil"}) {
        EXPECT_FALSE(rule.accepts_host(host)) << host;
    }
    EXPECT_FALSE(rule.accepts_host(std::nullopt));
    EXPECT_TRUE(access_rule({"0.0.0.0", 1}, "12345678").accepts_host("box.plant"));
}

TEST(view_access, a_login_needs_user_and_password) {
    const access_rule rule({"0.0.0.0", 8090}, "correct horse");
    EXPECT_TRUE(rule.needs_login());
    EXPECT_TRUE(rule.accepts_login("compbox", "correct horse"));
    for (const char *password : {"", "correct hors", "correct horse ", "Correct horse", "c"}) {
        EXPECT_FALSE(rule.accepts_login("compbox", password)) << password;
    }
    EXPECT_FALSE(rule.accepts_login("admin", "correct horse"));
    EXPECT_FALSE(access_rule({"127.0.0.1", 1}, std::nullopt).needs_login());
}

TEST(view_access, equal_texts_are_equal_in_length_too) {
    EXPECT_TRUE(equal_in_constant_time("", ""));
    EXPECT_TRUE(equal_in_constant_time("abab", "abab"));
    EXPECT_FALSE(equal_in_constant_time("abab", "ab"));
    EXPECT_FALSE(equal_in_constant_time("ab", "abab"));
    EXPECT_FALSE(equal_in_constant_time("a", ""));
}
