// SPDX-License-Identifier: MIT
#include "host-tools/training/dataset.h"

#include <fnmatch.h>

#include <algorithm>
#include <set>

#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/error.h"
#include "host-tools/training/bank.h"
#include "host-tools/training/glitches.h"
#include "host-tools/training/parts.h"
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
// errors: the columns in um or urad.
formats::unit_choice units_for(const data_options &options, std::set<std::string> &errors) {
    return [&options, &errors](const std::string &name,
                               const formats::measuring_unit &is) -> formats::wanted_column {
        const bool small_length = is.of == formats::quantity::length && is.factor < 1e3;
        if (small_length || is.of == formats::quantity::angle) errors.insert(name);
        const bool output = std::any_of(options.outputs.begin(), options.outputs.end(),
                                        [&](const std::string &entry) {
                                            return ::fnmatch(entry.c_str(), name.c_str(), 0) == 0;
                                        });
        if (output && is.of == formats::quantity::length) return {name, formats::find_unit("um")};
        if (output && is.of == formats::quantity::angle) return {name, formats::find_unit("urad")};
        return formats::machine_unit(name, is);
    };
}

// All columns of a list, in its order; a pattern leaves out what the list names. Throws if one is
// repeated or the box rejects its name.
std::vector<std::string> chosen(const formats::csv_table &table,
                                const std::vector<std::string> &entries,
                                const std::vector<std::string> &others) {
    std::vector<std::string> names, taken = others;
    taken.insert(taken.end(), entries.begin(), entries.end());
    for (const auto &entry : entries) {
        for (const auto &name : matching(table, entry, taken)) {
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

bool ends_with(const std::string &text, const std::string &end) {
    return text.size() >= end.size() &&
           text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// out: why a column is no input, or "" if it may be one
std::string why_no_input(const formats::csv_table &table, std::size_t column,
                         const std::set<std::string> &errors) {
    const std::string &name = table.names[column];
    if (errors.count(name) > 0 || ends_with(name, "_um") || ends_with(name, "_urad")) {
        return "an error";
    }
    if (column < table.mistakes.size() && !table.mistakes[column].empty()) return "not a number";
    bool rises = true, constant = true;
    for (std::size_t r = 1; r < table.rows.size(); ++r) {
        rises = rises && table.rows[r][column] > table.rows[r - 1][column];
        constant = constant && table.rows[r][column] == table.rows[0][column];
    }
    if (constant) return "never changes";
    if (rises) return "only rises, as a clock";
    return is_name_of_the_box(name) ? "" : "no name for the box";
}

// out: every column that may be an input; remarks: those that may not
std::vector<std::string> all_inputs(const formats::csv_table &table, const data_options &options,
                                    const std::vector<std::string> &others,
                                    const std::set<std::string> &errors, std::string &remark) {
    std::vector<std::string> names;
    for (std::size_t c = 0; c < table.names.size(); ++c) {
        const std::string &name = table.names[c];
        const bool run_is_speed = name == options.run_column && is_name_of_a_speed(name);
        if (has(others, name) && !run_is_speed) continue;
        const std::string why = why_no_input(table, c, errors);
        if (why.empty()) {
            names.push_back(name);
        } else {
            remark += fmt::format("{}{} ({})", remark.empty() ? "no input: " : ", ", name, why);
        }
    }
    if (names.empty()) {
        throw input_error(table.file, 0, 0,
                          "has no column that may be an input: name them with "
                          "--inputs");
    }
    return names;
}

std::vector<std::string> speeds_of(const std::vector<std::string> &inputs,
                                   const std::vector<std::string> &wanted) {
    for (const auto &name : wanted) {
        if (has(inputs, name)) continue;
        throw input_error("--speeds names '" + name + "', which is not among the inputs");
    }
    std::vector<std::string> speeds = wanted;
    for (const auto &name : inputs) {
        if (wanted.empty() && is_name_of_a_speed(name)) speeds.push_back(name);
    }
    return speeds;
}

// in : the runs' values; out: each idle stretch of a speed (0) with the stretch before it, because
// a
//      map that knows the warm-up knows how it cools down
std::vector<std::size_t> with_idling(const std::vector<double> &values, bool of_a_speed) {
    std::vector<std::size_t> together;
    for (std::size_t k = 0; k < values.size(); ++k) {
        together.push_back(of_a_speed && k > 0 && values[k] == 0.0 ? together[k - 1] : k);
    }
    return together;
}

// A table without a column of runs: the stretches of a speed, or parts by time.
found_runs runs_without_column(training_data &data, const formats::csv_table &table,
                               const std::vector<double> &time_s) {
    for (const auto &name : data.speeds) {
        const std::vector<double> speed = table.values(name);
        if (!has_long_steps(Eigen::Map<const Eigen::VectorXd>(
                speed.data(), static_cast<Eigen::Index>(speed.size())))) {
            continue;
        }
        data.remarks.push_back(fmt::format(
            "no column of runs is named, so a run begins where {} changes (--run-column)", name));
        found_runs found = find_runs(speed, time_s, name);
        data.together = with_idling(found.values, true);
        return found;
    }
    const table_parts parts = parts_of(time_s, table.rows.size());
    data.remarks.push_back(fmt::format(
        "no column of runs is named, so the table is cut at {} (--run-column)", parts.what));
    return find_runs(parts.number, time_s, "part");
}

void name_runs(training_data &data, const found_runs &found,
               const std::vector<std::string> &words) {
    for (std::size_t k = 0; k < found.values.size(); ++k) {
        const double value = found.values[k];
        std::string name =
            words.empty() ? fmt::format("{}", value) : words[static_cast<std::size_t>(value)];
        if (found.times[k] > 1) name += fmt::format("#{}", found.times[k]);
        data.run_names.push_back(name);
    }
}

// Runs by the values of their column; "0", "1250", "0#2" …
found_runs runs_of(training_data &data, const formats::csv_table &table,
                   const data_options &options,
                   const std::vector<std::vector<std::string>> &words) {
    const std::string &column = options.run_column;
    std::vector<double> time_s;
    if (options.needs_time) time_s = table.values(options.time_column);
    if (column.empty() && options.find_runs) {
        const found_runs found = runs_without_column(data, table, time_s);
        name_runs(data, found, {});
        return found;
    }
    if (column.empty()) {
        data.run_names = {"all"};
        return find_runs(std::vector<double>(table.rows.size(), 0.0), time_s, column);
    }
    const std::size_t index = table.column(column);
    const found_runs found = find_runs(table.values(column), time_s, column);
    name_runs(data, found, words[index]);
    data.together = with_idling(found.values, has(data.speeds, column));
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

// "t3_degC jumps to 85 at time_s 1250 (line 85), from 24.1"
std::string described(const training_data &data, const formats::csv_table &table,
                      const std::string &column, const glitch &one) {
    const std::size_t row = one.first;
    std::string text = fmt::format("{} jumps to {:.6g}", column, one.reached);
    if (!data.time_s.empty()) text += fmt::format(" at {:.9g} s", data.time_s[row]);
    text += fmt::format(" (line {}", table.lines[data.file_row[row]]);
    if (one.last > row) text += fmt::format(" and {} rows more", one.last - row);
    return text + fmt::format("), from {:.6g}", one.before);
}

// Bridges the glitches of each column and marks their rows.
void mend(training_data &data, const formats::csv_table &table, Eigen::MatrixXd &values,
          const std::vector<std::string> &names) {
    for (std::size_t c = 0; c < names.size(); ++c) {
        const auto column = static_cast<Eigen::Index>(c);
        const auto found = find_glitches(values.col(column), data.run_starts);
        bridge(values.col(column), found);
        for (const glitch &one : found) {
            data.glitches.push_back(described(data, table, names[c], one));
            data.spoilt.resize(data.rows(), false);
            for (std::size_t r = one.first; r <= one.last; ++r) data.spoilt[r] = true;
        }
    }
}

void mend_history(training_data &data) {
    for (Eigen::Index c = 0; c < data.history.cols(); ++c) {
        bridge(data.history.col(c), find_glitches(data.history.col(c), {0}));
    }
}

}  // namespace

std::string own_name(const std::string &name) {
    const formats::name_and_unit parts = formats::split_brackets(name);
    const formats::measuring_unit *is = formats::find_unit(parts.unit);
    if (is != nullptr) return formats::machine_unit(parts.name, *is).name;
    return name.find('*') == std::string::npos ? parts.name : name;  // t*[1-3] is a pattern
}

std::vector<std::string> own_names(std::vector<std::string> names) {
    for (auto &name : names) name = own_name(name);
    return names;
}

bool is_name_of_the_box(const std::string &name) {
    const auto allowed = [](char c) {
        return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ||
               c == '_' || c == '-' || c == '.';
    };
    return !name.empty() && name.size() <= longest_name &&
           std::all_of(name.begin(), name.end(), allowed);
}

training_data read_training_data(const std::string &path, const data_options &wanted) {
    std::vector<std::vector<std::string>> words;
    data_options options = wanted;
    options.inputs = own_names(options.inputs), options.outputs = own_names(options.outputs);
    options.time_column = own_name(options.time_column);
    options.run_column = own_name(options.run_column);
    const bool run_is_input = has(options.inputs, options.run_column) ||
                              (options.inputs.empty() && is_name_of_a_speed(options.run_column));
    std::vector<std::string> word_columns;
    if (!options.run_column.empty() && !run_is_input) word_columns.push_back(options.run_column);
    formats::csv_reading how;
    how.words = word_columns;
    std::set<std::string> errors;
    how.units = units_for(options, errors);
    const formats::csv_table table = formats::read_csv(path, how, &words);
    training_data data;
    data.file = path;
    if (options.time_if_there) options.needs_time = has(table.names, options.time_column);
    std::vector<std::string> others{options.time_column, options.run_column};
    data.outputs = chosen(table, options.outputs, others);
    others.insert(others.end(), data.outputs.begin(), data.outputs.end());
    std::string remark;
    data.inputs = options.inputs.empty() ? all_inputs(table, options, others, errors, remark)
                                         : chosen(table, options.inputs, others);
    if (!remark.empty()) data.remarks.push_back(remark);
    data.speeds = speeds_of(data.inputs, own_names(options.speeds));
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
    mend(data, table, data.x, data.inputs);
    mend(data, table, data.y, data.outputs);
    if (!options.record.empty()) take_history(data, options), mend_history(data);
    return data;
}

}  // namespace compbox::training
