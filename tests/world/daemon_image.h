// SPDX-License-Identifier: MIT
// The daemon's objects in this program, with renamed calls (CMakeLists.txt): its main, and its
// variables, which each start finds as the linker made them.
#pragma once

namespace compbox::world {

// Puts all variables of the daemon back to their first values.
void reset_daemon_image();

}  // namespace compbox::world

extern "C" int compboxd_main(int argc, char **argv);
