// SPDX-License-Identifier: MIT
#include "tests/world/isolated.h"

#include <fmt/core.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "host-tools/formats/json_type.h"

// Of the compiler where conditions are counted (scripts/report mcdc); _exit() leaves it out.
extern "C" int __llvm_profile_write_file() __attribute__((weak));

namespace compbox::world {

namespace {

constexpr long look_every_s = 2;  // of the processor's time
const scheduler *watched = nullptr;
time_ns seen_ns = -1;

// Virtual time did not go on since the last look.
void look(int) {
    if (watched->now() == seen_ns) ::_exit(SIGXCPU);
    seen_ns = watched->now();
}

void watch(const scheduler &time) {
    watched = &time;
    ::signal(SIGPROF, look);
    const itimerval every = {{look_every_s, 0}, {look_every_s, 0}};
    ::setitimer(ITIMER_PROF, &every, nullptr);
}

std::string text_of_result(const run_result &result) {
    json text = {{"cycles", result.cycles},
                 {"hash", result.hash},
                 {"faults", result.faults},
                 {"starts", result.starts},
                 {"duration", result.duration}};
    for (const violation &one : result.violations)
        text["violations"].push_back(
            {one.invariant, one.words, one.at, one.cycle, one.last_faults});
    return text.dump(-1, ' ', false, json::error_handler_t::replace);
}

run_result result_of_text(const std::string &text) {
    const json from = json::parse(text);
    run_result result;
    result.cycles = from.at("cycles");
    result.hash = from.at("hash");
    result.faults = from.at("faults");
    result.starts = from.at("starts");
    result.duration = from.at("duration");
    if (!from.contains("violations")) return result;
    for (const auto &one : from.at("violations"))
        result.violations.push_back({one[0], one[1], one[2], one[3], one[4]});
    return result;
}

[[noreturn]] void run_here(const run_options &options, int to) {
    run world(options);
    watch(world.time);
    const std::string text = text_of_result(world.go());
    std::fflush(stdout);
    const bool written = ::write(to, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    if (__llvm_profile_write_file) __llvm_profile_write_file();
    ::_exit(written ? 0 : 1);
}

std::string read_all(int from) {
    std::string text;
    char part[4096];
    for (ssize_t got; (got = ::read(from, part, sizeof part)) > 0;)
        text.append(part, static_cast<std::size_t>(got));
    ::close(from);
    return text;
}

std::string words_of_end(int status) {
    if (WIFSIGNALED(status))
        return fmt::format("the program ends: {}", ::strsignal(WTERMSIG(status)));
    if (WEXITSTATUS(status) == SIGXCPU) return "virtual time stands still";
    return fmt::format("the program ends with {}", WEXITSTATUS(status));
}

}  // namespace

run_result run_isolated(const run_options &options) {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
    std::fflush(stdout);
    const pid_t child = ::fork();
    if (child < 0) throw std::runtime_error("no process");
    if (child == 0) {
        ::close(ends[0]);
        run_here(options, ends[1]);
    }
    ::close(ends[1]);
    const std::string text = read_all(ends[0]);
    int status = 0;
    ::waitpid(child, &status, 0);
    if (status == 0) return result_of_text(text);
    run_result result;
    result.violations.push_back({"crash", words_of_end(status), 0, options.cycles, {}});
    return result;
}

}  // namespace compbox::world
