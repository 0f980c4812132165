// SPDX-License-Identifier: MIT
// The rows of record and black box are what happened (docs/record.md): each has the mode, the
// reason and the outputs of a block that the box sent then, and the signals of a reading. Each
// change of mode or reason has a row, and each lag is where its signal leads it. No
// row is in two files of the black box.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "host-tools/coefficients/load.h"
#include "host-tools/formats/text.h"
#include "host-tools/simulation/replay.h"
#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/reference.h"
#include "tests/world/run.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::world {

namespace {

// A text with a header, row by row.
class row_reader {
  public:
    explicit row_reader(const std::string &text) : lines_(formats::split(text, '\n')) {
        const std::vector<std::string> names = formats::split(lines_.at(0), ',');
        for (std::size_t i = 0; i < names.size(); ++i) columns_[names[i]] = i;
    }
    // out: false: there is no further whole row
    bool next() {
        if (++at_ + 1 >= lines_.size()) return false;
        cells_ = formats::split(lines_[at_], ',');
        return cells_.size() == columns_.size();
    }
    bool has(const std::string &column) const {
        const auto found = columns_.find(column);
        return found != columns_.end() && !cells_[found->second].empty();
    }
    const std::string &text(const std::string &column) const { return cells_[columns_.at(column)]; }
    double number(const std::string &column) const { return std::atof(text(column).c_str()); }

  private:
    std::vector<std::string> lines_, cells_;
    std::map<std::string, std::size_t> columns_;
    std::size_t at_ = 0;
};

class rows_invariant : public invariant {
  public:
    explicit rows_invariant(run &of)
        : invariant(of, "rows"),
          calm_(longest_lag(of) == 0 &&
                !draws_any(of, {fault_kind::clock, fault_kind::reload, fault_kind::hostile,
                                fault_kind::memory, fault_kind::loss, fault_kind::reset,
                                fault_kind::tear, fault_kind::partial, fault_kind::wire,
                                fault_kind::line, fault_kind::plc_stop, fault_kind::foreign,
                                fault_kind::exception, fault_kind::mute, fault_kind::stray,
                                fault_kind::boundary, fault_kind::twice, fault_kind::disk})),
          lags_judged_(
              longest_lag(of) == 0 &&
              !(draws(of, fault_kind::reload) && of.box_machine.changes_lags) &&
              !draws_any(of, {fault_kind::clock, fault_kind::hostile, fault_kind::memory})) {}
    void started() override {
        sent_.clear();
        read_.clear();
        start_s_ = 1e-9 * static_cast<double>(of_.box.wall());
        if (known_.empty()) known_ = blackbox_names();
        waits_ = true;
        columns_s_ = -1;
    }
    void taken(const machine &was, const machine &is) override {
        if (names_of_signals(was) != names_of_signals(is))
            columns_s_ = 1e-9 * static_cast<double>(of_.box.wall());
    }
    void ticked() override {
        const double now_s = 1e-9 * static_cast<double>(of_.box.wall());
        const bool stood = now_s > std::exchange(tick_s_, now_s) + 1;
        if (std::exchange(waits_, false) || stood) loops_s_.push_back(now_s);
    }
    void exchanged(const exchange &seen) override {
        const bool judged = calm_ && of_.keeps_record();
        if (!judged || sent_.size() > most_remembered) return;
        const machine &facts = of_.running_at(seen.sent);
        const double sent_s =
            1e-9 * static_cast<double>(of_.box.wall() - (of_.time.now() - seen.sent));
        if (!seen.written.empty()) sent_.push_back({sent_s, block_of(facts, seen)});
        if (!is_reading(facts, seen) || seen.duration == never) return;
        std::vector<double> values;
        for (const fakeplc::shown_signal &signal : facts.map.signals)
            values.push_back(signal_in(facts, signal, seen));
        read_.push_back({sent_s, values});
    }
    void ended(const ending &how) override {
        ends_s_.push_back(1e-9 * static_cast<double>(of_.box.wall()));
        check_blackbox(how.power_cut);
        if (calm_ && sent_.size() <= most_remembered) check_history();
        const std::string text = of_.box.files.text(run::record_path);
        if (text.empty() || how.power_cut) return;
        if (lags_judged_ && of_.records_each_cycle()) check_lags(text);
        if (!how.by_signal) check_columns(text);
        if (!how.by_signal && how.code == 0) check_last(text);
        if (!calm_ || sent_.size() > most_remembered) return;
        check_record(text);
    }

