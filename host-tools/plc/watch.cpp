// SPDX-License-Identifier: MIT
#include "host-tools/plc/watch.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <ctime>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <thread>

namespace compbox::plc {

namespace {

using clock = std::chrono::system_clock;

volatile std::sig_atomic_t interrupted = 0;

void mind_signals() {
    struct sigaction action = {};
    action.sa_handler = [](int) { interrupted = 1; };
    interrupted = 0;
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
    ::signal(SIGPIPE, SIG_IGN);
}

// "14:03:59.250", local time
std::string time_text(clock::time_point at) {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(at.time_since_epoch());
    const std::time_t seconds = clock::to_time_t(at);
    std::tm local = {};
    char text[16];
    ::localtime_r(&seconds, &local);
    std::strftime(text, sizeof text, "%H:%M:%S", &local);
    return fmt::format("{}.{:03}", text, ms.count() % 1000);
}

double unix_s(clock::time_point at) {
    return std::chrono::duration<double>(at.time_since_epoch()).count();
}

// Sleeps in pieces, so that a signal ends it.
void sleep_until(std::chrono::steady_clock::time_point until) {
    while (!interrupted && std::chrono::steady_clock::now() < until) {
        const auto left = until - std::chrono::steady_clock::now();
        std::this_thread::sleep_for(
            std::min<std::chrono::nanoseconds>(left, std::chrono::milliseconds(50)));
    }
}

class watcher {
  public:
    watcher(const wire &to, const std::vector<item> &items, const watch_options &options,
            std::ostream &out, std::ostream &err)
        : to_(to), items_(items), options_(options), out_(out), err_(err) {}

    // One reading. out: whether it succeeded. Throws input_error if there was none before.
    bool look() {
        try {
            if (!client_) client_.emplace(to_);
            const words_at now = read_items(*client_, items_);
            if (lost_) err_ << time_text(clock::now()) << " replies again" << std::endl;
            lost_ = false;
            print_changes(now);
            words_ = now;
            return true;
        } catch (const input_error &error) {
            if (words_.empty()) throw;
            client_.reset();
            if (!lost_ && !interrupted)
                err_ << time_text(clock::now()) << " " << error.what() << std::endl;
            lost_ = true;
            return false;
        }
    }

  private:
    void print_changes(const words_at &now) {
        const auto at = clock::now();
        for (const auto &one : items_) {
            if (!words_.empty() && words_of(one, words_) == words_of(one, now)) continue;
            if (options_.as_json) {
                json line = {{"unix_s", unix_s(at)}};
                line.update(item_figures(one, now));
                out_ << line.dump() << std::endl;
            } else {
                out_ << fmt::format("{}  {:<24} {:>16}  {}", time_text(at), one.place(),
                                    value_text(one, now), raw_text(one, now))
                     << std::endl;
            }
        }
    }

    const wire to_;
    const std::vector<item> items_;
    const watch_options options_;
    std::ostream &out_, &err_;
    std::optional<client> client_;
    words_at words_;  // of the last reading
    bool lost_ = false;
};

}  // namespace

void print_items(std::ostream &out, const std::vector<item> &items, const words_at &words) {
    std::size_t longest = 0;
    for (const auto &one : items) longest = std::max(longest, one.name.size());
    for (const auto &one : items) {
        out << fmt::format("{:>5}  {:<{}}{:>16}  {}\n", one.address, one.name, longest,
                           value_text(one, words), raw_text(one, words));
    }
}

bool watch(const wire &to, const std::vector<item> &items, const watch_options &options,
           std::ostream &out, std::ostream &err) {
    mind_signals();
    watcher one(to, items, options, out, err);
    const auto start = std::chrono::steady_clock::now();
    bool good = false;
    for (int done = 0; !interrupted && (options.count == 0 || done < options.count); ++done) {
        sleep_until(start + done * std::chrono::milliseconds(options.every_ms));
        if (!interrupted) good = one.look();
    }
    return good || interrupted;
}

}  // namespace compbox::plc
