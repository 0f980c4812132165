// SPDX-License-Identifier: MIT
#include "tests/world/shrink.h"

#include <optional>

#include "tests/world/isolated.h"

namespace compbox::world {

namespace {

constexpr int most_tries = 100;  // then the smallest run so far has to do
int tries = 0;

// out: the run with these options, if it violates the same invariant
std::optional<failing_run> tried(const run_options &options, const failing_run &like) {
    if (++tries > most_tries) return std::nullopt;
    run_options silent = options;
    silent.prints_log = silent.prints_exchanges = false;
    const run_result result = run_isolated(silent);
    if (result.violations.empty()) return std::nullopt;
    if (result.violations[0].invariant != like.found.invariant) return std::nullopt;
    return failing_run{options, result.violations[0]};
}

// Ends right behind the violation; of a crash, whose cycle is unknown, at a half again and again.
failing_run with_fewer_cycles(failing_run best) {
    for (const std::uint64_t more : {0U, 1U}) {
        run_options options = best.options;
        options.cycles = best.found.cycle + more;
        if (options.cycles == 0 || options.cycles >= best.options.cycles) continue;
        if (const auto smaller = tried(options, best)) return *smaller;
    }
    while (best.found.invariant == "crash") {
        run_options options = best.options;
        options.cycles /= 2;
        const auto smaller = options.cycles == 0 ? std::nullopt : tried(options, best);
        if (!smaller) return best;
        best = *smaller;
    }
    return best;
}

failing_run with_fewer_kinds(failing_run best) {
    const fault_set kinds = best.options.faults;
    for (const fault_kind kind : kinds) {
        run_options options = best.options;
        options.faults.erase(kind);
        if (const auto smaller = tried(options, best)) best = *smaller;
    }
    return best;
}

// Of each kind the first occurrences alone, as few as it takes: by halves.
failing_run with_fewer_occurrences(failing_run best) {
    for (const fault_kind kind : best.options.faults) {
        std::uint64_t low = 0, high = 256;  // occurrences: too few, enough
        while (high - low > 1) {
            run_options options = best.options;
            const std::uint64_t half = low + (high - low) / 2;
            options.most[kind] = half;
            if (const auto smaller = tried(options, best)) {
                best = *smaller;
                high = half;
            } else {
                low = half;
            }
        }
    }
    return best;
}

}  // namespace

failing_run shrunk(const failing_run &whole) {
    tries = 0;
    // Kinds before cycles: a run without restarts makes more cycles in the same time.
    return with_fewer_cycles(with_fewer_occurrences(with_fewer_cycles(with_fewer_kinds(whole))));
}

}  // namespace compbox::world
