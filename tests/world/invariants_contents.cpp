// SPDX-License-Identifier: MIT
// What the daemon's files say of the coefficient file beside them, and of the run: each signal,
// term and channel once, in its order, with what the file states of it (docs/snapshot.md,
// docs/record.md, docs/compboxd.md).
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "host-tools/formats/text.h"
#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

using nlohmann::json;

class contents_invariant : public invariant {
  public:
    explicit contents_invariant(run &of)
        : invariant(of, "contents"),
          calm_(longest_lag(of) == 0 && !hides_exchanges(of) &&
                !draws_any(
                    of, {fault_kind::wire, fault_kind::line, fault_kind::plc_stop,
                         fault_kind::power_cut, fault_kind::mute, fault_kind::stray,
                         fault_kind::twice, fault_kind::loss, fault_kind::reset, fault_kind::tear,
                         fault_kind::exception, fault_kind::refuse, fault_kind::partial,
                         fault_kind::boundary, fault_kind::reload, fault_kind::hostile})) {}
    void started() override {
        started_s_ = wall_s();
        first_ns_ = never;
        lines_.clear();
        taken_by_log_ = 0;
        left_out_ = finished_ = false;
    }
    void logged(const std::string &line) override {
        const time_ns now = of_.time.now();
        lines_.emplace_back(now, line);
        taken_by_log_ += line.find(" is running now") != std::string::npos;
        // Of many at once the log leaves out some, and says so some seconds later.
        if (lines_.size() > most_lines) lines_.pop_front();
        const bool many = lines_.size() == most_lines && now - lines_.front().first < 10 * second;
        left_out_ = left_out_ || many || line.find(" left out)") != std::string::npos;
    }
    void taken(const machine &, const machine &) override { taken_ns_ = of_.time.now(); }
    void ticked() override {
        if (std::exchange(finished_, false))
            violated("the snapshot is that of a run that has ended, which goes on");
        if (first_ns_ == never) first_ns_ = of_.box.boottime();
    }
    void shown(const json &snapshot) override {
        finished_ = snapshot.at("finished");
        const machine *of = begins_with(run::snapshot_path, snapshot);
        if (of == nullptr) return;
        const json &file = of->file();
        same("the format of the snapshot", snapshot.at("snapshot"), 1);
        judge_time(snapshot.at("unix_s"));
        if (snapshot.at("cause").is_object()) judge_cause(snapshot.at("cause"));
        judge_signals(file.at("signals"), snapshot.at("signals"));
        judge_terms(file, snapshot);
        judge_channels(*of, file.at("channels"), snapshot.at("channels"));
        // A bus starts soon behind the first row of its file.
        const bool starts = snapshot.at("reason") == "no cycle has run yet" ||
                            of_.time.now() - taken_ns_ < 3 * second;
        if (starts) return;
        same("whether there is CAN", snapshot.contains("can"), uses_can(file));
        same("whether there is a bus", snapshot.contains("bus"), file.contains("buses"));
        judge_buses(file, snapshot);
    }
    void reported(const json &all) override {
        const machine *of = begins_with(run::stats_path, all);
        if (of == nullptr) return;
        if (of_.time.now() - taken_ns_ > 3 * second) judge_buses(of->file(), all);
        same("the statistics' config", all.at("config"), run::config_path);
        same("their format", all.at("format"), "compboxd-stats/1");
        const site_ceiling ceiling = of_.ceiling().value_or(site_ceiling{});
        near("the ceiling", all.at("ceiling").at("um"), ceiling.um);
        near("its rate", all.at("ceiling").at("um_per_s"), ceiling.um_per_s);
        judge_reloads(all.at("reloads"));
        judge_elapsed(all);
        judge_links(all);
        if (calm_) judge_calm(all);
    }
    void ended(const ending &how) override {
        const bool is_written = !draws_any(
            of_, {fault_kind::disk, fault_kind::refuse, fault_kind::partial, fault_kind::links});
        if (!how.by_signal && how.code == 0 && of_.keeps_snapshot() && is_written && !finished_)
            violated("the run has ended, and its snapshot does not say so");
        // A power cut may have torn the first line, and a start that fails leaves it so.
        const std::string record = of_.box.files.text(run::record_path);
        const std::size_t length = record.find('\n');
        const bool is_torn = length == record.npos && draws(of_, fault_kind::power_cut);
        if (!how.by_signal && knows_files() && !record.empty() && !is_torn)
            judge_header(record.substr(0, length));
    }

