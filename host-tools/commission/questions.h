// SPDX-License-Identifier: MIT
// The questions of commissioning: to a person at a terminal, with or without the live table, or to
// a script that answers through a pipe. The cycle of the box goes on meanwhile.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "host-tools/command_line/prompt.h"
#include "host-tools/command_line/screen.h"
#include "host-tools/commission/positions.h"

namespace compbox::commission {

class questions {
  public:
    // in : watch: the live table is shown, on a terminal redrawn in its place
    questions(const cli::streams &io, bool watch)
        : io_(io), prompt_(io), screen_(io), watch_(watch) {}

    // Calls wait() until a line is complete. Throws input_error at the end of the input, with the
    // option that would answer.
    std::string line(const std::string &question, const std::string &option,
                     const std::function<void()> &wait);

    // Repeats the question until the answer is a number of µm.
    double micrometres(const std::string &question, const std::string &option,
                       const std::function<void()> &wait);

    // Reports a fault, for another answer. Throws it as input_error where no person is at a
    // terminal.
    void again(const std::string &fault);

    // in : all outlive the result; say prints a line of the result
    // out: steps of the box with the questions of check_positions
    dialog about_positions(live_box &live, register_map &map,
                           const std::function<void(const std::string &)> &say);

  private:
    void step(live_box &live, register_map &map);
    void begin_table(const live_box &live, const register_map &map);
    void go_on_with_table(const live_box &live, const register_map &map);
    std::string question_of(const map_row &row) const;
    std::optional<shown_value> ask(live_box &live, register_map &map, const map_row &row,
                                   const std::string &task);

    const cli::streams &io_;
    cli::prompt prompt_;
    cli::screen screen_;
    bool watch_;
    const map_row *current_ = nullptr;  // the row of the pending question
    std::string task_;                  // before its comparison
    std::vector<double> printed_;       // positions as last printed, without a terminal
    std::uint32_t cycles_ = 0;          // since the table was drawn
};

}  // namespace compbox::commission
