// SPDX-License-Identifier: MIT
// The calls of libc that read the clock of tests/support/still_clock.h, in place of the C
// library's.
#include "tests/support/still_clock.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <thread>

extern "C" {
#include "hal/linux/clock.h"
}

namespace {

template <typename... Arguments>
int of_kernel(long number, Arguments... arguments) {
    return static_cast<int>(syscall(number, arguments...));
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec *now) noexcept {
    const bool still = clock == CLOCK_MONOTONIC || clock == CLOCK_BOOTTIME;
    if (!still_clock::is_on || !still) return of_kernel(SYS_clock_gettime, clock, now);
    *now = cb_timespec(still_clock::read_ns());
    return 0;
}

extern "C" int ppoll(pollfd *look, nfds_t count, const timespec *left, const sigset_t *mask) {
    timespec rest = left ? *left : timespec{};
    if (!still_clock::is_on || left == nullptr || count != 1)
        return of_kernel(SYS_ppoll, look, count, left ? &rest : nullptr, mask, size_t{8});
    const int64_t left_ns = int64_t{left->tv_sec} * 1000000000 + left->tv_nsec;
    still_clock::wait(look->fd, look->events, still_clock::read_ns() + left_ns);
    return poll(look, count, 0);
}

// The kernel connects or refuses before time goes on.
extern "C" int connect(int fd, const sockaddr *address, socklen_t size) {
    const int result = of_kernel(SYS_connect, fd, address, size);
    if (!still_clock::is_on || result == 0 || errno != EINPROGRESS) return result;
    still_clock::watch(fd);
    pollfd look{fd, POLLOUT, 0};
    poll(&look, 1, 60000);
    errno = EINPROGRESS;
    return -1;
}

namespace {

TEST(still_clock, passes_only_while_all_threads_wait) {
    still_clock::clock clock;
    const int64_t start_us = cb_boottime_us();
    std::atomic<int64_t> woke_us{0};
    still_clock::join();
    std::thread other([&] {
        still_clock::sleep_ms(50);
        woke_us = cb_boottime_us();
        still_clock::leave();
    });
    for (int i = 0; i < 50; ++i) still_clock::real_pause();
    EXPECT_EQ(woke_us, 0) << "this thread runs";
    EXPECT_LT(cb_boottime_us() - start_us, 100);
    still_clock::sleep_ms(80);
    EXPECT_GE(woke_us, start_us + 50000);
    EXPECT_LT(woke_us, start_us + 50100);
    EXPECT_GE(cb_boottime_us() - start_us, 80000);
    EXPECT_LT(cb_boottime_us() - start_us, 80100);
    other.join();
}

TEST(still_clock, does_not_pass_before_what_was_sent_is_read) {
    still_clock::clock clock;
    const int64_t start_us = cb_boottime_us();
    int ends[2];
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    still_clock::join();
    std::thread other([&] {
        for (int i = 0; i < 5; ++i) still_clock::real_pause();
        EXPECT_EQ(write(ends[1], "x", 1), 1);
        still_clock::leave();
    });
    pollfd look{ends[0], POLLIN, 0};
    const timespec hour = {3600, 0};
    EXPECT_EQ(ppoll(&look, 1, &hour, nullptr), 1);
    EXPECT_LT(cb_boottime_us() - start_us, 100);
    other.join();
    for (const int fd : ends) close(fd);
}

}  // namespace