  private:
    double wall_s() const { return 1e-9 * static_cast<double>(of_.box.wall()); }
    bool knows_files() const {
        return !draws_any(of_, {fault_kind::hostile, fault_kind::memory, fault_kind::disk});
    }
    void same(const std::string &what, const json &is, const json &stated) {
        if (is != stated) violated(fmt::format("{} is {}, not {}", what, is.dump(), stated.dump()));
    }
    static bool uses_can(const json &file) {
        const json &signals = file.at("signals");
        return file.value("can", json::object()).contains("nodes") ||
               std::any_of(signals.begin(), signals.end(),
                           [](const json &one) { return one.contains("can"); });
    }
    // out: one of the words is this number, to six digits; null: it is none
    static bool has_number(const std::string &text, const json &stated) {
        if (!stated.is_number()) return true;
        const double number = stated;
        const std::vector<std::string> words = formats::split(text, ' ');
        return std::any_of(words.begin(), words.end(), [number](const std::string &word) {
            char *end = nullptr;
            const double is = std::strtod(word.c_str(), &end);
            return end != word.c_str() && std::fabs(is - number) <= 1e-5 * std::fabs(number);
        });
    }
    // Of float32.
    void near(const std::string &what, const json &is, double stated) {
        if (!is.is_number() || std::fabs(is.get<double>() - stated) > 1e-6 * std::fabs(stated))
            violated(fmt::format("{} is {}, not {}", what, is.dump(), stated));
    }

