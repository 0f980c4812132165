// SPDX-License-Identifier: MIT
#include "host-tools/fitting/measurement.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "host-tools/fitting/columns.h"
#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/table_text.h"
#include "host-tools/formats/units.h"

namespace compbox::fitting {

namespace {

struct columns {
    std::size_t position, error;
    int run, direction, sigma;
};

// Finds the columns by name; the error's name has the unit.
columns find_columns(const formats::csv_table &table, measurement &data) {
    const bool micrometre = table.find("error_um") >= 0, angle = table.find("error_urad") >= 0;
    if (micrometre && angle) {
        throw input_error(table.file, 0, 0,
                          "has both error_um and error_urad; fit takes one error, so keep one");
    }
    data.unit = angle ? "urad" : "um";
    columns found{};
    found.position = table.column("position_mm");
    found.error = table.column(angle ? "error_urad" : "error_um");
    found.run = table.find("run");
    found.direction = table.find("direction");
    found.sigma = table.find("sigma");
    if (found.sigma < 0) found.sigma = table.find("sigma_" + data.unit);
    return found;
}

int known_direction(const std::string &word, const std::string &file, long line) {
    const int direction = direction_of(word);
    if (direction != 0) return direction;
    throw input_error(file, line, 0, "direction '{}' is neither +1 (forward) nor -1 (backward)",
                      word);
}

// A run with the line number of each reading, for messages.
struct run_with_lines {
    measured_run run;
    std::vector<long> lines;
};

[[noreturn]] void refuse_again(const std::string &file, double before, double here,
                               long line_before, long line, bool has_runs) {
    throw input_error(file, line, 0, "position {} mm is there already in line {}{}{}", here,
                      line_before, here == before ? "" : fmt::format(" ({} mm)", before),
                      has_runs ? ", in the same run" : "; name the runs in a column 'run'");
}

[[noreturn]] void refuse_order(const std::string &file, double before, double here, long line) {
    throw input_error(file, line, 0,
                      "positions must ascend within a run, but {} mm comes after {} mm; list them "
                      "upwards, or mark a backward run in a column 'direction' with -1",
                      here, before);
}

// in : one run in file order; a backward one may descend
// out: ascending order; throws for any other order
void put_in_order(run_with_lines &one, const std::string &file, bool has_runs) {
    measured_run &run = one.run;
    const bool descends =
        run.direction < 0 && run.position.size() > 1 && run.position[1] < run.position[0];
    if (descends) {
        std::reverse(run.position.begin(), run.position.end());
        std::reverse(run.error.begin(), run.error.end());
        std::reverse(run.sigma.begin(), run.sigma.end());
        std::reverse(one.lines.begin(), one.lines.end());
    }
    for (std::size_t i = 1; i < run.position.size(); ++i) {
        if (run.position[i] > run.position[i - 1]) continue;
        for (std::size_t k = 0; k < run.position.size(); ++k) {
            if (k != i && run.position[k] == run.position[i]) {
                refuse_again(file, run.position[k], run.position[i],
                             std::min(one.lines[k], one.lines[i]),
                             std::max(one.lines[k], one.lines[i]), has_runs);
            }
        }
        refuse_order(file, run.position[i - 1], run.position[i], one.lines[i]);
    }
}

// in : a table with one reading per row; words: the texts of its run and direction columns
// out: data.runs, each ascending in position; throws input_error with file and line
void read_rows(measurement &data, const formats::csv_table &table, const columns &where,
               const std::vector<std::vector<std::string>> &words) {
    std::vector<run_with_lines> runs;
    std::map<std::pair<double, int>, std::size_t> known;
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
        const auto &row = table.rows[r];
        const auto word = [&](int column) {
            const auto c = static_cast<std::size_t>(column);
            return words[c][static_cast<std::size_t>(row[c])];
        };
        const double run = where.run < 0 ? 0.0 : row[static_cast<std::size_t>(where.run)];
        const int direction =
            where.direction < 0 ? 0
                                : known_direction(word(where.direction), data.file, table.lines[r]);
        const auto [place, is_new] = known.try_emplace({run, direction}, runs.size());
        if (is_new) {
            runs.emplace_back();
            runs.back().run.name = where.run < 0 ? "" : word(where.run);
            runs.back().run.direction = direction;
        }
        run_with_lines &one = runs[place->second];
        const double sigma = where.sigma < 0 ? 1.0 : row[static_cast<std::size_t>(where.sigma)];
        check_reading(data.file, table.lines[r], row[where.position], row[where.error], sigma);
        one.run.position.push_back(row[where.position]);
        one.run.error.push_back(row[where.error]);
        one.run.sigma.push_back(sigma);
        one.lines.push_back(table.lines[r]);
    }
    std::vector<std::vector<long>> lines;
    for (auto &one : runs) {
        put_in_order(one, data.file, where.run >= 0);
        data.runs.push_back(std::move(one.run));
        lines.push_back(std::move(one.lines));
    }
    refuse_near_positions(data, lines, where.run >= 0);
}

// Throws if a required column is present without its unit, or with an unknown one.
void check_units(const formats::csv_table &table, bool unit_option) {
    const auto missing = [&](const std::string &start) {
        return std::none_of(table.names.begin(), table.names.end(), [&](const auto &name) {
            return name.compare(0, start.size(), start) == 0;
        });
    };
    const bool no_position = missing("position_"), no_error = missing("error_");
    for (const auto &name : table.names) {
        const formats::name_and_unit parts = formats::split_brackets(name);
        const bool position = no_position && is_position_word(parts.name);
        if (!position && !(no_error && is_error_word(parts.name))) continue;
        if (!parts.unit.empty()) {
            throw input_error(table.file, table.header_line, 0,
                              "the column '{}' has a unit that is not known; known are {}", name,
                              known_units());
        }
        throw input_error(table.file, table.header_line, 0,
                          "the column '{}' has no unit; append it, as in '{}{}{}", name, name,
                          position ? " (mm)'" : " (um)'",
                          unit_option ? ", or give --unit mm,um (position, error)" : "");
    }
}

// Whether a line of the file is the header: it names a position with its unit, or a position and an
// error.
bool names_a_curve(const std::vector<std::string> &names) {
    const auto any = [&](bool (*is)(const std::string &)) {
        return std::any_of(names.begin(), names.end(), is);
    };
    const auto with_unit = [](const std::string &name) {
        return name.compare(0, 9, "position_") == 0 || name.compare(0, 8, "nominal_") == 0;
    };
    const auto error_with_unit = [](const std::string &name) {
        return name.compare(0, 6, "error_") == 0 || name.compare(0, 7, "actual_") == 0;
    };
    return any(with_unit) ||
           (any(is_position_word) && (any(is_error_word) || any(error_with_unit)));
}

bool has_run_columns(const formats::csv_table &table) {
    for (const char *name : {"error_um", "error_urad"}) {
        if (std::count(table.names.begin(), table.names.end(), name) > 0) return false;
    }
    std::string run;
    int direction = 0;
    return std::any_of(table.names.begin(), table.names.end(),
                       [&](const auto &name) { return is_run_column(name, run, direction); });
}

// A table with one column for each run; a backward run may start at the bottom.
void read_run_columns(measurement &data, const formats::csv_table &table) {
    const std::size_t position = table.column("position_mm");
    std::vector<std::vector<long>> lines;
    for (std::size_t c = 0; c < table.names.size(); ++c) {
        run_with_lines one;
        if (!is_run_column(table.names[c], one.run.name, one.run.direction)) continue;
        table.column(table.names[c]);  // throws for a cell that is no number
        const std::string unit = table.names[c].compare(0, 10, "error_urad") == 0 ? "urad" : "um";
        if (!data.runs.empty() && unit != data.unit) {
            throw input_error(table.file, 0, 0, "has runs in um and in urad; keep one of them");
        }
        data.unit = unit;
        for (std::size_t r = 0; r < table.rows.size(); ++r) {
            const auto &row = table.rows[r];
            check_reading(table.file, table.lines[r], row[position], row[c], 1.0);
            one.run.position.push_back(row[position]);
            one.run.error.push_back(row[c]);
            one.run.sigma.push_back(1.0);
            one.lines.push_back(table.lines[r]);
        }
        put_in_order(one, data.file, true);
        data.runs.push_back(std::move(one.run));
        lines.push_back(std::move(one.lines));
    }
    refuse_near_positions(data, lines, true);
}

}  // namespace