  private:
    struct sent_block {
        double s;
        written_block block;
    };
    struct reading {
        double s;
        std::vector<double> values;
    };
    static constexpr std::size_t most_remembered = 25000;
    static constexpr double late_s = 5e-3;  // from a wake-up to its reading
    static constexpr double kept_before_event_s = 600;
    // The first tick of each daemon, and of a loop that stood still; each daemon's end.
    std::vector<double> loops_s_, ends_s_;
    double tick_s_ = 0;
    double columns_s_ = -1;           // since then the record has its columns; -1: before
    double start_s_ = 0;              // of this daemon …
    bool waits_ = false;              // … and its loop has not begun yet
    std::vector<std::string> known_;  // of the black box

    // Files by their number; the time of their rows goes on.
    void check_blackbox(bool power_cut) {
        if (longest_lag(of_) == never || draws(of_, fault_kind::clock)) return;
        const std::vector<std::string> names = blackbox_names();
        // What was removed just before a power cut may be back, until the next start.
        if (longest_lag(of_) == 0 && !power_cut) check_oldest(names);
        double before_s = -1;
        std::string rest_of;  // a file that has not all seconds behind an event
        std::vector<double> ends_s;
        for (const std::string &file : names) {
            row_reader rows(of_.box.files.text(fmt::format("{}/{}", run::blackbox_path, file)));
            double first_s = -1, last_s = before_s, first_event_s = -1, event_s = -1;
            int mode = -1;
            if (is_requested(file)) event_s = first_event_s = request_of(begun_s(file));
            while (rows.next()) {
                if (rows.number("unix_s") <= before_s)
                    violated(fmt::format("{} has rows of the file before it", file));
                last_s = rows.number("unix_s");
                if (first_s < 0) first_s = last_s;
                // What goes on where the file before it ends may be due to an event of that one.
                if (mode < 0 && last_s < before_s + 1) first_event_s = last_s;
                const auto is = static_cast<int>(rows.number("mode"));
                const bool begins =
                    is != mode && (is == fakeplc::box_mode::hold || is == fakeplc::box_mode::fault);
                if (begins && mode >= 0) event_s = last_s;
                if (first_event_s < 0) first_event_s = event_s;
                mode = is;
            }
            const bool is_full = first_event_s - first_s > kept_before_event_s - 10;
            if (first_s >= 0 && !is_full) check_begin(file, before_s, first_s);
            if (longest_lag(of_) == 0) {
                const bool goes_on = first_s <= before_s + 2 && begun_s(file) <= before_s + 5;
                if (first_s >= 0) check_rest(rest_of, goes_on);
                check_end(file, last_s, first_event_s, event_s);
            }
            before_s = last_s;
            ends_s.push_back(last_s);
            rest_of =
                event_s >= 0 && last_s < event_s + 9 && !is_cut(last_s, event_s + 25) ? file : "";
        }
        if (longest_lag(of_) == 0) check_rest(rest_of, false);
        for (const double asked_s : of_.requests_s) check_request(asked_s, names, ends_s);
    }
    static bool is_requested(const std::string &file) {
        return file.find("-REQUEST.") != std::string::npos;
    }
    // out: the newest request before that time; -1: none
    double request_of(double begun_s) const {
        double newest_s = -1;
        for (const double asked_s : of_.requests_s)
            if (asked_s < begun_s + 2) newest_s = asked_s;
        return newest_s;
    }
    // One that is being written has the rows of a request too, another one begins at once. It has
    // its name when it is whole, a minute later at most. in : ends_s: the newest row of each file
    void check_request(double asked_s, const std::vector<std::string> &names,
                       const std::vector<double> &ends_s) {
        if (longest_lag(of_) != 0 || loses_rows() || is_cut(asked_s, asked_s + 75) ||
            names.empty() || begun_s(names.front()) > asked_s || may_lack_rows(of_))
            return;
        for (std::size_t i = 0; i < names.size(); ++i) {
            const double ahead_s = begun_s(names[i]) - asked_s;
            if (ahead_s < (is_requested(names[i]) ? 3 : 1) && ends_s[i] > asked_s + 0.5) return;
        }
        violated(fmt::format("a file was requested at {} s, and none begins", asked_s));
    }
    // Seconds behind an event for which its file had no time left are in the next one, which begins
    // at once.
    void check_rest(const std::string &rest_of, bool goes_on) {
        if (!rest_of.empty() && !goes_on && !loses_rows() &&
            !draws_any(of_, {fault_kind::reload, fault_kind::hostile, fault_kind::disk}))
            violated(fmt::format("{} ends soon behind an event, and no file goes on", rest_of));
    }
    // out: the wall clock in a file's name, as the record's unix_s
    static double begun_s(const std::string &file) {
        std::tm utc = {};
        if (std::sscanf(file.c_str(), "%*6u-%4d%2d%2dT%2d%2d%2dZ", &utc.tm_year, &utc.tm_mon,
                        &utc.tm_mday, &utc.tm_hour, &utc.tm_min, &utc.tm_sec) != 6)
            return std::nan("");
        utc.tm_year -= 1900;
        utc.tm_mon -= 1;
        return static_cast<double>(timegm(&utc));
    }
    // out: a daemon ended then
    bool is_cut(double from_s, double to_s) const {
        return std::any_of(ends_s_.begin(), ends_s_.end(),
                           [=](double end_s) { return end_s > from_s - 2 && end_s < to_s; });
    }
    // out: of its own files, by their number
    std::vector<std::string> blackbox_names() const {
        constexpr std::size_t length = sizeof "000001-20200101T000000Z-FAULT.csv" - 1;
        std::vector<std::string> names;
        for (const std::string &file : of_.box.files.names_in(run::blackbox_path))
            if (file.size() >= length - 1 && file[6] == '-' &&
                file.substr(file.size() - 4) == ".csv")
                names.push_back(file);
        std::sort(names.begin(), names.end());
        return names;
    }
    // The box keeps a number of files at most: to write another one it removes the oldest.
    void check_oldest(const std::vector<std::string> &names) {
        if (names.size() > run::blackbox_files)
            violated(fmt::format("the black box has {} files", names.size()));
        const bool stays = !draws(of_, fault_kind::power_cut);
        for (const std::string &file : known_)
            if (stays && !names.empty() && file > names.front() &&
                !std::binary_search(names.begin(), names.end(), file))
                violated(fmt::format("{} is gone, the older {} is there", file, names.front()));
        known_ = names;
    }
    // It begins where the one before it ends, or with its loop: also where a file between them
    // could not be written, be it the first one.
    void check_begin(const std::string &file, double before_s, double first_s) {
        if (before_s < 0 && file.compare(0, 6, "000001") != 0) return;  // older ones are gone
        double begin_s = before_s;
        for (const double loop_s : loops_s_)
            if (loop_s < first_s) begin_s = std::max(begin_s, loop_s);
        if (first_s < begin_s + 2 || loses_rows() ||
            draws_any(of_, {fault_kind::reload, fault_kind::hostile, fault_kind::boundary}))
            return;
        violated(fmt::format("{} begins {} s behind the end of the one before, or of the start",
                             file, first_s - begin_s));
    }
    // A disk that hangs for a minute does.
    bool loses_rows() const {
        const auto all = finished_statistics();
        return draws(of_, fault_kind::disk) && (all.is_null() || all.value("rows_lost", 1) > 0);
    }
    // Ten seconds behind its newest event, and a minute at most (docs/record.md). An end of the
    // daemon, or other columns, end it too.
    void check_end(const std::string &file, double last_s, double first_event_s, double event_s) {
        const double least_s = std::min(event_s + 10, first_event_s + 60) - 1;
        if (event_s < 0 || is_cut(last_s, last_s + 15) || last_s >= least_s || loses_rows() ||
            draws_any(of_, {fault_kind::reload, fault_kind::hostile}))
            return;
        violated(fmt::format("{} ends {} s behind an event", file, last_s - event_s));
    }

