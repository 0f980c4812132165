// SPDX-License-Identifier: MIT
#include "host-tools/metrology/probed_record.h"

#include <strings.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host-tools/formats/error.h"

namespace compbox::metrology {

namespace {

constexpr const char *probe_prefix = "probe_", *count_suffix = "_n";

struct placed_probe {
    std::string error;         // error_X_um
    std::size_t value, count;  // columns of the record
    int compensation;          // -1: not used
    std::string value_name, count_name;
};

// One measurement of one probe.
struct measured {
    std::size_t row;
    double error_um;
};

bool starts(const std::string &name, const std::string &with) {
    return name.compare(0, with.size(), with) == 0;
}

bool ends(const std::string &name, const std::string &with) {
    return name.size() > with.size() &&
           name.compare(name.size() - with.size(), with.size(), with) == 0;
}

// "x" or "error_X_um" -> "X", if the record has comp_X_um; else the text itself
std::string channel_of(const formats::csv_table &record, std::string text) {
    if (starts(text, "error_") && ends(text, "_um")) text = text.substr(6, text.size() - 9);
    for (const auto &name : record.names) {
        if (!starts(name, "comp_") || !ends(name, "_um")) continue;
        const std::string channel = name.substr(5, name.size() - 8);
        if (strcasecmp(channel.c_str(), text.c_str()) == 0) return channel;
    }
    return text;
}

// Throws input_error for a column or a channel that the record does not have.
placed_probe place(const formats::csv_table &record, const probe_columns &probe,
                   const join_options &options) {
    placed_probe placed;
    placed.error = "error_" + probe.channel + "_um";
    placed.value = record.column(probe.value), placed.count = record.column(probe.count);
    placed.value_name = probe.value, placed.count_name = probe.count;
    const std::string compensation = "comp_" + probe.channel + "_um";
    placed.compensation = options.add_back ? record.find(compensation) : -1;
    if (options.add_back && placed.compensation < 0) {
        throw input_error(record.file, 0, 0,
                          "has no column {}, which must be subtracted from {}: name the channel "
                          "with --probe CHANNEL={},{}, or leave the values as they are with "
                          "--keep-compensated",
                          compensation, probe.value, probe.value, probe.count);
    }
    return placed;
}

// out: the compensation that the probe saw: of the row before the new count, when it was measured,
//      unless that row is long ago
double active_at(const formats::csv_table &record, const placed_probe &probe, std::size_t time,
                 std::size_t row, const join_options &options) {
    if (probe.compensation < 0) return 0.0;
    const auto column = static_cast<std::size_t>(probe.compensation);
    const bool fresh =
        record.rows[row][time] - record.rows[row - 1][time] <= options.longest_gap_s &&
        !std::isnan(record.rows[row - 1][column]);
    return record.rows[fresh ? row - 1 : row][column];
}

// out: one measurement for each new count with a value; unknown counts those without
std::vector<measured> measurements_of(const formats::csv_table &record, const placed_probe &probe,
                                      std::size_t time, const join_options &options,
                                      std::size_t &unknown) {
    std::vector<measured> all;
    std::optional<double> known;
    for (std::size_t r = 0; r < record.rows.size(); ++r) {
        const double count = record.rows[r][probe.count];
        if (std::isnan(count)) continue;
        const bool is_new = known && is_new_count(*known, count);
        known = count;
        if (!is_new) continue;
        const double error =
            record.rows[r][probe.value] - active_at(record, probe, time, r, options);
        if (std::isnan(error)) {
            ++unknown;
        } else {
            all.push_back({r, error});
        }
    }
    return all;
}

bool is_input(const std::string &name, const std::vector<placed_probe> &probes) {
    if (starts(name, "comp_") || starts(name, "sigma_") || ends(name, "_adapted")) return false;
    if (name == "time_s" || name == "mode" || name == "reason" || name == "unix_s") return false;
    return std::none_of(probes.begin(), probes.end(), [&](const placed_probe &probe) {
        return name == probe.value_name || name == probe.count_name;
    });
}

// out: columns of the record that become inputs
std::vector<std::size_t> inputs_of(const formats::csv_table &record,
                                   const std::vector<placed_probe> &probes,
                                   const join_options &options) {
    std::vector<std::size_t> columns;
    for (const auto &name : options.signals) columns.push_back(record.column(name));
    for (std::size_t c = 0; c < record.names.size() && options.signals.empty(); ++c) {
        const std::string &name = record.names[c];
        if (is_input(name, probes) && !is_iso_name(name)) columns.push_back(record.column(name));
    }
    return columns;
}

// A row of the result: the last row of the record of a group, and each probe's error.
struct group {
    std::size_t row;
    std::vector<double> error_um;  // NaN: not measured
};

// out: measurements of all probes in order of time, those within together_s in one group
std::vector<group> grouped(const formats::csv_table &record, std::size_t time,
                           const std::vector<std::vector<measured>> &all, double together_s) {
    struct entry {
        measured one;
        std::size_t probe;
    };
    std::vector<entry> entries;
    for (std::size_t p = 0; p < all.size(); ++p) {
        for (const measured &one : all[p]) entries.push_back({one, p});
    }
    std::stable_sort(entries.begin(), entries.end(),
                     [](const entry &a, const entry &b) { return a.one.row < b.one.row; });
    std::vector<group> groups;
    double began_s = 0.0;
    for (const entry &one : entries) {
        const double now_s = record.rows[one.one.row][time];
        const bool joins = !groups.empty() && now_s - began_s <= together_s &&
                           std::isnan(groups.back().error_um[one.probe]);
        if (!joins) groups.push_back({0, std::vector<double>(all.size(), NAN)}), began_s = now_s;
        groups.back().row = one.one.row;
        groups.back().error_um[one.probe] = one.one.error_um;
    }
    return groups;
}

void check_rising(const formats::csv_table &record, std::size_t time) {
    for (std::size_t r = 1; r < record.rows.size(); ++r) {
        if (record.rows[r][time] > record.rows[r - 1][time]) continue;
        throw input_error(record.file, record.lines[r], 0, "time_s must rise from row to row");
    }
}

void remark(joined_rows &result, std::size_t unknown, std::size_t alone, double together_s) {
    if (unknown > 0) {
        result.remarks.push_back(
            fmt::format("{} measurements left out: a signal, the probed value or the compensation "
                        "was not known then",
                        unknown));
    }
    if (alone > 0) {
        result.remarks.push_back(fmt::format(
            "{} measurements left out: not every probe measured within {:g} s; name one channel "
            "with --probe to take its measurements alone",
            alone, together_s));
    }
}

}  // namespace

std::vector<probe_columns> find_probes(const formats::csv_table &record) {
    std::vector<probe_columns> found;
    for (const auto &name : record.names) {
        const std::string count = name + count_suffix;
        const bool has_count =
            std::find(record.names.begin(), record.names.end(), count) != record.names.end();
        if (!starts(name, probe_prefix) || !has_count) continue;
        found.push_back({channel_of(record, name.substr(6)), name, count});
    }
    return found;
}

bool is_new_count(double was, double now) {
    constexpr double half_of_counts = 32768.0;
    return now > was || was - now > half_of_counts;
}

joined_rows join_probed_record(const formats::csv_table &record,
                               const std::vector<probe_columns> &probes,
                               const join_options &options) {
    std::vector<placed_probe> placed;
    for (const auto &probe : probes) placed.push_back(place(record, probe, options));
    const std::size_t time = record.column("time_s");
    check_rising(record, time);
    const std::vector<std::size_t> inputs = inputs_of(record, placed, options);
    joined_rows result;
    result.names.push_back("time_s");
    for (const std::size_t c : inputs) result.names.push_back(record.names[c]);
    std::size_t unknown = 0, alone = 0;
    std::vector<std::vector<measured>> all;
    for (const auto &probe : placed) {
        result.names.push_back(probe.error);
        all.push_back(measurements_of(record, probe, time, options, unknown));
    }
    for (const group &one : grouped(record, time, all, options.together_s)) {
        std::vector<double> row{record.rows[one.row][time]};
        for (const std::size_t c : inputs) row.push_back(record.rows[one.row][c]);
        const auto is_unknown = [](double value) { return std::isnan(value); };
        const bool no_input = std::any_of(row.begin(), row.end(), is_unknown);
        const bool no_error = std::any_of(one.error_um.begin(), one.error_um.end(), is_unknown);
        unknown += no_input, alone += !no_input && no_error;
        if (no_input || no_error) continue;
        row.insert(row.end(), one.error_um.begin(), one.error_um.end());
        result.rows.push_back(std::move(row));
    }
    if (result.rows.empty()) {
        throw input_error(record.file, 0, 0,
                          "has no measurement to join: no count of a probe rises while every "
                          "signal is known");
    }
    remark(result, unknown, alone, options.together_s);
    return result;
}

}  // namespace compbox::metrology