void refuse_near_positions(const measurement &data, const std::vector<std::vector<long>> &lines,
                           bool has_runs) {
    const double closest = closest_positions(data.runs);
    for (std::size_t r = 0; r < data.runs.size(); ++r) {
        const auto &x = data.runs[r].position;
        for (std::size_t i = 1; i < x.size(); ++i) {
            if (x[i] - x[i - 1] > closest) continue;
            const bool up = lines[r][i] > lines[r][i - 1];
            const std::size_t later = up ? i : i - 1, before = up ? i - 1 : i;
            refuse_again(data.file, x[before], x[later], lines[r][before], lines[r][later],
                         has_runs);
        }
    }
}

void check_reading(const std::string &file, long line, double position, double error,
                   double sigma) {
    constexpr double most = 1e6, least_sigma = 1e-6;
    if (!(std::abs(position) <= most)) {
        throw input_error(file, line, 0,
                          "a position of {} mm is beyond any machine; give millimetres", position);
    }
    if (!(std::abs(error) <= most)) {
        throw input_error(
            file, line, 0,
            "an error of {} is beyond any machine; give micrometres (microradians for angles)",
            error);
    }
    if (!(sigma > 0.0)) {
        throw input_error(file, line, 0, "sigma must be above zero, not {}", sigma);
    }
    if (sigma < least_sigma || sigma > most) {
        throw input_error(file, line, 0,
                          "a sigma of {} is outside 1e-06 to 1e+06; give it in the error's unit",
                          sigma);
    }
}

measurement read_measurement(const std::string &path, const reading_options &options) {
    const std::string text = formats::read_table_text(path);
    if (formats::is_laser_text(path, text)) {
        const std::string unit = units_of_option(options.unit).error;
        return measurement_of_laser(formats::read_laser_text(path, text, unit));
    }
    const column_units missing = units_of_option(options.unit);
    std::vector<std::vector<std::string>> words;
    formats::csv_reading how;
    how.words = {"run", "direction"};
    how.columns = options.columns;
    how.rename = [&](const std::string &name) { return canonical_column(name, missing); };
    how.is_header = names_a_curve;
    formats::csv_table table = formats::read_csv_text(path, text, how, &words);
    to_standard_units(table, missing);
    check_units(table, options.unit_option);
    measurement data;
    data.file = path;
    if (has_run_columns(table)) {
        read_run_columns(data, table);
    } else {
        const auto where = find_columns(table, data);
        data.sigma_given = where.sigma >= 0;
        read_rows(data, table, where, words);
    }
    average_runs(data);
    return data;
}

}  // namespace compbox::fitting