    static std::vector<std::string> names_of_signals(const machine &of) {
        std::vector<std::string> names;
        for (const auto &signal : of.file().at("signals")) names.push_back(signal.at("name"));
        return names;
    }
    // The last row and the last snapshot are of the same cycle.
    void check_last(const std::string &record) {
        const nlohmann::json snapshot = finished_snapshot();
        if (snapshot.is_null() || !of_.records_each_cycle() ||
            draws_any(of_, {fault_kind::disk, fault_kind::refuse, fault_kind::partial,
                            fault_kind::links, fault_kind::hostile, fault_kind::memory}))
            return;
        const std::string header = record.substr(0, record.find('\n') + 1);
        row_reader last(header + record.substr(record.rfind('\n', record.size() - 2) + 1));
        if (record.size() == header.size() || !last.next()) return;
        for (const auto &signal : snapshot.at("signals"))
            check_cell(last, signal.at("name"), signal.at("value"));
        for (const auto &term : snapshot.at("terms")) {
            const std::string output = term.at("name");
            check_cell(last, output, term.at("value"));
            if (!term.at("sigma_um").is_null())
                check_cell(last, "sigma_" + output, term.at("sigma_um"));
        }
        for (const auto &adapted : snapshot.value("adapted", nlohmann::json::array()))
            check_cell(last, "sigma_" + adapted.at("name").get<std::string>(),
                       adapted.at("sigma_um"));
        for (const auto &channel : snapshot.at("channels"))
            check_cell(last, fmt::format("comp_{}_um", channel.at("name").get<std::string>()),
                       channel.at("output_um"));
    }
    void check_cell(const row_reader &row, const std::string &column, const nlohmann::json &shown) {
        const bool is_there = row.has(column);
        if (is_there == shown.is_number() &&
            (!is_there || std::fabs(row.number(column) - shown.get<double>()) <=
                              1e-6 * std::fabs(row.number(column))))
            return;
        violated(fmt::format("the last row has {} in {}, and the snapshot {}",
                             is_there ? row.text(column) : "nothing", column, shown.dump()));
    }
    // Rows of the columns before are in the record before.
    void check_columns(const std::string &record) {
        row_reader rows(record);
        if (columns_s_ < 0 || !rows.next() || longest_lag(of_) != 0 ||
            draws_any(of_,
                      {fault_kind::disk, fault_kind::refuse, fault_kind::links, fault_kind::partial,
                       fault_kind::clock, fault_kind::hostile, fault_kind::memory}))
            return;
        const double period_s = 1e-6 * static_cast<double>(of_.running().period_us);
        if (rows.number("unix_s") < columns_s_ - 0.6 * period_s)
            violated(fmt::format("a record begins with a row of {} s before its columns",
                                 columns_s_ - rows.number("unix_s")));
    }

