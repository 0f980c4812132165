// SPDX-License-Identifier: MIT
#include "tests/world/invariants.h"

#include "tests/world/run.h"

namespace compbox::world {

void invariant::violated(const std::string &words) {
    of_.report(name, words);
}

namespace {

nlohmann::json finished_report(const std::string &text) {
    auto all = nlohmann::json::parse(text, nullptr, false);
    const bool finished = all.is_object() && all.value("finished", false);
    return finished ? all : nlohmann::json();
}

}  // namespace

nlohmann::json invariant::finished_statistics() const {
    if (!of_.has_statistics) return {};
    return finished_report(of_.box.files.text(run::stats_path));
}

nlohmann::json invariant::finished_snapshot() const {
    return finished_report(of_.box.files.text(run::snapshot_path));
}

const machine *invariant::file_named_in(const nlohmann::json &of) const {
    if (draws_any(of_, {fault_kind::hostile, fault_kind::memory})) return nullptr;
    return of_.with_revision(of.at("revision"));
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
    add_loading(of, all);
    return all;
}

}  // namespace compbox::world
