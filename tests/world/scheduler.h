// SPDX-License-Identifier: MIT
// Virtual time. Threads of the box are coroutines: one runs at a time, until it waits or time
// passes in it. Everything else in the world is an event at a time. Time jumps to whatever is due
// next. No clock, no thread and no address of the real system decides anything.
#pragma once

#include <boost/context/fiber.hpp>
#include <boost/context/pooled_fixedsize_stack.hpp>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace compbox::world {

using time_ns = std::int64_t;  // since the start of the world
constexpr time_ns us = 1000, ms = 1000000, second = 1000000000;
constexpr time_ns never = std::numeric_limits<time_ns>::max();

struct thread {
    int id = 0;  // from 1 on, never used again
    std::string name;
    int error_number = 0;      // errno
    std::uint64_t mask = 0;    // of blocked signals, bit N for signal N
    void *argument = nullptr;  // of the thread's function
    void *result = nullptr;    // … and its result
    bool finished = false;
    time_ns wake_ns = never;
    time_ns held_until = 0;  // not scheduled before; would have woken at wanted_ns
    time_ns wanted_ns = never;
    bool woken = false;              // by wake(), not by time
    bool waits_for_change = false;   // … of a descriptor or semaphore (computer::changed)
    bool stands_in_suspend = false;  // sleeps by a clock that does not count suspends
    boost::context::fiber fiber;
};

class scheduler {
  public:
    time_ns now() const { return now_; }

    // Calls `what` at a time, not before now. Events of one time come in the order of these calls.
    void at(time_ns when, std::function<void()> what);

    // ---- for threads of the box

    // Starts a thread, which is due now.
    thread &start(const std::string &name, std::function<void()> run);
    // out: the running thread; nullptr in an event
    thread *running() const { return running_; }
    const std::vector<std::unique_ptr<thread>> &threads() const { return threads_; }
    thread *find(int id) const;
    // Forgets a finished thread.
    void forget(int id);

    // In a thread: time passes, and whatever is due meanwhile happens first.
    void pass(time_ns duration) {
        if (now_ + duration < next_due_)
            now_ += duration;
        else
            give_way(now_ + duration);
    }
    // In a thread: sleeps until a time or wake(). out: whether wake() ended it
    bool wait(time_ns until);
    void wake(thread &sleeper);
    // In an event: a thread is not scheduled until a time, whatever it waits for; release() ends
    // it.
    void hold(thread &one, time_ns until);
    void release(thread &one);
    // In a thread: never returns. The scheduler drops all threads, then calls `dropped`.
    [[noreturn]] void end_all_here();

    // In an event: unwinds the stacks of all threads.
    void drop_threads();
    std::function<void()> dropped;

    // Moves the time of each sleeping thread.
    void shift_sleepers(const std::function<time_ns(const thread &)> &moved);

    // Runs until stop() or until nothing is due any more.
    void run();
    void stop() { stopping_ = true; }

  private:
    struct event {
        time_ns when;
        std::uint64_t order;
        std::function<void()> what;
    };
    static bool later(const event &a, const event &b) {
        return a.when != b.when ? a.when > b.when : a.order > b.order;
    }
    void give_way(time_ns until);
    void yield();
    void switch_to(thread &next);
    thread *first_due() const;
    void look_ahead();
    void run_event();

    time_ns now_ = 0;
    time_ns next_due_ = 0;       // of anything but the running thread
    std::vector<event> events_;  // a heap
    std::uint64_t events_made_ = 0;
    std::vector<std::unique_ptr<thread>> threads_;
    int threads_made_ = 0;
    thread *running_ = nullptr;
    boost::context::fiber main_;
    boost::context::pooled_fixedsize_stack stacks_{stack_bytes};
    bool stopping_ = false, ending_ = false;
    static constexpr std::size_t stack_bytes = 1024 * 1024;
};

}  // namespace compbox::world