    // Each change of mode or reason that the PLC got is in the statistics.
    void check_history() {
        const auto all = finished_statistics();
        if (all.is_null() || !all.contains("history")) return;
        std::size_t changes = 0;
        for (std::size_t i = 1; i < sent_.size(); ++i)
            changes += sent_[i].block.mode != sent_[i - 1].block.mode ||
                       sent_[i].block.reason != sent_[i - 1].block.reason;
        const auto kept = all.at("history").size() + all.value("history_left_out", std::size_t{0});
        if (kept < changes)
            violated(
                fmt::format("the history has {} entries, the PLC got {} changes", kept, changes));
    }

    // Rows of this daemon, against what it sent and got.
    void check_record(const std::string &text) {
        row_reader rows(text);
        std::size_t first_sent = 0, first_read = 0;
        const machine &facts = of_.running();
        const double period_s = 1e-6 * static_cast<double>(facts.period_us);
        while (rows.next()) {
            const double at_s = rows.number("unix_s");
            if (at_s < start_s_ - 1e-3) continue;
            while (first_sent < sent_.size() && sent_[first_sent].s < at_s - 2e-3) ++first_sent;
            while (first_read < read_.size() && read_[first_read].s < at_s - 2e-3) ++first_read;
            check_outputs(facts, rows, first_sent, at_s + 2.1 * period_s);
            check_signals(facts, rows, first_read, at_s + 0.9 * period_s);
            kept_.push_back({at_s, {rows.number("mode"), rows.number("reason")}});
        }
        check_changes(2.1 * period_s);
        kept_.clear();
    }
    // in : kept_: time, mode and reason of the rows
    void check_changes(double before_s) {
        std::size_t row = 0;
        for (std::size_t i = 1; i < sent_.size(); ++i) {
            const written_block &was = sent_[i - 1].block, &is = sent_[i].block;
            const double s = sent_[i].s;
            if ((is.mode == was.mode && is.reason == was.reason) || kept_.empty() ||
                s - before_s < kept_.front().s || s > kept_.back().s)
                continue;
            while (kept_[row].s < s - before_s) ++row;
            bool found = false;
            for (std::size_t k = row; k < kept_.size() && kept_[k].s < s + 2e-3; ++k)
                found = found || (kept_[k].values[0] == static_cast<double>(is.mode) &&
                                  kept_[k].values[1] == static_cast<double>(is.reason));
            if (!found)
                violated(fmt::format("no row has the change to mode {} and reason {}", is.mode,
                                     is.reason));
        }
    }

