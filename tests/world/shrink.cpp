// SPDX-License-Identifier: MIT
#include "tests/world/shrink.h"

#include <optional>

namespace compbox::world {

namespace {

// out: the run with these options, if it violates the same invariant
std::optional<failing_run> tried(const run_options &options, const failing_run &like) {
    run_options silent = options;
    silent.prints_log = false;
    const run_result result = run(silent).go();
    if (result.violations.empty()) return std::nullopt;
    if (result.violations[0].invariant != like.found.invariant) return std::nullopt;
    return failing_run{options, result.violations[0]};
}

// Ends right behind the violation, or as early as one of these cycles.
failing_run with_fewer_cycles(failing_run best) {
    for (const std::uint64_t cycles :
         {best.found.cycle / 2, best.found.cycle, best.found.cycle + 1}) {
        if (cycles == 0 || cycles >= best.options.cycles) continue;
        run_options options = best.options;
        options.cycles = cycles;
        if (const auto smaller = tried(options, best)) return *smaller;
    }
    return best;
}

}  // namespace

failing_run shrunk(const failing_run &whole) {
    failing_run best = with_fewer_cycles(whole);
    const fault_set kinds = best.options.faults;
    for (const fault_kind kind : kinds) {
        run_options options = best.options;
        options.faults.erase(kind);
        if (const auto smaller = tried(options, best)) best = with_fewer_cycles(*smaller);
    }
    return best;
}

}  // namespace compbox::world
