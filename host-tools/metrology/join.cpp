// SPDX-License-Identifier: MIT
#include "host-tools/metrology/join.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "host-tools/formats/error.h"

namespace compbox::metrology {

namespace {

bool between(const std::string &name, const std::string &start, const std::string &end) {
    return name.size() > start.size() + end.size() && name.compare(0, start.size(), start) == 0 &&
           name.compare(name.size() - end.size(), end.size(), end) == 0;
}

// A probed error and its channel's compensation in the record (-1: not recorded).
struct error_column {
    std::string name;
    std::size_t probe;
    int compensation;
};

struct columns {
    std::vector<std::size_t> signals;  // of the record
    std::vector<error_column> errors;
    std::vector<std::pair<std::size_t, std::size_t>> positions;  // probe, record
    int run = -1, time = -1;                                     // of the probe
    std::size_t record_time = 0;
    std::string left_out;  // outputs of terms in the record, for the remark
};

// "error_X_um" -> "comp_X_um"
std::string compensation_of(const std::string &error) {
    return "comp" + error.substr(std::string("error").size());
}

// out: the selected columns; `left_out` names the terms' outputs that are not selected
std::vector<std::size_t> signal_columns(const formats::csv_table &record,
                                        const join_options &options, std::string &left_out) {
    std::vector<std::size_t> all;
    for (const auto &name : options.signals) all.push_back(record.column(name));
    for (std::size_t c = 0; c < record.names.size() && options.signals.empty(); ++c) {
        const std::string &name = record.names[c];
        const bool frame =
            name == "time_s" || name == "mode" || name == "reason" || name == "unix_s";
        if (frame || between(name, "comp_", "_um") || between(name, "sigma_", "")) continue;
        if (is_iso_name(name)) {
            left_out += (left_out.empty() ? "" : ", ") + name;
        } else {
            all.push_back(record.column(name));
        }
    }
    return all;
}

// out: the columns of both tables by their roles; throws input_error for an unknown column, a
//      missing compensation, or no common time and position
columns find_columns(const formats::csv_table &record, const formats::csv_table &probe,
                     const join_options &options) {
    columns found;
    found.record_time = record.column("time_s");
    found.signals = signal_columns(record, options, found.left_out);
    found.time = probe.find("time_s");
    found.run = probe.find("run");
    for (std::size_t c = 0; c < probe.names.size(); ++c) {
        const std::string &name = probe.names[c];
        if (name == "time_s" || name == "run") continue;
        probe.column(name);  // throws for a cell that is no number
        if (between(name, "error_", "_um")) {
            found.errors.push_back({name, probe.column(name), record.find(compensation_of(name))});
            continue;
        }
        const int position = record.find(name);
        if (position < 0) {
            throw input_error(
                probe.file, 0, 0,
                "the column '{}' is neither time_s, run, error_…_um nor a signal of {}", name,
                record.file);
        }
        found.positions.push_back({probe.column(name), static_cast<std::size_t>(position)});
    }
    if (found.errors.empty()) {
        throw input_error(probe.file, 0, 0,
                          "has no probed error; call its columns error_X_um and so on, after the "
                          "channels");
    }
    for (const auto &error : found.errors) {
        if (error.compensation >= 0 || !options.add_back) continue;
        throw input_error(record.file, 0, 0,
                          "has no column {}, which must be subtracted from {} (--keep-compensated "
                          "leaves the error as it is)",
                          compensation_of(error.name), error.name);
    }
    if (found.time < 0 && found.positions.empty()) {
        throw input_error(probe.file, 0, 0, "has neither time_s nor a position that {} has too",
                          record.file);
    }
    return found;
}

void check_times(const formats::csv_table &record, std::size_t time) {
    for (std::size_t r = 1; r < record.rows.size(); ++r) {
        if (record.rows[r][time] > record.rows[r - 1][time]) continue;
        throw input_error(record.file, record.lines[r], 0, "time_s must rise from row to row");
    }
}

// A moment of the record: a fraction `share` of the way from row `row` to the next.
struct moment {
    std::size_t row = 0;
    double share = 0.0;

