// SPDX-License-Identifier: MIT
// The daemon's objects in this program, with renamed calls (CMakeLists.txt): its main, and its
// variables, which each start finds as the linker made them.
#pragma once

#include <array>
#include <utility>

namespace compbox::world {

// out: begin and end of the variables with first values, and of those that begin as 0
std::array<std::pair<char *, char *>, 2> daemon_variables();

// Puts all variables of the daemon back to their first values.
void reset_daemon_image();

}  // namespace compbox::world

extern "C" int compboxd_main(int argc, char **argv);
