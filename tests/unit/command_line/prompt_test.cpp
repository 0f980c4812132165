// SPDX-License-Identifier: MIT
// Questions at a pipe, and numbers as people type them.
#include "host-tools/command_line/prompt.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <sstream>
#include <stdexcept>

#include "host-tools/command_line/screen.h"

namespace compbox::cli {
namespace {

// A prompt at a pipe into which wait() writes the next of these pieces; after the last it ends.
struct person_at_pipe {
    int ends[2] = {-1, -1};
    std::ostringstream out, err;
    cli::streams io() { return {ends[0], out, err}; }
    std::vector<std::string> pieces;
    std::size_t waits = 0;

    explicit person_at_pipe(std::vector<std::string> texts) : pieces(std::move(texts)) {
        EXPECT_EQ(::pipe(ends), 0);
    }
    ~person_at_pipe() {
        ::close(ends[0]);
        if (waits <= pieces.size()) ::close(ends[1]);
    }
    void wait() {
        if (waits < pieces.size()) {
            EXPECT_GT(::write(ends[1], pieces[waits].data(), pieces[waits].size()), 0);
        } else if (waits == pieces.size()) {
            ::close(ends[1]);
        }
        ++waits;
    }
};

TEST(prompt, work_goes_on_until_a_whole_line_is_there) {
    person_at_pipe person({"4 m", "m\n 19", ",8 \r\n7\n"});
    const auto io = person.io();
    cli::prompt prompt(io);
    EXPECT_FALSE(prompt.at_terminal());
    EXPECT_EQ(prompt.ask("X? ", [&] { person.wait(); }), "4 mm");
    EXPECT_EQ(prompt.ask("Y? ", [&] { person.wait(); }), "19,8");
    EXPECT_EQ(person.waits, 3u);
    EXPECT_EQ(prompt.ask("Z? "), "7") << "the answer was there already";
    EXPECT_EQ(person.err.str(), "X? \nY? \nZ? \n");
    EXPECT_EQ(prompt.ask("Z? ", [&] { person.wait(); }), std::nullopt) << "the input ends";
}

TEST(prompt, what_ends_the_work_begins_on_a_line_of_its_own) {
    person_at_pipe person({});
    const auto io = person.io();
    cli::prompt prompt(io);
    EXPECT_THROW(prompt.ask("X? ", [] { throw std::runtime_error("end"); }), std::runtime_error);
    EXPECT_EQ(person.err.str(), "X? \n");
}

TEST(prompt, a_number_has_a_point_or_a_comma) {
    for (const char *text : {"-19.8", " -19,8\r", "-19.8 "}) {
        const auto number = cli::number_in(text);
        ASSERT_TRUE(number) << text;
        EXPECT_EQ(number->value, -19.8) << text;
        EXPECT_EQ(number->decimals, 1) << text;
    }
    EXPECT_EQ(cli::number_in("+12")->value, 12.0);
    EXPECT_EQ(cli::number_in("+12")->decimals, 0);
    EXPECT_EQ(cli::number_in("0,0050")->decimals, 4);
}

TEST(prompt, what_is_no_number_is_none) {
    for (const char *text : {"", " ", "+", "-", ",", "++1", "+-1", "1.234,5", "1,2,3", "4 mm",
                             "nan", "inf", "1e3", "0x10", "1 2"}) {
        EXPECT_FALSE(cli::number_in(text)) << text;
    }
}

TEST(screen, counts_characters_not_bytes) {
    EXPECT_EQ(cli::clipped("Müller …", 3), "Mül");
    EXPECT_EQ(cli::clipped("µm", 5), "µm");
    EXPECT_EQ(cli::clipped("abc", 0), "");
    EXPECT_EQ(cli::padded("µm", 4), "µm  ");
    EXPECT_EQ(cli::padded("abcde", 4), "abcde");
}

TEST(screen, draws_in_its_place_on_a_terminal_alone) {
    std::ostringstream out, err;
    const cli::streams pipe{0, out, err, false}, terminal{0, out, err, true};
    cli::screen nowhere(pipe);
    nowhere.draw({"a"});
    nowhere.clear();
    EXPECT_EQ(err.str(), "");
    cli::screen screen(terminal);
    screen.draw({"a", "b"});
    EXPECT_EQ(err.str(), "a\033[K\nb\033[K\n");
    err.str("");
    screen.draw({"c", "d"});
    EXPECT_EQ(err.str(), "\0337\033[2A\rc\033[K\nd\033[K\n\0338");
    err.str("");
    screen.clear();
    EXPECT_EQ(err.str(), "\033[3A\r\033[J") << "the question's line too";
}

}  // namespace
}  // namespace compbox::cli
