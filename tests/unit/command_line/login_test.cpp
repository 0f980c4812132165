// SPDX-License-Identifier: MIT
#include "host-tools/command_line/login.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "host-tools/formats/error.h"
#include "tests/support/temporary.h"

using namespace compbox;
using namespace compbox::cli;

TEST(login, a_password_file_is_for_its_owner_and_group) {
    const auto path = compbox_test::temporary("password");
    const auto write = [&path](const std::string &text, mode_t mode) {
        std::ofstream(path) << text;
        ::chmod(path.c_str(), mode);
    };
    write("secret word\r\nnot this\n", 0640);
    EXPECT_EQ(read_password(path, 8), "secret word");
    for (const mode_t mode : {0644u, 0602u, 0601u}) {
        write("secret word\n", mode);
        EXPECT_THROW(read_password(path, 8), input_error) << mode;
    }
    for (const auto &text : {std::string("short\n"), std::string(200, 'x'), std::string()}) {
        write(text, 0600);
        EXPECT_THROW(read_password(path, 8), input_error) << text;
    }
    write("1\n", 0600);
    EXPECT_EQ(read_password(path, 1), "1");
    EXPECT_THROW(read_password(path + ".missing", 8), input_error);
}