    // By each two rows. Whether a row had a reading is not known: the lag goes on from the row
    // before or from the last one that changed, which the first rows of a file do not know. The
    // first row with a value behind rows without one has its reading.
    void check_lags(const std::string &text) {
        struct lag {
            std::string name, of;
            bool squares;
            double tau_s, y = 0, u = 0, at_s = -1, before_s = -1;
            bool is_missing = false;
        };
        std::vector<lag> lags;
        const nlohmann::json &file = of_.box_machine.file();
        for (const auto &entry : file.at("signals"))
            if (entry.contains("lag_of") && !may_be_doubted(of_, entry.at("lag_of")))
                lags.push_back({entry.at("name"), entry.at("lag_of"), entry.value("power", 1) == 2,
                                entry.at("tau_s")});
        row_reader rows(text);
        while (rows.next()) {
            if (rows.number("unix_s") < start_s_ - 1e-3) continue;
            const double now_s = rows.number("time_s");
            for (lag &one : lags) {
                const bool was_missing = one.is_missing;
                one.is_missing = !rows.has(one.name) || !rows.has(one.of);
                if (one.is_missing) continue;
                const double y = rows.number(one.name), x = rows.number(one.of);
                const double u = one.squares ? x * x : x;
                const bool same = y == one.y && u == one.u;
                if (one.at_s >= 0 && !same) {
                    const double a = lagged(one.y, one.u, u, now_s - one.at_s, one.tau_s);
                    const double b = lagged(one.y, one.u, u, now_s - one.before_s, one.tau_s);
                    const double near = 1e-5 + 4e-6 * std::fabs(u) +
                                        (std::fabs(u - one.y) + std::fabs(u - one.u)) *
                                            std::min(1.0, late_s / one.tau_s);
                    if (y < std::min(a, b) - near || y > std::max(a, b) + near)
                        violated(fmt::format("{} is {} at {} s, behind {} it is {} or {}", one.name,
                                             y, now_s, one.y, a, b));
                }
                if (was_missing || (!same && one.before_s >= 0)) one.at_s = now_s;
                one.before_s = now_s;
                one.y = y;
                one.u = u;
            }
        }
    }
    // With FC23 the next cycle sends what a step computed. Before its first block a daemon may send
    // none: it has no PLC yet.
    void check_outputs(const machine &facts, const row_reader &rows, std::size_t first,
                       double until_s) {
        bool any = false;
        if (first == 0) return;
        for (std::size_t i = first; i < sent_.size() && sent_[i].s < until_s; ++i) {
            if (is_of(facts, rows, sent_[i].block)) return;
            any = true;
        }
        // The last cycle's block may be sent by none.
        if (any && sent_.back().s > until_s)
            violated(fmt::format("no block has the outputs, mode {} and reason {} of the row at {}",
                                 rows.number("mode"), rows.number("reason"),
                                 rows.number("time_s")));
    }
    static bool is_of(const machine &facts, const row_reader &rows, const written_block &block) {
        if (static_cast<double>(block.mode) != rows.number("mode") ||
            static_cast<double>(block.reason) != rows.number("reason"))
            return false;
        for (std::size_t c = 0; c < facts.channels.size(); ++c) {
            const std::string column = fmt::format("comp_{}_um", facts.channels[c].name);
            if (!rows.has(column)) return false;
            const double um = rows.number(column);
            if (std::fabs(um - block.um[c]) > 1e-5 * std::fabs(um) + 1e-5) return false;
        }
        return true;
    }
    // A refused value leaves the one before.
    void check_signals(const machine &facts, const row_reader &rows, std::size_t first,
                       double until_s) {
        if (draws(of_, fault_kind::sensors) || first >= read_.size() || first == 0 ||
            read_[first].s > until_s)
            return;
        const auto in_range = [](const fakeplc::shown_signal &of, double value) {
            return value > of.min.value_or(-1e30) && value < of.max.value_or(1e30);
        };
        for (std::size_t i = 0; i < facts.map.signals.size(); ++i) {
            const std::string &signal = facts.map.signals[i].name;
            const bool rated =
                std::find(facts.rated.begin(), facts.rated.end(), signal) != facts.rated.end();
            const double is = read_[first].values[i], was = read_[first - 1].values[i];
            const bool good =
                in_range(facts.map.signals[i], is) && in_range(facts.map.signals[i], was);
            if (rated || !good || !rows.has(signal)) continue;
            const double value = rows.number(signal);
            const double zero = std::fabs(facts.map.signals[i].zero);  // float32 adds it
            const double near = 1e-6 * (std::fabs(is) + zero) + 1e-5;
            if (std::fabs(value - is) > near && std::fabs(value - was) > near)
                violated(fmt::format("{} is {} in the row at {}, the reading has {}", signal, value,
                                     rows.number("time_s"), is));
        }
    }

