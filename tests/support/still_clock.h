// SPDX-License-Identifier: MIT
// A clock that stands while any thread of a test runs. It goes on, to the earliest time that one
// waits for, when all wait and nothing is under way: how fast the machine is decides nothing.
// hal/linux/still_clock_test.cpp defines the calls of libc that read it.
#pragma once

#include <linux/sockios.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <ctime>
#include <limits>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

namespace still_clock {

constexpr int64_t never_ns = std::numeric_limits<int64_t>::max();
constexpr int64_t call_ns = 1000;  // what a look at the clock takes

struct waiter {
    int fd;  // -1: none
    short events;
    int64_t until_ns;
};

struct state {
    std::mutex mutex;
    int64_t now_ns = 0;
    int members = 0;  // threads that the clock waits for
    std::vector<const waiter *> waiters;
    std::set<int> sockets;  // which may have sent what has not arrived
    int64_t asleep_ns = 0;  // see suspend_ms
};
inline state all;
inline std::atomic<bool> is_on{false};

inline void real_pause() {
    timespec pause = {0, 100000};
    syscall(SYS_clock_nanosleep, CLOCK_MONOTONIC, 0, &pause, nullptr);
}

inline bool is_ready(int fd, short events) {
    pollfd look{fd, events, 0};
    return fd >= 0 && poll(&look, 1, 0) > 0;
}

inline bool is_under_way(int socket) {
    int bytes = 0;
    return ioctl(socket, SIOCOUTQ, &bytes) == 0 && bytes > 0 && !is_ready(socket, 0);
}

// in : all.mutex is held. out: when the clock may go to; never_ns: a thread runs, or is about to
inline int64_t next_ns() {
    if (all.waiters.size() < static_cast<size_t>(all.members)) return never_ns;
    int64_t next = never_ns;
    for (const waiter *one : all.waiters) {
        if (one->until_ns <= all.now_ns || is_ready(one->fd, one->events)) return never_ns;
        next = std::min(next, one->until_ns);
    }
    if (std::any_of(all.sockets.begin(), all.sockets.end(), is_under_way)) return never_ns;
    return next;
}

// Waits for the descriptor, or for a time of the clock.
inline void wait(int fd, short events, int64_t until_ns) {
    const waiter self{fd, events, until_ns};
    std::unique_lock<std::mutex> lock(all.mutex);
    all.waiters.push_back(&self);
    while (!is_ready(fd, events) && all.now_ns < until_ns) {
        const int64_t next = next_ns();
        if (next != never_ns) {
            all.now_ns = next;
            continue;
        }
        lock.unlock();
        real_pause();
        lock.lock();
    }
    if (fd >= 0) all.now_ns += std::exchange(all.asleep_ns, 0);
    all.waiters.erase(std::find(all.waiters.begin(), all.waiters.end(), &self));
}

inline int64_t read_ns() {
    const std::lock_guard<std::mutex> lock(all.mutex);
    return all.now_ns += call_ns;
}

// ---- for the threads of a test; without a clock these do what their names say, in real time

inline void sleep_ms(int ms) {
    timespec pause = {ms / 1000, ms % 1000 * 1000000L};
    if (is_on)
        wait(-1, 0, read_ns() + int64_t{ms} * 1000000);
    else
        nanosleep(&pause, nullptr);
}

// The computer is suspended while the next thread waits for a descriptor, and that much later it
// goes on.
inline void suspend_ms(int ms) {
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.asleep_ns = int64_t{ms} * 1000000;
}

// Returns at once without a clock: the call that follows waits.
inline void wait_readable(int fd) {
    if (is_on) wait(fd, POLLIN, never_ns);
}

// A thread that the clock waits for is counted before it starts, and until it ends.
inline void join() {
    const std::lock_guard<std::mutex> lock(all.mutex);
    ++all.members;
}
inline void leave() {
    const std::lock_guard<std::mutex> lock(all.mutex);
    --all.members;
}

inline void watch(int socket) {
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.sockets.insert(socket);
}
inline void unwatch(int socket) {
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.sockets.erase(socket);
}

// The clock of one test, whose thread is its first member.
class clock {
  public:
    clock() {
        all.now_ns = 1000000000000;
        all.members = 1;
        all.sockets.clear();
        is_on = true;
    }
    ~clock() { is_on = false; }
    clock(const clock &) = delete;
};

}  // namespace still_clock