    // What both files have of run and coefficient file. out: the latter; nullptr: not known
    const machine *begins_with(const std::string &path, const json &all) {
        if (!knows_files()) return nullptr;
        const machine *of = file_named_in(all);
        if (of == nullptr) return nullptr;
        same(path + ": machine", all.at("machine"), of->file().at("machine").at("name"));
        same(path + ": period_us", all.at("period_us"), of->period_us);
        if (!draws(of_, fault_kind::clock) &&
            std::fabs(all.at("started_unix_s").get<double>() - started_s_) > 5)
            violated(fmt::format("{}: started_unix_s is {}, and the daemon came at {} s", path,
                                 all.at("started_unix_s").dump(), started_s_));
        return of;
    }
    // Of a file that is written now.
    void judge_time(double unix_s) {
        if (longest_lag(of_) == 0 && std::fabs(unix_s - wall_s()) > 1 &&
            !draws_any(of_, {fault_kind::clock, fault_kind::suspend, fault_kind::partial}))
            violated(fmt::format("a snapshot of {} s is written at {} s", unix_s, wall_s()));
    }
    // Its sentence has the names and numbers beside it.
    void judge_cause(const json &cause) {
        const std::string text = cause.at("text");
        const std::string of = fmt::format("{} {} ", cause.at("of").get<std::string>(),
                                           cause.at("name").get<std::string>());
        bool agrees = text.rfind(of, 0) == 0 && (text + " ").find(" -0 ") == std::string::npos;
        if (agrees && cause.contains("bound")) {
            const std::size_t last = text.rfind(' ');  // the sentence ends with the bound
            agrees = has_number(text.substr(of.size(), last - of.size()), cause.at("value")) &&
                     has_number(text.substr(last + 1), cause.at("bound"));
        }
        if (!agrees) violated("a cause has other members than its text: " + cause.dump());
    }
    // The names of CAN and of the bus.
    void judge_buses(const json &file, const json &shown) {
        if (shown.contains("can")) {
            const json can = file.value("can", json::object());
            same("the interface", shown.at("can").at("interface"), can.value("interface", "can0"));
            json is = json::array(), stated = json::array();
            for (const json &node : shown.at("can").at("nodes")) is.push_back(node.at("node"));
            for (const json &node : can.value("nodes", json::array()))
                stated.push_back(node.at("node"));
            same("the list of nodes", is, stated);
        }
        if (shown.contains("bus")) {
            const json &bus = file.at("buses").at(0);
            same("the bus", shown.at("bus").at("name"), bus.at("name"));
            same("its device", shown.at("bus").at("device"), bus.at("rtu").at("device"));
        }
    }
    // The newest sentence about a file is one of the log, which may leave out some of them.
    void judge_reloads(const json &reloads) {
        const std::string last = reloads.at("last");
        if (left_out_ || of_.faults.refuses_lines ||
            draws_any(of_, {fault_kind::reader, fault_kind::power_cut}))
            return;
        last_ = last != last_ && is_in_log(last) ? last : last_;
        if (last != last_ && !last.empty())
            violated("the statistics have a sentence that the log lacks: " + last);
        if (reloads.at("taken") != taken_by_log_)
            violated(fmt::format("{} files were taken, by the log {}", reloads.at("taken").dump(),
                                 taken_by_log_));
    }
    bool is_in_log(const std::string &words) const {
        return std::any_of(lines_.begin(), lines_.end(), [&words](const auto &one) {
            return one.second.find(words) != std::string::npos;
        });
    }
    // Behind its first tick, by the clock that a suspend does not stop. The history lies within.
    void judge_elapsed(const json &all) {
        const double elapsed_s = all.at("elapsed_s");
        const double most_s =
            first_ns_ == never ? 0 : 1e-9 * static_cast<double>(of_.box.boottime() - first_ns_);
        if (elapsed_s < 0 || elapsed_s > most_s + 1e-3)
            violated(fmt::format("elapsed_s is {}, {} s behind the first tick", elapsed_s, most_s));
        double at_s = 0;
        for (const json &change : all.at("history")) {
            const double next_s = change.at("time_s");
            if (next_s < at_s || next_s > elapsed_s + 1e-3)
                violated(fmt::format("a change of {} s is behind one of {} s, elapsed_s is {}",
                                     next_s, at_s, elapsed_s));
            at_s = next_s;
        }
        const json &left_out = all.at("history_left_out");
        if (left_out > 0 && all.at("history").size() < most_changes)
            violated(fmt::format("{} changes are left out, {} are kept", left_out.dump(),
                                 all.at("history").size()));
    }
    // Each connection but the newest one ended. Where nothing happens to a wire none does.
    void judge_links(const json &all) {
        for (const char *key : {"plc", "bus"}) {
            if (!all.contains(key)) continue;
            const json &link = all.at(key);
            const std::int64_t connects = link.at("connects"), ended = link.at("disconnects");
            if (knows_files() && connects - ended != 0 && connects - ended != 1)
                violated(
                    fmt::format("{} has {} connects and {} disconnects", key, connects, ended));
            if (calm_)
                same(fmt::format("connects_failed of {}", key), link.at("connects_failed"), 0);
        }
    }
    void judge_calm(const json &all) {
        for (const auto &[kind, count] : all.at("plc").at("odd_replies").items())
            same(kind, count, 0);
        same("refused files", all.at("reloads").at("refused"), 0);
        if (!draws_any(of_, {fault_kind::disk, fault_kind::links}))
            same("rows that are lost", all.at("records_lost"), 0);
        const json &realtime = all.at("realtime");
        if (all.at("cycles") > 0)
            same("priority, memory and CPU", realtime,
                 {{"priority", 0}, {"memory_locked", true}, {"cpu_latency_held", true}});
    }
    void judge_signals(const json &stated, const json &shown) {
        same("the number of signals", shown.size(), stated.size());
        for (std::size_t i = 0; i < stated.size() && i < shown.size(); ++i) {
            same("a signal", shown[i].at("name"), stated[i].at("name"));
            same("a unit", shown[i].at("unit"), stated[i].value("unit", ""));
        }
    }
    void judge_terms(const json &file, const json &snapshot) {
        json names = json::array(), adapted = json::array(), shown_adapted = json::array();
        for (const json &term : file.at("terms")) {
            for (const json &output : outputs_of(term)) names.push_back(output);
            if (term.at("type") == "adapt") adapted.push_back({term.at("name"), term.at("of")});
        }
        json shown = json::array();
        for (const json &term : snapshot.at("terms")) shown.push_back(term.at("name"));
        same("the list of terms", shown, names);
        for (const json &one : snapshot.value("adapted", json::array()))
            shown_adapted.push_back({one.at("name"), one.at("of")});
        same("the list of adapted terms", shown_adapted, adapted);
    }
    void judge_channels(const machine &of, const json &stated, const json &shown) {
        same("the number of channels", shown.size(), stated.size());
        for (std::size_t i = 0; i < stated.size() && i < shown.size(); ++i) {
            same("a channel", shown[i].at("name"), stated[i].at("name"));
            same("the terms of a channel", shown[i].at("terms"), stated[i].at("sum"));
            near("limit_um", shown[i].at("limit_um"), of.channels[i].limit_um);
            if (!stated[i].contains("applied") && !shown[i].at("applied_um").is_null())
                violated(fmt::format("applied_um of {} is {}, and it has none",
                                     stated[i].at("name").dump(), shown[i].dump()));
        }
    }
    // The columns of a record are those of a file that came.
    void judge_header(const std::string &header) {
        for (unsigned revision = 1; revision <= of_.revision; ++revision) {
            const machine *of = of_.with_revision(revision);
            if (of != nullptr && header_of(of->file()) == header) return;
        }
        violated(fmt::format("the record has other columns than each file: {}", header));
    }
    static std::string header_of(const json &file) {
        std::string header = "time_s", sigmas;
        for (const json &signal : file.at("signals"))
            header += "," + signal.at("name").get<std::string>();
        for (const json &term : file.at("terms"))
            for (const std::string output : outputs_of(term)) {
                header += "," + output;
                if (term.contains("sigma") || term.at("type") == "adapt")
                    sigmas += ",sigma_" + output;
            }
        for (const json &channel : file.at("channels"))
            header += fmt::format(",comp_{}_um", channel.at("name").get<std::string>());
        return header + sigmas + ",mode,reason,unix_s";
    }

    static constexpr std::size_t most_changes = 256;  // of the history
    static constexpr std::size_t most_lines = 15;
    bool calm_;                                          // nothing happens to wires and calls
    std::deque<std::pair<time_ns, std::string>> lines_;  // the newest of the log …
    bool left_out_ = false;                              // … which has not all
    std::uint64_t taken_by_log_ = 0;                     // files
    std::string last_;                                   // sentence that the log had
    bool finished_ = false;                              // by the newest snapshot
    double started_s_ = 0;
    time_ns first_ns_ = never;       // tick
    time_ns taken_ns_ = -never / 2;  // the newest file
};

}  // namespace

void add_contents(run &of, invariants &all) {
    all.push_back(std::make_unique<contents_invariant>(of));
}

}  // namespace compbox::world
