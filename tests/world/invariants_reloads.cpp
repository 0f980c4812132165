// SPDX-License-Identifier: MIT
// Files that a running daemon takes (docs/compboxd.md), and a configuration that has changed in
// memory (docs/faults.md, reason 17).
#include <fmt/core.h>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

// A running daemon takes no older file, and a wider one at rest alone. The good file behind all
// faults is taken.
class reload_invariant : public invariant {
  public:
    explicit reload_invariant(run &of)
        : invariant(of, "reload"),
          judged_(!draws_any(of, {fault_kind::hostile, fault_kind::memory})),
          ends_well_(!draws(of, fault_kind::memory)) {}
    void started() override {
        mode_ = fakeplc::box_mode::standby;
        holds_zero_ = true;
        unread_ = 0;
    }
    void ticked() override { ++unread_; }
    void exchanged(const exchange &seen) override {
        const bool replies = seen.duration != never && seen.exception == 0;
        if (replies && is_reading(of_.running_at(seen.sent), seen)) unread_ = 0;
        if (seen.written.empty()) return;
        const written_block &block = block_of(of_.author_of(seen), seen);
        holds_zero_ = block.is_zero();  // be it a late one
        if (seen.sent < sent_ns_) return;
        mode_ = block.mode;
        sent_ns_ = seen.sent;
    }
    void taken(const machine &was, const machine &is) override {
        if (!judged_) return;
        if (is.revision < was.revision)
            violated(fmt::format("revision {} is taken behind {}", is.revision, was.revision));
        const bool recent = 2 * (of_.time.now() - sent_ns_) < 3 * was.period_us * us;
        if (!is_wider(is, was)) return;
        if (mode_ == fakeplc::box_mode::active && recent)
            violated(fmt::format("revision {} is wider, and is taken while ACTIVE", is.revision));
        if (!holds_zero_)
            violated(fmt::format("revision {} is wider, and the PLC holds an output", is.revision));
        if (unread_ * was.period_us * us > contact_lasts(was))
            violated(
                fmt::format("revision {} is wider, and is taken {} cycles behind the last reading",
                            is.revision, unread_));
    }
    // Without a signal a file is read once it has not changed from one look to the next, a second
    // later.
    void logged(const std::string &line) override {
        const auto file = of_.box.files.find(run::config_path, false);
        const bool refuses = line.find(run::config_path) != std::string::npos &&
                             line.find(", line ") != std::string::npos;
        if (!judged_ || !refuses || file == nullptr || longest_lag(of_) != 0 ||
            of_.cycles_of_daemon == 0 ||
            draws_any(of_, {fault_kind::clock, fault_kind::reader, fault_kind::boundary}))
            return;
        const time_ns age_ns = of_.box.wall() - file->changed_ns;
        const time_ns replaced_ns = of_.time.now() - of_.replaced_in_read_ns;
        // One that changes while it is read had not changed before.
        if (age_ns > ms && age_ns < 900 * ms && replaced_ns > second &&
            of_.time.now() - of_.box.hung_up_ns > 5 * second)
            violated(fmt::format("a file is read {} ms behind its last change", age_ns / ms));
    }
    void faults_ended() override { quiet_ns_ = of_.time.now(); }
    void scanned(const fakeplc::plc_state &) override {
        if (!ends_well_ || quiet_ns_ == never || of_.asked_to_stop || !of_.box.runs()) return;
        if (of_.time.now() - quiet_ns_ < of_.recovery_ns()) return;
        if (of_.running().revision != of_.revision)
            violated(fmt::format("revision {} is on the disk, {} runs", of_.revision,
                                 of_.running().revision));
    }

  private:
    bool judged_, ends_well_;
    unsigned mode_ = 0;
    std::int64_t unread_ = 0;  // cycles since the PLC was read
    bool holds_zero_ = true;   // by the write that acted last
    time_ns sent_ns_ = 0, quiet_ns_ = never;
};

// A file that has not changed for some seconds has been looked at: a good one runs, unless it is
// wider and waits for rest. Of another one nothing is pending; while there is none, the one before
// goes on to wait.
class settled_file_invariant : public invariant {
  public:
    explicit settled_file_invariant(run &of)
        : invariant(of, "settled file"),
          judged_(draws(of, fault_kind::reload) && longest_lag(of) == 0 && !of.signer &&
                  !draws_any(of, {fault_kind::hostile, fault_kind::memory, fault_kind::clock,
                                  fault_kind::disk, fault_kind::reader, fault_kind::boundary,
                                  fault_kind::power_cut})) {}
    void started() override { since_ns_ = of_.time.now(); }
    void ticked() override {
        if (!judged_ || of_.time.now() - looked_ns_ < second || !is_settled()) return;
        const machine *file = newest();
        if (file != nullptr && file->revision != of_.running().revision &&
            !may_be_wider(*file, of_.running()))
            violated(fmt::format("revision {} is good and no wider, and {} runs", file->revision,
                                 of_.running().revision));
    }
    void reported(const nlohmann::json &all) override {
        if (!judged_ || !is_settled()) return;
        const machine *waits = newest();
        const auto there = of_.box.files.find(run::config_path, true);
        const bool is_gone = there == nullptr || there->kind != node_kind::regular;
        const bool may_wait =
            is_gone || (waits != nullptr && waits->revision != of_.running().revision);
        if (all.at("reloads").value("pending", false) && !may_wait)
            violated("a file is pending, and there is none that waits");
    }

  private:
    // Looks at the file. out: the daemon has, too, since it changed last
    bool is_settled() {
        looked_ns_ = of_.time.now();
        std::string now = of_.box.files.text(run::config_path);
        if (now != seen_) since_ns_ = looked_ns_;
        seen_ = std::move(now);
        return looked_ns_ - since_ns_ > 7 * second && of_.box.runs() && !of_.stop_asked &&
               !of_.asked_to_stop;
    }
    // out: the file on the disk, if nothing is wrong with it; else nullptr
    const machine *newest() const {
        const auto file = of_.box.files.find(run::config_path, false);
        if (file == nullptr || file->kind != node_kind::regular) return nullptr;
        const machine *facts = of_.file_of(file->bytes);
        const bool wrong = facts == nullptr || of_.wrong_revisions.count(facts->revision) > 0 ||
                           facts->revision < of_.running().revision;
        return wrong ? nullptr : facts;
    }

    bool judged_;
    std::string seen_;
    time_ns looked_ns_ = 0, since_ns_ = 0;
};

// A box that reports that its configuration has changed writes nothing more.
class corrupt_invariant : public invariant {
  public:
    explicit corrupt_invariant(run &of) : invariant(of, "corrupt") {}
    void started() override { since_ns_ = never; }
    void logged(const std::string &line) override {
        if (line.find("FAULT: the configuration in memory has changed") != std::string::npos)
            since_ns_ = std::min(since_ns_, of_.time.now());
    }
    void exchanged(const exchange &seen) override {
        if (!seen.written.empty() && seen.sent > since_ns_)
            violated("a write behind the report that the configuration has changed in memory");
    }

  private:
    time_ns since_ns_ = never;
};

}  // namespace

void add_reloads(run &of, invariants &all) {
    all.push_back(std::make_unique<reload_invariant>(of));
    all.push_back(std::make_unique<settled_file_invariant>(of));
    all.push_back(std::make_unique<corrupt_invariant>(of));
}

}  // namespace compbox::world