    bool calm_, lags_judged_;
    std::vector<sent_block> sent_;  // by this daemon, by the wall clock
    std::vector<reading> read_, kept_;
};

// The recorded inputs are what the PLC gave and got (docs/compboxd.md, "Inputs to the bit"): the
// registers of a row are those of a reading, what it wrote came to the PLC, and nothing was written
// before the first contact. `compbox simulate --replay` gets the bits that the box wrote.
class inputs_invariant : public invariant {
  public:
    explicit inputs_invariant(run &of)
        : invariant(of, "inputs"),
          judged_(of.keeps_inputs() && !hides_exchanges(of) &&
                  !draws_any(of, {fault_kind::reload, fault_kind::disk, fault_kind::boundary,
                                  fault_kind::links})) {}
    void started() override {
        readings_.clear();
        writes_.clear();
        coefficients_.clear();
    }
    void exchanged(const exchange &seen) override {
        const machine &facts = of_.running_at(seen.sent);
        if (coefficients_.empty()) coefficients_ = facts.text;
        if (!judged_) return;
        if (!seen.written.empty()) writes_.insert(hex(seen.written));
        if (is_reading(facts, seen) && seen.duration != never) readings_.insert(hex(seen.read));
    }
    void ended(const ending &how) override {
        if (!of_.keeps_inputs() || how.by_signal || of_.cycles_of_daemon == 0) return;
        const std::string text = of_.box.files.text(run::inputs_path);
        const auto header = text.find("number,");
        if (header == std::string::npos) return;
        if (!coefficients_.empty()) replay(text);
        if (!judged_) return;
        row_reader rows(text.substr(header));
        bool contact = false;
        std::size_t strange = 0;
        while (rows.next()) {
            if (rows.number("read_ok") != 0 && readings_.count(rows.text("registers")) == 0)
                violated("a row of the inputs has registers that no reading had: " +
                         rows.text("registers"));
            if (!contact && rows.number("held") == 1 && rows.number("last_write") != 0)
                violated("a row of the inputs has the result of a write before the first contact");
            contact = contact || rows.number("held") == 1;
            strange += contact && rows.number("read_ok") != 0 && rows.has("written") &&
                       writes_.count(rows.text("written")) == 0;
        }
        // What the last step computed may be sent by none.
        if (strange > 1)
            violated(fmt::format("{} rows of the inputs have a block that the PLC did not get",
                                 strange));
    }

  private:
    void replay(const std::string &text) {
        if (draws_any(of_, {fault_kind::memory, fault_kind::disk, fault_kind::links})) return;
        cb_message message = {};
        const auto config = coefficients::load_coefficient_text(coefficients_, &message);
        if (config == nullptr)
            return violated(fmt::format("the file does not load: {}", message.text));
        try {
            const auto result = simulation::replay(*config, "inputs", text);
            if (!result.difference.empty()) violated("replayed: " + result.difference);
        } catch (const std::exception &wrong) {
            violated(fmt::format("not to be replayed: {}", wrong.what()));
        }
    }
    static std::string hex(const std::vector<std::uint16_t> &words) {
        std::string text;
        for (const std::uint16_t word : words) text += fmt::format("{:04x}", word);
        return text;
    }

    bool judged_;
    std::set<std::string> readings_, writes_;  // of this daemon
    std::string coefficients_;                 // the file that it began with
};

}  // namespace

void add_rows(run &of, invariants &all) {
    all.push_back(std::make_unique<rows_invariant>(of));
    all.push_back(std::make_unique<inputs_invariant>(of));
}

}  // namespace compbox::world
