// SPDX-License-Identifier: MIT
// world: runs compboxd's own code in virtual time against a simulated PLC, network, disk and clock,
// with faults by the seed, and checks invariants after every step (docs/simulate.md).
#include <fmt/core.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <ostream>

#include "host-tools/command_line/command_line.h"
#include "tests/world/isolated.h"
#include "tests/world/shrink.h"

namespace {

using namespace compbox::world;

struct order {
    std::uint64_t first = 1, last = 1, cycles = 1000;
    int jobs = 1;
    std::string faults = "swarm";
    bool prints_log = false, prints_exchanges = false, prints_hash = false, prints_file = false;
    bool shrinks = true;
};

struct total {
    std::uint64_t cycles = 0, seeds = 0, violations = 0;
    double seconds = 0;  // of the world
};

// out: first and last of "A..B" or "A"; throws usage_error
void take_seeds(const std::string &text, order &to) {
    const auto dots = text.find("..");
    try {
        to.first = std::stoull(text.substr(0, dots));
        to.last = dots == std::string::npos ? to.first : std::stoull(text.substr(dots + 2));
    } catch (const std::exception &) {
        throw compbox::cli::usage_error("--seeds", "must be A..B, as in 1..100");
    }
    if (to.last < to.first)
        throw compbox::cli::usage_error("--seeds", "the last seed is below the first");
}

run_options options_of(const order &with, std::uint64_t seed) {
    run_options options;
    options.seed = seed;
    options.cycles = with.cycles;
    options.faults = with.faults == "swarm" ? swarm_of(seed) : fault_set_of(with.faults);
    if (with.faults != "swarm") options.most = fault_limits_of(with.faults);
    options.prints_log = with.prints_log;
    options.prints_exchanges = with.prints_exchanges;
    return options;
}

std::string replay_of(const run_options &options) {
    return fmt::format("replay: scripts/simulate --seeds {}..{} --cycles {} --faults {}\n",
                       options.seed, options.seed, options.cycles,
                       text_of(options.faults, options.most));
}

void print_violation(const failing_run &failing) {
    const violation &found = failing.found;
    fmt::print("violation of {} at {:.6f} s, cycle {} of seed {}: {}\n", found.invariant,
               static_cast<double>(found.at) * 1e-9, found.cycle, failing.options.seed,
               found.words);
    for (const auto &fault : found.last_faults) fmt::print("  fault at {}\n", fault);
    fmt::print("{}", replay_of(failing.options));
}

// Runs every jobs-th seed from first + job on.
total run_seeds(const order &with, int job) {
    total sum;
    for (std::uint64_t seed = with.first + static_cast<std::uint64_t>(job); seed <= with.last;
         seed += static_cast<std::uint64_t>(with.jobs)) {
        const run_options options = options_of(with, seed);
        const run_result result = run_isolated(options);
        sum.cycles += result.cycles;
        ++sum.seeds;
        sum.violations += result.violations.size();
        sum.seconds += static_cast<double>(result.duration) * 1e-9;
        for (const auto &found : result.violations) {
            const failing_run whole = {options, found};
            print_violation(with.shrinks ? shrunk(whole) : whole);
        }
        if (with.prints_hash) fmt::print("seed {}: hash {:016x}\n", seed, result.hash);
        std::fflush(stdout);
    }
    return sum;
}

// Each job is a process of its own, which reports its sums by a pipe.
total run_jobs(const order &with) {
    if (with.jobs == 1) return run_seeds(with, 0);
    total all;
    std::vector<int> pipes;
    for (int job = 0; job < with.jobs; ++job) {
        int ends[2];
        if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
        std::fflush(stdout);
        if (::fork() == 0) {
            const total sum = run_seeds(with, job);
            if (::write(ends[1], &sum, sizeof sum) != static_cast<ssize_t>(sizeof sum)) ::_exit(70);
            ::_exit(0);
        }
        ::close(ends[1]);
        pipes.push_back(ends[0]);
    }
    for (const int from : pipes) {
        total sum;
        if (::read(from, &sum, sizeof sum) != static_cast<ssize_t>(sizeof sum))
            throw std::runtime_error("a job ended by itself");
        ::close(from);
        all.cycles += sum.cycles;
        all.seeds += sum.seeds;
        all.violations += sum.violations;
        all.seconds += sum.seconds;
    }
    while (::wait(nullptr) > 0) continue;
    return all;
}

// out: time of the processors that this program and its jobs used: other programs beside it do not
// change the figure
double processor_seconds() {
    double sum = 0;
    for (const int whose : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
        rusage used;
        ::getrusage(whose, &used);
        for (const timeval &part : {used.ru_utime, used.ru_stime})
            sum += static_cast<double>(part.tv_sec) + 1e-6 * static_cast<double>(part.tv_usec);
    }
    return sum;
}

// The files of a run grow and go again and again: their memory stays with the process, or the
// kernel would clear each page once more.
void keep_memory() {
    ::mallopt(M_MMAP_THRESHOLD, 1 << 30);
    ::mallopt(M_TRIM_THRESHOLD, 1 << 30);
    ::mallopt(M_TOP_PAD, 4 << 20);
}

int simulate(const order &with) {
    const total sum = run_jobs(with);
    fmt::print("{} cycles, {} seeds, {} violations, {:.0f} times real time\n", sum.cycles,
               sum.seeds, sum.violations, sum.seconds / processor_seconds());
    return sum.violations > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char **argv) {
    keep_memory();
    const auto io = compbox::cli::standard_streams();
    compbox::cli::program app{"world: runs compboxd in virtual time with faults by a seed", io};
    order with;
    app.add_option_function(
        "--seeds A..B", [&with](const std::string &text) { take_seeds(text, with); },
        "The seeds to run");
    app.add_option("--cycles N", with.cycles, "Cycles of the box for each seed");
    app.add_option("--jobs J", with.jobs, "Processes at once");
    app.add_option("--faults LIST", with.faults,
                   "Kinds of faults: swarm (drawn by the seed), all, none, or names with commas");
    app.add_flag("--log", with.prints_log, "Print the daemon's log");
    app.add_flag("--exchanges", with.prints_exchanges, "Print each exchange with the PLC");
    app.add_flag("!--no-shrink", with.shrinks, "Print violations as they are found");
    app.add_flag("--hash", with.prints_hash,
                 "Print a hash of all that was sent, written and logged");
    app.add_flag("--file", with.prints_file,
                 "Print the coefficient file of the first seed, and end");
    try {
        if (const auto end = app.parse(argc, argv)) return *end;
        if (with.prints_file) {
            io.out << machine_of(with.first).text << "\n";
            return 0;
        }
        if (with.faults != "swarm") options_of(with, with.first);
        return simulate(with);
    } catch (const std::invalid_argument &error) {
        io.err << "world: --faults: " << error.what() << "\n";
        return 2;
    } catch (const std::exception &error) {
        io.err << "world: fault in the program itself: " << error.what() << "\n";
        return 70;
    }
}