    double value(const formats::csv_table &record, std::size_t column) const {
        const double before = record.rows[row][column];
        if (share == 0.0) return before;
        return before + share * (record.rows[row + 1][column] - before);
    }
};

// in : wanted: a time of the record's clock, s; the record's times ascend
// out: its place between two rows; throws input_error outside the record or in a long gap
moment at_time(const formats::csv_table &record, std::size_t time, double wanted,
               const formats::csv_table &probe, std::size_t probe_row,
               const join_options &options) {
    const auto &rows = record.rows;
    const long line = probe.lines[probe_row];
    const double first = rows.front()[time], last = rows.back()[time];
    if (wanted < first || wanted > last) {
        throw input_error(probe.file, line, 0,
                          "time {:.3f} s is outside the recording ({:.3f} to {:.3f} s); "
                          "--time-offset-s brings two clocks together",
                          wanted, first, last);
    }
    const auto above = std::upper_bound(rows.begin(), rows.end(), wanted,
                                        [&](double t, const auto &row) { return t < row[time]; });
    const std::size_t row = static_cast<std::size_t>(above - rows.begin()) - 1;
    if (above == rows.end() || rows[row][time] == wanted) return {row, 0.0};
    const double gap = rows[row + 1][time] - rows[row][time];
    if (gap > options.longest_gap_s) {
        throw input_error(
            probe.file, line, 0,
            "time {:.3f} s falls into a gap of {:.3f} s in the recording (--longest-gap-s)", wanted,
            gap);
    }
    return {row, (wanted - rows[row][time]) / gap};
}

// The middle of the next dwell at the probed place, from row `from` on; `from` moves behind it.
moment at_place(const formats::csv_table &record, const columns &where,
                const formats::csv_table &probe, std::size_t probe_row, const join_options &options,
                std::size_t &from) {
    double nearest = INFINITY;
    const auto distance = [&](std::size_t r) {
        double worst = 0.0;
        for (const auto &[wanted, there] : where.positions) {
            worst =
                std::max(worst, std::fabs(record.rows[r][there] - probe.rows[probe_row][wanted]));
            if (std::isnan(record.rows[r][there])) worst = INFINITY;
        }
        return worst;
    };
    for (std::size_t r = from; r < record.rows.size(); ++r) {
        const double here = distance(r);
        nearest = std::min(nearest, here);
        if (here > options.tolerance_mm) continue;
        std::size_t end = r;
        while (end + 1 < record.rows.size() && distance(end + 1) <= options.tolerance_mm) ++end;
        from = end + 1;
        return {r + (end - r) / 2, 0.0};
    }
    throw input_error(probe.file, probe.lines[probe_row], 0,
                      "from here on the recording never comes within {:g} mm of this place "
                      "(nearest: {:g} mm); rows must be in the order in which they were probed",
                      options.tolerance_mm, nearest);
}

}  // namespace

bool is_iso_name(const std::string &name) {
    return name.size() == 3 && name[0] == 'E' &&
           std::string("XYZABC").find(name[1]) != std::string::npos &&
           std::string("XYZ").find(name[2]) != std::string::npos;
}

joined_rows join_rows(const formats::csv_table &record, const formats::csv_table &probe,
                      const std::vector<std::string> &run_names, const join_options &options) {
    const columns where = find_columns(record, probe, options);
    check_times(record, where.record_time);
    joined_rows result;
    result.by_time = where.time >= 0;
    result.run_names = run_names;
    result.names.push_back("time_s");
    if (where.run >= 0) result.names.push_back("run");
    for (const std::size_t c : where.signals) result.names.push_back(record.names[c]);
    for (const auto &error : where.errors) result.names.push_back(error.name);
    std::size_t from = 0, unknown = 0;
    for (std::size_t r = 0; r < probe.rows.size(); ++r) {
        const auto &row = probe.rows[r];
        const moment now =
            result.by_time
                ? at_time(record, where.record_time,
                          row[static_cast<std::size_t>(where.time)] + options.time_offset_s, probe,
                          r, options)
                : at_place(record, where, probe, r, options, from);
        std::vector<double> joined{now.value(record, where.record_time)};
        if (where.run >= 0) joined.push_back(row[static_cast<std::size_t>(where.run)]);
        for (const std::size_t c : where.signals) joined.push_back(now.value(record, c));
        for (const auto &error : where.errors) {
            const double active =
                options.add_back ? now.value(record, static_cast<std::size_t>(error.compensation))
                                 : 0.0;
            joined.push_back(row[error.probe] - active);
        }
        if (std::any_of(joined.begin(), joined.end(), [](double v) { return std::isnan(v); })) {
            ++unknown;
            continue;
        }
        result.rows.push_back(std::move(joined));
    }
    if (result.rows.empty()) {
        throw input_error(record.file, 0, 0,
                          "at every probed moment a signal had never been received");
    }
    if (unknown > 0) {
        result.remarks.push_back(fmt::format(
            "{} probed rows left out: a signal had not been received by then", unknown));
    }
    if (!where.left_out.empty()) {
        result.remarks.push_back(fmt::format(
            "outputs of terms left out: {} (--signals takes what it names)", where.left_out));
    }
    return result;
}

std::string joined_text(const joined_rows &joined) {
    std::string text;
    for (std::size_t c = 0; c < joined.names.size(); ++c) text += (c ? "," : "") + joined.names[c];
    for (const auto &row : joined.rows) {
        text += '\n';
        for (std::size_t c = 0; c < row.size(); ++c) {
            if (c > 0) text += ',';
            if (joined.names[c] != "run") {
                text += fmt::format("{}", row[c]);
                continue;
            }
            const std::string &name = joined.run_names[static_cast<std::size_t>(row[c])];
            const bool parts = name.find(',') != std::string::npos;
            text += parts ? fmt::format("\"{}\"", name) : name;
        }
    }
    return text + "\n";
}

}  // namespace compbox::metrology
