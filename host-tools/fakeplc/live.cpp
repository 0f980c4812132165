// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/live.h"

#include <algorithm>

namespace compbox::fakeplc {

namespace {

volatile sig_atomic_t came = 0;

void note(int) {
    came = 1;
}

}  // namespace

std::int64_t now_us() {
    timespec now;
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1000000 + now.tv_nsec / 1000;
}

timespec time_until(std::int64_t due_us) {
    const std::int64_t left_us = std::clamp<std::int64_t>(due_us - now_us(), 0, 1000000);
    return {static_cast<time_t>(left_us / 1000000), static_cast<long>(left_us % 1000000) * 1000};
}

sigset_t mind_signals() {
    struct sigaction action = {};
    action.sa_handler = note;
    ::sigaction(SIGTERM, &action, nullptr);
    ::sigaction(SIGINT, &action, nullptr);
    ::signal(SIGPIPE, SIG_IGN);
    ::signal(SIGXFSZ, SIG_IGN);
    ::signal(SIGTTIN, SIG_IGN);
    sigset_t blocked, before;
    ::sigemptyset(&blocked);
    ::sigaddset(&blocked, SIGTERM);
    ::sigaddset(&blocked, SIGINT);
    ::sigprocmask(SIG_BLOCK, &blocked, &before);
    ::sigdelset(&before, SIGTERM);
    ::sigdelset(&before, SIGINT);
    return before;
}

bool stop_requested() {
    return came != 0;
}

}  // namespace compbox::fakeplc
