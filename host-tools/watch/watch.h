// SPDX-License-Identifier: MIT
// compbox watch: the box's snapshot on a terminal, drawn again until a signal ends it.
#pragma once

#include <string>

#include "host-tools/command_line/command_line.h"

namespace compbox::watch {

struct watched_files {
    std::string snapshot, events;  // events "": none
};

// Prints one screen of any length without colours.
// out: why no box runs, as a sentence; "": it runs
std::string print_once(const watched_files &files, const cli::streams &io);

// Draws on the terminal of io.out until SIGINT, SIGTERM or the end of the terminal, and leaves it
// as it was. in : whether it has colours
void draw_until_signal(const watched_files &files, bool coloured, const cli::streams &io);

// out: whether standard output is a terminal that can move its cursor
bool can_draw();

}  // namespace compbox::watch
