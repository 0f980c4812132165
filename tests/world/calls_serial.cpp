// SPDX-License-Identifier: MIT
// Serial lines. The settings of a line are those of its file: control() gets them by TCGETS, TCSETS
// and TCFLSH, with a termios of libc.
#include <sys/ioctl.h>
#include <termios.h>

#include "tests/world/calls.h"

namespace {

using namespace compbox::world;

int control(int fd, const char *name, unsigned long request, void *argument) {
    call_fate fate;
    open_file *const file = begin_on(fd, name, &fate);
    return file == nullptr ? -1 : returned(file->control(request, argument));
}

}  // namespace

extern "C" {

int world_tcgetattr(int fd, termios *to) {
    return control(fd, "tcgetattr", TCGETS, to);
}
int world_tcsetattr(int fd, int, const termios *from) {
    return control(fd, "tcsetattr", TCSETS, const_cast<termios *>(from));
}
int world_tcflush(int fd, int) {
    return control(fd, "tcflush", TCFLSH, nullptr);
}
void world_cfmakeraw(termios *of) {
    cfmakeraw(of);
}
int world_cfsetispeed(termios *of, speed_t speed) {
    return cfsetispeed(of, speed);
}
int world_cfsetospeed(termios *of, speed_t speed) {
    return cfsetospeed(of, speed);
}
}
