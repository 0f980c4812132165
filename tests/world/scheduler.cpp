// SPDX-License-Identifier: MIT
#include "tests/world/scheduler.h"

#include <algorithm>
#include <utility>

namespace compbox::world {

void scheduler::at(time_ns when, std::function<void()> what) {
    when = std::max(when, now_);
    events_.push_back({when, events_made_++, std::move(what)});
    std::push_heap(events_.begin(), events_.end(), later);
    next_due_ = std::min(next_due_, when);
}

thread &scheduler::start(const std::string &name, std::function<void()> run) {
    auto made = std::make_unique<thread>();
    thread &fresh = *made;
    fresh.id = ++threads_made_;
    fresh.name = name;
    fresh.wake_ns = now_;
    fresh.fiber = boost::context::fiber(std::allocator_arg, stacks_,
                                        [this, &fresh, run = std::move(run)](auto &&main) {
                                            main_ = std::move(main);
                                            run();
                                            fresh.finished = true;
                                            fresh.wake_ns = never;
                                            return std::move(main_);
                                        });
    threads_.push_back(std::move(made));
    next_due_ = now_;
    return fresh;
}

thread *scheduler::find(int id) const {
    for (const auto &one : threads_) {
        if (one->id == id) return one.get();
    }
    return nullptr;
}

void scheduler::forget(int id) {
    threads_.erase(std::remove_if(threads_.begin(), threads_.end(),
                                  [id](const auto &one) { return one->id == id; }),
                   threads_.end());
}

bool scheduler::wait(time_ns until) {
    running_->woken = false;
    give_way(std::max(until, now_));
    return running_->woken;
}

void scheduler::wake(thread &sleeper) {
    sleeper.woken = true;
    sleeper.wanted_ns = std::min(sleeper.wanted_ns, now_);
    sleeper.wake_ns = std::min(sleeper.wake_ns, std::max(now_, sleeper.held_until));
    next_due_ = now_;
}

void scheduler::hold(thread &one, time_ns until) {
    if (one.held_until <= now_) one.wanted_ns = one.wake_ns;
    one.held_until = std::max(one.held_until, until);
    if (one.wake_ns != never) one.wake_ns = std::max(one.wake_ns, one.held_until);
}

void scheduler::release(thread &one) {
    if (one.held_until <= now_) return;
    one.held_until = now_;
    if (one.wake_ns != never) one.wake_ns = std::max(now_, one.wanted_ns);
    next_due_ = now_;
}

void scheduler::give_way(time_ns until) {
    running_->wake_ns = until;
    yield();
}

void scheduler::yield() {
    main_ = std::move(main_).resume();
}

void scheduler::end_all_here() {
    running_->wake_ns = never;
    ending_ = true;
    for (;;) yield();
}

void scheduler::drop_threads() {
    for (auto &one : threads_) {
        running_ = one.get();
        one->fiber = {};
    }
    running_ = nullptr;
    threads_.clear();
}

void scheduler::shift_sleepers(const std::function<time_ns(const thread &)> &moved) {
    for (auto &one : threads_) one->wake_ns = moved(*one);
}

void scheduler::switch_to(thread &next) {
    now_ = std::max(now_, next.wake_ns);
    next.wake_ns = never;
    running_ = &next;
    look_ahead();
    next.fiber = std::move(next.fiber).resume();
    running_ = nullptr;
}

// out: the thread that is due next; of one time the one that was started first; nullptr: none
thread *scheduler::first_due() const {
    thread *first = nullptr;
    for (const auto &one : threads_) {
        if (one->wake_ns != never && (first == nullptr || one->wake_ns < first->wake_ns))
            first = one.get();
    }
    return first;
}

void scheduler::look_ahead() {
    const thread *next = first_due();
    next_due_ = next == nullptr ? never : next->wake_ns;
    if (!events_.empty()) next_due_ = std::min(next_due_, events_.front().when);
}

void scheduler::run_event() {
    std::pop_heap(events_.begin(), events_.end(), later);
    event next = std::move(events_.back());
    events_.pop_back();
    now_ = std::max(now_, next.when);
    next.what();
}

void scheduler::run() {
    stopping_ = false;
    while (!stopping_) {
        thread *next = first_due();
        const bool has_event = !events_.empty();
        if (next == nullptr && !has_event) return;
        if (next == nullptr || (has_event && events_.front().when <= next->wake_ns))
            run_event();
        else
            switch_to(*next);
        if (!ending_) continue;
        ending_ = false;
        drop_threads();
        dropped();
    }
}

}  // namespace compbox::world
