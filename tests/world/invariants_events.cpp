// SPDX-License-Identifier: MIT
// The file of events: whole, complete, and true (docs/events.md).
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "host-tools/formats/text.h"
#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

// Events stay, line by line, until a power cut; only refused calls and power cuts leave a part of
// one. Those that are missing are lines that the log leaves out. Most changes of the mode have one,
// whoever reads the log. A file has at most 1 MB, and the facts of a coefficient file are at events
// about it.
class events_invariant : public invariant {
  public:
    explicit events_invariant(run &of) : invariant(of, "events") {}
    void started() override {
        check();
        boots_.insert(of_.box.boot_id());
        lost_ = left_out_ = modes_ = changes_ = told_ = 0;
        said_.clear();
        first_ns_ = last_ns_ = never;
        untold_.reset();
        rotated_ = gives_up_ = false;
        full_at_.reset();
        mode_.reset();
        told_mode_.clear();
    }
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const unsigned mode = block_of(of_.author_of(seen), seen).mode;
        changes_ += mode_ && *mode_ != mode;
        mode_ = mode;
    }
    void taken(const machine &, const machine &is) override { untold_ = is.revision; }
    void ticked() override {
        const time_ns now = of_.time.now();
        note_signal();
        if (!whole_.empty() && now - whole_.back().first < second) return;
        const auto file = of_.box.files.find(run::events_path, false);
        whole_.emplace_back(now, file == nullptr ? 0 : file->bytes.size());
        if (whole_.size() > durable_s + 1) whole_.pop_front();
    }
    void logged(const std::string &line) override {
        unsigned count = 0;
        const auto at = line.find(": (");
        if (at != std::string::npos && line.find(" left out)") != std::string::npos &&
            std::sscanf(line.c_str() + at, ": (%u line", &count) == 1)
            left_out_ += count;
        const std::size_t text = line.find(" s: ");
        if (text != std::string::npos && line.find(" left out)") == std::string::npos)
            said_.emplace_back(of_.time.now(), line.substr(text + 4));
        if (line.find("about files left out)") != std::string::npos)
            files_left_out_.push_back(of_.time.now());
        gives_up_ = gives_up_ || line.find("a file blocks the end") != std::string::npos;
        if (line.find(std::string(run::events_path) + ": cannot be written: No space") !=
            std::string::npos)
            full_at_ = lines().size();
    }
    void ended(const ending &how) override {
        note_signal();
        if (how.power_cut) judge_durable();
        check();
        if (!how.by_signal && how.code == 0) safe_ = lines_;
        if (of_.keeps_events() && !how.by_signal && !gives_up_ && changes_ > 2 && changes_ < few &&
            2 * (modes_ + left_out_) < changes_ &&
            !draws_any(of_, {fault_kind::disk, fault_kind::refuse, fault_kind::links}))
            violated(
                fmt::format("{} events of the mode, which changed {} times", modes_, changes_));
        if (how.by_signal || draws_any(of_, {fault_kind::refuse, fault_kind::partial,
                                             fault_kind::links, fault_kind::reader}))
            return;
        judge_lost();
        const std::ptrdiff_t behind = full_at_ && !rotated_ ? whole_lines_from(*full_at_ - 1) : 0;
        if (lost_ == 0 && behind > 0)
            violated(
                fmt::format("{} events behind a full disk, and none says what was lost", behind));
        if (draws(of_, fault_kind::disk)) return;
        if (untold_ && of_.keeps_events() && !rotated_ && lost_ + left_out_ == 0 && !gives_up_)
            violated(fmt::format("revision {} runs, and no event says so", *untold_));
        const bool none_told = of_.keeps_events() && !rotated_ && lost_ == 0;
        if (lost_ > left_out_ || (none_told && left_out_ > most_untold))
            violated(fmt::format("{} events are missing, the log leaves out {} lines", lost_,
                                 left_out_));
    }

  private:
    void check() {
        const auto file = of_.box.files.find(run::events_path, false);
        if (file == nullptr || file->kind != node_kind::regular) return;
        if (file->bytes.size() > run::most_events_bytes)
            violated(fmt::format("the file of events has {} bytes", file->bytes.size()));
        const std::vector<std::string> lines = formats::split(file->bytes, '\n');
        if ((was_put_aside() && is_rotated()) || is_rotated_again(lines.size())) {
            lines_ = safe_ = 0;
            rotated_ = true;
            changes_ = few;  // not judged: the file before has some of their events
        }
        if (lines.size() < safe_ &&
            !draws_any(of_, {fault_kind::disk, fault_kind::refuse, fault_kind::links}))
            violated(fmt::format("{} lines of events, and a daemon that ended with 0 had left {}",
                                 lines.size(), safe_));
        if (lines.size() < lines_ && !draws_any(of_, {fault_kind::power_cut, fault_kind::disk,
                                                      fault_kind::refuse, fault_kind::links}))
            violated(fmt::format("{} lines of events, there were {}", lines.size(), lines_));
        for (std::size_t i = lines_; i + 1 < lines.size(); ++i) {
            const auto event = nlohmann::json::parse(lines[i], nullptr, false);
            if (event.is_object()) judge(event);
            if (!event.is_discarded()) continue;
            if (!draws_any(of_, {fault_kind::power_cut, fault_kind::kill, fault_kind::disk,
                                 fault_kind::refuse, fault_kind::partial}))
                violated("a line of events is no JSON object: " + lines[i]);
        }
        lines_ = lines.size();
    }
    // Only an event about a coefficient file says who brought one.
    void judge(const nlohmann::json &event) {
        judge_clocks(event);
        if (event.contains("boot_s")) {
            judge_words(event);
            note_told(event);
        }
        lost_ += event.value("lost_before", std::uint64_t{0});
        const std::string mode = event.value("mode", "");  // others have none
        modes_ += !mode.empty() && std::exchange(told_mode_, mode) != mode;
        const std::string text = event.value("text", "");
        if (untold_ &&
            text.find(fmt::format(": revision {} is running now", *untold_)) != std::string::npos)
            untold_.reset();
        const bool is_of_file = text.find("/etc/compbox/") != std::string::npos ||
                                text.find(", revision ") != std::string::npos;
        if (event.contains("file") && !is_of_file)
            violated("an event has the facts of a coefficient file, and is not about one: " + text);
        if (event.contains("file") && event.contains("boot_s"))
            since_ns_.emplace(event.at("file").value("revision", nlohmann::json()).dump(),
                              time_of(event));
        if (event.contains("file") && event.at("file").contains("requested_by") &&
            longest_lag(of_) == 0 && !draws(of_, fault_kind::clock))
            judge_request(event);
    }
    void note_told(const nlohmann::json &event) {
        ++told_;
        last_ns_ = time_of(event);
        last_text_ = event.value("text", "");
        if (first_ns_ == never) first_ns_ = last_ns_;
    }
    // Each line of the log from the first event to the last one has its own event, or that is lost.
    void judge_lost() {
        const time_ns lag_ns = longest_lag(of_);  // of a disk, between an event and its line
        if (rotated_ || gives_up_ || told_ == 0 || lag_ns == never || draws(of_, fault_kind::clock))
            return;
        const auto is_last = [&](const auto &one) {
            return one.second == last_text_ && one.first > last_ns_ - ms &&
                   one.first < last_ns_ + lag_ns + ms;
        };
        const auto is_behind_first = [&](const auto &one) {
            return one.first > first_ns_ + lag_ns + ms;
        };
        const auto last = std::find_if(said_.begin(), said_.end(), is_last);
        if (last == said_.end()) return;
        const auto lines = std::count_if(said_.begin(), last + 1, is_behind_first);
        if (static_cast<std::uint64_t>(lines) > told_ + lost_)
            violated(fmt::format("{} lines of the log have {} events, and {} are said to be lost",
                                 lines, told_, lost_));
    }
    // Its members say the same as its text, and a file has its own check sum.
    void judge_words(const nlohmann::json &event) {
        const std::string text = event.value("text", ""), kind = event.value("kind", "");
        if (kind.empty() || text.empty() || (kind == "mode") != event.contains("mode"))
            violated("an event lacks text, kind or mode: " + event.dump());
        if (kind == "mode") {
            const std::string cause = event.at("cause");
            const std::string words = fmt::format("{}: {}{}{}", event.at("mode").get<std::string>(),
                                                  event.at("reason").get<std::string>(),
                                                  cause.empty() ? "" : ": ", cause);
            if (text != words)
                violated("an event has other members than its text: " + event.dump());
        }
        judge_sum(event);
        judge_origin(event, kind, text);
        if (!event.contains("file")) return;
        const nlohmann::json &file = event.at("file");
        judge_sum(file);
        const std::size_t at = text.rfind(": revision ");
        if (at != std::string::npos && std::stoul(text.substr(at + 11)) != file.at("revision"))
            violated("an event is about another file than its text: " + event.dump());
        const std::string crc = file.at("crc"), sha = file.at("sha256");
        if (sha.size() != 64 || hashes_.emplace(crc, sha).first->second != sha)
            violated(fmt::format("the file with crc {} has the hashes {} and {}", crc, sha,
                                 hashes_[crc]));
        const auto by = file.value("requested_by", nlohmann::json{{"pid", 1}, {"user", 0}});
        if (by.at("pid") != 1 || by.at("user") != 0 || file.at("owner") != 1000)
            violated("a file is of another user: " + event.dump());
        const double modified_s = file.at("modified_unix_s"), now_s = event.at("unix_s");
        if (!draws(of_, fault_kind::clock) && (modified_s > now_s || modified_s < now_s - 1e5))
            violated(fmt::format("a file of {} s comes at {} s", modified_s, now_s));
    }
    // The computer's start, its clock's state, and the log's kind of line.
    void judge_origin(const nlohmann::json &event, const std::string &kind,
                      const std::string &text) {
        const bool refused = draws_any(of_, {fault_kind::refuse, fault_kind::partial});
        if (!refused && boots_.count(event.at("boot")) == 0)
            violated("an event is of another start of the computer: " + event.dump());
        if (!refused && !draws(of_, fault_kind::clock) &&
            event.at("synchronised") != of_.box.synchronised)
            violated("an event has another state of the clock: " + event.dump());
        static const std::set<std::string> kinds = {"run", "mode", "link", "wire",
                                                    "can", "bus",  "file"};
        const bool is_link = text.rfind("connect", 0) == 0 || text.rfind("cannot connect", 0) == 0;
        if (kinds.count(kind) == 0 || (is_link && kind != "link"))
            violated("an event is of another kind: " + event.dump());
    }
    // in : of: with revision and check sum
    void judge_sum(const nlohmann::json &of) {
        const machine *is = of.contains("crc") ? file_named_in(of) : nullptr;
        if (is != nullptr && of.at("crc") != crc_of(is->text))
            violated(fmt::format("an event has crc {} for revision {}: {}", of.at("crc").dump(),
                                 is->revision, crc_of(is->text)));
    }
    // Both of its times are of one moment.
    void judge_clocks(const nlohmann::json &event) {
        if (!event.contains("boot_s") ||
            draws_any(of_, {fault_kind::clock, fault_kind::suspend, fault_kind::power_cut}))
            return;
        const double apart_s = event.value("unix_s", 0.0) - event.value("boot_s", 0.0);
        const double wants_s = 1e-9 * static_cast<double>(of_.box.wall() - of_.box.boottime());
        if (std::abs(apart_s - wants_s) > 0.1)
            violated(
                fmt::format("an event has clocks {} s apart, they are {} s", apart_s, wants_s));
    }
    void note_signal() {
        if (hung_ups_.empty() || hung_ups_.back() != of_.box.hung_up_ns)
            hung_ups_.push_back(of_.box.hung_up_ns);
    }
    time_ns time_of(const nlohmann::json &event) const {
        return of_.time.now() - of_.box.boottime() +
               static_cast<time_ns>(1e9 * event.at("boot_s").get<double>());
    }
    // A request by SIGHUP is one for the file that is read then, which may have to wait for rest.
    // While it waits, another request has no event of its own.
    void judge_request(const nlohmann::json &event) {
        const time_ns at = time_of(event);
        const nlohmann::json &revision = event.at("file").at("revision");
        time_ns from = std::min(at, since_ns_.at(revision.dump())) - 10 * second;
        // That it waits may have been left out.
        for (const time_ns one : files_left_out_)
            if (one < at && one > from - 60 * second) from = std::min(from, one - 10 * second);
        const bool is_known =
            std::any_of(hung_ups_.begin(), hung_ups_.end(),
                        [at, from](time_ns one) { return one < at + second && one > from; });
        if (is_known) requested_.insert(revision.dump());
        if (requested_.count(revision.dump()) > 0) return;
        violated("nobody requested this by a signal: " + event.value("text", ""));
    }
    // A line of some seconds ago is on the disk, perhaps under another name.
    void judge_durable() {
        const std::shared_ptr<const node> file = of_.box.files.find(run::events_path, false),
                                          before = put_aside();
        const std::size_t bytes = std::max(file == nullptr ? 0 : file->bytes.size(),
                                           before == nullptr ? 0 : before->bytes.size());
        if (whole_.size() > durable_s && bytes < whole_.front().second && longest_lag(of_) == 0 &&
            !draws_any(of_, {fault_kind::disk, fault_kind::refuse, fault_kind::links,
                             fault_kind::partial}))
            violated(fmt::format("{} bytes of events are left of {} of {} ms before", bytes,
                                 whole_.front().second,
                                 (of_.time.now() - whole_.front().first) / ms));
        whole_.clear();
    }
    std::vector<std::string> lines() const {
        const auto file = of_.box.files.find(run::events_path, false);
        return formats::split(file == nullptr ? std::string() : file->bytes, '\n');
    }
    // What a full disk has torn is none.
    std::ptrdiff_t whole_lines_from(std::size_t first) const {
        const std::vector<std::string> all = lines();
        const auto is_whole = [](const std::string &line) {
            return !line.empty() && line.back() == '}';
        };
        const std::size_t from = std::min(first, all.size());
        return std::count_if(all.begin() + static_cast<std::ptrdiff_t>(from), all.end(), is_whole);
    }
    std::shared_ptr<const node> put_aside() const {
        return of_.box.files.find(std::string(run::events_path) + ".1", false);
    }
    // out: another file has the name of the one that is put aside than at the last call
    bool was_put_aside() {
        const auto before = put_aside();
        const std::size_t bytes = before == nullptr ? 0 : before->bytes.size();
        return std::exchange(aside_bytes_, bytes) != bytes;
    }
    // A long file takes another name (docs/events.md), with all of its lines.
    bool is_rotated() const {
        const auto before = put_aside();
        return before != nullptr && formats::split(before->bytes, '\n').size() >= lines_;
    }
    // A power cut between its two names left the file under both; then it takes the other one
    // again.
    bool is_rotated_again(std::size_t lines) const {
        const auto before = put_aside();
        return lines < lines_ && before != nullptr &&
               formats::split(before->bytes, '\n').size() == lines_;
    }
    std::map<std::string, std::string> hashes_;  // of files, by their check sum
    std::set<std::string> boots_;                // starts of the computer
    std::size_t lines_ = 0;
    std::size_t safe_ = 0;  // of a daemon that ended with 0
    std::size_t aside_bytes_ = 0;
    static constexpr std::size_t durable_s = 4;
    std::deque<std::pair<time_ns, std::size_t>> whole_;  // bytes of the file, each second of late
    std::vector<time_ns> hung_ups_;                      // SIGHUPs, of each step the last
    std::map<std::string, time_ns> since_ns_;            // the first event of each revision
    std::vector<time_ns> files_left_out_;                // lines about them
    std::set<std::string> requested_;                    // revisions, by one of them
    std::uint64_t lost_ = 0, left_out_ = 0;              // by this daemon
    std::vector<std::pair<time_ns, std::string>> said_;  // lines of its log
    std::uint64_t told_ = 0;                             // its events: …
    time_ns first_ns_ = never, last_ns_ = never;         // … the first, and the last one
    std::string last_text_;
    std::optional<std::size_t> full_at_;  // lines of the file when the disk was full for the next
    bool rotated_ = false;                // the file before has some of its events
    static constexpr std::uint64_t most_untold = 2;  // of the lines that are left out
    static constexpr std::uint64_t few = 15;  // changes, whose events the log's limit lets pass
    std::uint64_t modes_ = 0, changes_ = 0;   // events of this daemon; what the PLC saw
    bool gives_up_ = false;                   // the thread that writes them stands at the end
    std::optional<unsigned> mode_;
    std::string told_mode_;
    std::optional<unsigned> untold_;  // revision that was taken last
};

}  // namespace

void add_events(run &of, invariants &all) {
    all.push_back(std::make_unique<events_invariant>(of));
}

}  // namespace compbox::world
