// SPDX-License-Identifier: MIT
#include "tests/world/invariants.h"

#include "tests/world/run.h"

namespace compbox::world {

void invariant::violated(const std::string &words) {
    of_.report(name, words);
}

nlohmann::json invariant::finished_statistics() const {
    if (!of_.has_statistics) return {};
    auto all = nlohmann::json::parse(of_.box.files.text(run::stats_path), nullptr, false);
    const bool finished = all.is_object() && all.value("finished", false);
    return finished ? all : nlohmann::json();
}

invariants all_invariants(run &of) {
    invariants all;
    add_bounds(of, all);
    add_modes(of, all);
    add_process(of, all);
    add_files(of, all);
    add_foreign(of, all);
    add_reloads(of, all);
    add_models(of, all);
    add_adapted(of, all);
    add_reference(of, all);
    add_causes(of, all);
    add_doubts(of, all);
    add_rows(of, all);
    add_shown(of, all);
    add_contents(of, all);
    add_events(of, all);
    add_supervised(of, all);
    add_wire(of, all);
    add_counters(of, all);
    add_lags(of, all);
    return all;
}

}  // namespace compbox::world
