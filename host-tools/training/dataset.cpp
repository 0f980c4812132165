// SPDX-License-Identifier: MIT
#include "host-tools/training/dataset.h"

#include <fnmatch.h>

#include <algorithm>

#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/error.h"
#include "host-tools/training/runs.h"

namespace compbox::training {

namespace {

constexpr std::size_t least_rows = 10;

bool has(const std::vector<std::string> &names, const std::string &name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

// The columns that match one entry of a list: its own name, or a pattern with *. Columns in
// `others` have another role and never match a pattern: t* is no time_s.
std::vector<std::string> matching(const formats::csv_table &table, const std::string &entry,
                                  const std::vector<std::string> &others) {
    if (entry.find('*') == std::string::npos) {
        table.column(entry);
        return {entry};
    }
    std::vector<std::string> found;
    for (const auto &name : table.names) {
        const bool fits = ::fnmatch(entry.c_str(), name.c_str(), 0) == 0;
        if (fits && !has(others, name)) found.push_back(name);
    }
    if (found.empty()) throw input_error(table.file, 0, 0, "no column matches " + entry);
    return found;
}

// Units of columns with brackets: outputs in um or urad, as channels need them; else the machine's.
formats::unit_choice units_for(const data_options &options) {
    return [&options](const std::string &name,
                      const formats::measuring_unit &is) -> formats::wanted_column {
        const bool output = std::any_of(options.outputs.begin(), options.outputs.end(),
                                        [&](const std::string &entry) {
                                            return ::fnmatch(entry.c_str(), name.c_str(), 0) == 0;
                                        });
        if (output && is.of == formats::quantity::length) return {name, formats::find_unit("um")};
        if (output && is.of == formats::quantity::angle) return {name, formats::find_unit("urad")};
        return formats::machine_unit(name, is);
    };
}

// All columns of a list, in its order. Throws if one is repeated or the box rejects its name.
std::vector<std::string> chosen(const formats::csv_table &table,
                                const std::vector<std::string> &entries,
                                const std::vector<std::string> &others) {
    std::vector<std::string> names;
    for (const auto &entry : entries) {
        for (const auto &name : matching(table, entry, others)) {
            if (has(names, name)) {
                throw input_error(table.file, 0, 0, "the column '{}' is named twice", name);
            }
            if (!is_name_of_the_box(name)) {
                throw input_error(table.file, 0, 0,
                                  "the box cannot use the name '{}': rename the column (1 to 23 "
                                  "letters A to Z, digits, _ - .)",
                                  name);
            }
            names.push_back(name);
        }
    }
    return names;
}

Eigen::MatrixXd columns_of(const formats::csv_table &table, const std::vector<std::string> &names) {
    Eigen::MatrixXd values(table.rows.size(), names.size());
    for (std::size_t c = 0; c < names.size(); ++c) {
        const std::size_t column = table.column(names[c]);
        for (std::size_t r = 0; r < table.rows.size(); ++r) {
            values(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) =
                table.rows[r][column];
        }
    }
    return values;
}

void refuse_constant(const Eigen::MatrixXd &values, const std::vector<std::string> &names,
                     const char *what, const std::string &file) {
    for (std::size_t c = 0; c < names.size(); ++c) {
        const auto column = values.col(static_cast<Eigen::Index>(c));
        if (column.maxCoeff() > column.minCoeff()) continue;
        throw input_error(
            file, 0, 0, "the {} '{}' never changes, so nothing can be learnt from it: leave it out",
            what, names[c]);
    }
}

// Runs by the values of their column; "0", "1250", "0#2" …
found_runs runs_of(training_data &data, const formats::csv_table &table,
                   const data_options &options,
                   const std::vector<std::vector<std::string>> &words) {
    const std::string &column = options.run_column;
    std::vector<double> time_s;
    if (options.needs_time) time_s = table.values(options.time_column);
    if (column.empty()) {
        data.run_names = {"all"};
        return find_runs(std::vector<double>(table.rows.size(), 0.0), time_s, column);
    }
    const std::size_t index = table.column(column);
    const found_runs found = find_runs(table.values(column), time_s, column);
    for (std::size_t k = 0; k < found.values.size(); ++k) {
        const double value = found.values[k];
        std::string name = words[index].empty() ? fmt::format("{}", value)
                                                : words[index][static_cast<std::size_t>(value)];
        if (found.times[k] > 1) name += fmt::format("#{}", found.times[k]);
        data.run_names.push_back(name);
    }
    return found;
}

// Rows in the order of the runs.
void take_rows(training_data &data, const formats::csv_table &table, const data_options &options,
               const found_runs &found) {
    data.run = found.run;
    data.run_starts = found.starts;
    data.file_row = found.row;
    data.reordered = found.reordered;
    data.note = found.note;
    data.x = Eigen::MatrixXd(columns_of(table, data.inputs)(found.row, Eigen::all));
    data.y = Eigen::MatrixXd(columns_of(table, data.outputs)(found.row, Eigen::all));
    if (!options.needs_time) return;
    const std::vector<double> time_s = table.values(options.time_column);
    for (const std::size_t row : found.row) data.time_s.push_back(time_s[row]);
}

void check_time(const training_data &data, const formats::csv_table &table,
                const std::string &column) {
    for (std::size_t r = 1; r < data.time_s.size(); ++r) {
        if (data.run[r] != data.run[r - 1] || data.time_s[r] > data.time_s[r - 1]) continue;
        throw input_error(table.file, table.lines[data.file_row[r]], 0,
                          column +
                              " must rise from row to row; where another run begins, name "
                              "the column of runs with --run-column");
    }
}

// in : options.record, a file with the time and all inputs
// out: history_s and history; throws input_error if its time does not rise or a row's time is
//      outside
void take_history(training_data &data, const data_options &options) {
    const formats::csv_table table = formats::read_csv(options.record);
    data.history_s = table.values(options.time_column);
    data.history = columns_of(table, data.inputs);
    for (std::size_t r = 1; r < data.history_s.size(); ++r) {
        if (data.history_s[r] > data.history_s[r - 1]) continue;
        throw input_error(table.file, table.lines[r], 0,
                          options.time_column + " must rise from row to row");
    }
    for (const double time_s : data.time_s) {
        if (!data.history_s.empty() && time_s >= data.history_s.front() &&
            time_s <= data.history_s.back()) {
            continue;
        }
        throw input_error(table.file, 0, 0,
                          "does not reach to {} {} of {}: it must be the record of these rows",
                          options.time_column, time_s, data.file);
    }
}

}  // namespace

bool is_name_of_the_box(const std::string &name) {
    const auto allowed = [](char c) {
        return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ||
               c == '_' || c == '-' || c == '.';
    };
    return !name.empty() && name.size() <= longest_name &&
           std::all_of(name.begin(), name.end(), allowed);
}

training_data read_training_data(const std::string &path, const data_options &options) {
    std::vector<std::vector<std::string>> words;
    const bool run_is_input = std::find(options.inputs.begin(), options.inputs.end(),
                                        options.run_column) != options.inputs.end();
    std::vector<std::string> word_columns;
    if (!options.run_column.empty() && !run_is_input) word_columns.push_back(options.run_column);
    formats::csv_reading how;
    how.words = word_columns;
    how.units = units_for(options);
    const formats::csv_table table = formats::read_csv(path, how, &words);
    training_data data;
    data.file = path;
    std::vector<std::string> others{options.time_column, options.run_column};
    data.outputs = chosen(table, options.outputs, others);
    others.insert(others.end(), data.outputs.begin(), data.outputs.end());
    data.inputs = chosen(table, options.inputs, others);
    for (const auto &name : data.outputs) {
        if (std::find(data.inputs.begin(), data.inputs.end(), name) == data.inputs.end()) continue;
        throw input_error(path, 0, 0, "the column '{}' is both input and output", name);
    }
    if (table.rows.size() < least_rows) {
        throw input_error(path, 0, 0, "has {} rows; training needs {} at least", table.rows.size(),
                          least_rows);
    }
    take_rows(data, table, options, runs_of(data, table, options, words));
    refuse_constant(data.x, data.inputs, "input", path);
    refuse_constant(data.y, data.outputs, "output", path);
    check_time(data, table, options.time_column);
    if (!options.record.empty()) take_history(data, options);
    return data;
}

}  // namespace compbox::training
