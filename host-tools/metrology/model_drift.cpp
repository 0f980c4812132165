// SPDX-License-Identifier: MIT
#include "host-tools/metrology/model_drift.h"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "host-tools/formats/error.h"
#include "host-tools/metrology/probed_record.h"

namespace compbox::metrology {

namespace {

constexpr std::size_t least_reference = 7, least_periods = 10;
constexpr double allowance = 0.5, limit = 5.0;  // in standard deviations
constexpr double since_1970_s = 1e9;            // a clock beyond this counts from 1970

bool has_end(const std::string &name, const std::string &end) {
    return name.size() > end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0;
}

std::string without_end(const std::string &name, const std::string &end) {
    return name.substr(0, name.size() - end.size());
}

std::size_t clock_of(const formats::csv_table &table) {
    return table.find("unix_s") >= 0 ? table.column("unix_s") : table.column("time_s");
}

// out: the columns NAME_adapted and its model of a probe's channel, or nothing
std::optional<std::pair<std::size_t, std::size_t>> adapted_of(const formats::csv_table &record,
                                                              const std::string &channel) {
    for (const auto &name : record.names) {
        if (!has_end(name, "_adapted")) continue;
        const std::string base = without_end(name, "_adapted");
        if (base != channel && base != "error_" + channel + "_um") continue;
        for (const auto &model : record.names) {
            if (model != base && model.compare(0, base.size() + 1, base + "_") != 0) continue;
            if (model != name) return std::pair(record.column(name), record.column(model));
        }
    }
    return std::nullopt;
}

// out: one residual for each new count of the probe; the row before the count is that of the
//      measurement
residual_series residuals_of_probe(const formats::csv_table &record, const probe_columns &probe) {
    residual_series series;
    series.name = probe.channel;
    const std::size_t time = clock_of(record);
    const std::size_t value = record.column(probe.value), count = record.column(probe.count);
    const auto adapted = adapted_of(record, probe.channel);
    series.what = adapted ? "left by the model, without what the probe adapted"
                          : "as the probe showed it, with the compensation";
    double known = NAN;
    for (std::size_t r = 0; r < record.rows.size(); ++r) {
        const auto &row = record.rows[r];
        if (std::isnan(row[count])) continue;
        const bool is_new = !std::isnan(known) && is_new_count(known, row[count]);
        known = row[count];
        if (!is_new) continue;
        const auto &before = record.rows[r - 1];
        const double learnt = adapted ? before[adapted->first] - before[adapted->second] : 0.0;
        const double left = row[value] + learnt;
        if (std::isnan(left) || std::isnan(row[time])) continue;
        series.time_s.push_back(row[time]), series.left_um.push_back(left);
    }
    return series;
}

residual_series difference(const formats::csv_table &table, const std::string &name,
                           const std::string &predicted) {
    residual_series series;
    series.name = name;
    series.what = predicted.empty() ? "the errors themselves" : "error less prediction";
    const std::size_t time = clock_of(table), error = table.column(name);
    const int model = predicted.empty() ? -1 : static_cast<int>(table.column(predicted));
    for (const auto &row : table.rows) {
        const double left = row[error] - (model < 0 ? 0.0 : row[static_cast<std::size_t>(model)]);
        if (std::isnan(left) || std::isnan(row[time])) continue;
        series.time_s.push_back(row[time]), series.left_um.push_back(left);
    }
    return series;
}

// in : residuals of one period, at least one. out: its figures, without CUSUM
drift_period period_of(double start_s, const std::vector<double> &left_um) {
    drift_period period;
    period.start_s = start_s;
    period.count = left_um.size();
    std::vector<double> sizes;
    double sum = 0.0, squares = 0.0;
    for (const double left : left_um) {
        sum += left, squares += left * left;
        sizes.push_back(std::fabs(left));
    }
    const auto count = static_cast<double>(left_um.size());
    period.mean_um = sum / count, period.rms_um = std::sqrt(squares / count);
    std::sort(sizes.begin(), sizes.end());
    period.p95_um = sizes[std::min(sizes.size() - 1, static_cast<std::size_t>(0.95 * count))];
    period.largest_um = sizes.back();
    return period;
}

// out: the periods with a row, in order
std::vector<drift_period> periods_of(const residual_series &series, double period_s) {
    std::vector<drift_period> periods;
    const bool dates = series.time_s.front() > since_1970_s;
    const double zero_s = dates ? 0.0 : series.time_s.front();
    std::vector<double> own;
    double number = 0.0;
    const auto end_period = [&] {
        if (!own.empty()) periods.push_back(period_of(zero_s + number * period_s, own));
        own.clear();
    };
    for (std::size_t r = 0; r < series.time_s.size(); ++r) {
        const double now = std::floor((series.time_s[r] - zero_s) / period_s);
        if (now != number) end_period();
        number = now;
        own.push_back(series.left_um[r]);
    }
    end_period();
    return periods;
}

// in : drift.periods and drift.reference
// out: mean_um and spread_um, the standard deviation of a period's mean
void find_reference(model_drift &drift) {
    const auto count = static_cast<double>(drift.reference);
    double sum = 0.0, squares = 0.0, rms = 0.0;
    for (std::size_t p = 0; p < drift.reference; ++p) {
        sum += drift.periods[p].mean_um, rms += drift.periods[p].rms_um;
    }
    drift.mean_um = sum / count;
    for (std::size_t p = 0; p < drift.reference; ++p) {
        squares += std::pow(drift.periods[p].mean_um - drift.mean_um, 2);
    }
    constexpr double least_part = 0.1;  // of the residuals
    // With one standard error more, because few periods easily agree by chance.
    const double spread_um = drift.reference > 1 ? std::sqrt(squares / (count - 1.0)) *
                                                       (1.0 + 1.0 / std::sqrt(2.0 * (count - 1.0)))
                                                 : 0.0;
    drift.spread_um = std::max(spread_um, std::max(least_part * rms / count, 1e-3));
}

// in : a CUSUM that began in period `from` and went beyond its limit in period `to`
// out: the period from which on the means are furthest off for their number
std::size_t most_likely_start(const model_drift &drift, std::size_t from, std::size_t to) {
    double sum = 0.0, most = 0.0;
    std::size_t start = to;
    for (std::size_t p = to + 1; p-- > from;) {
        sum += drift.periods[p].mean_um - drift.mean_um;
        const double weight = std::fabs(sum) / std::sqrt(static_cast<double>(to + 1 - p));
        if (weight > most) most = weight, start = p;
    }
    return start;
}

// out: the CUSUM of each period behind the reference, and where it goes beyond the limit
void follow(model_drift &drift) {
    // The reference's mean is itself uncertain by its spread over the root of its periods.
    const double least = allowance + 1.0 / std::sqrt(static_cast<double>(drift.reference));
    double up = 0.0, down = 0.0;
    std::size_t up_since = drift.reference, down_since = drift.reference;
    for (std::size_t p = drift.reference; p < drift.periods.size(); ++p) {
        drift_period &period = drift.periods[p];
        const double off = (period.mean_um - drift.mean_um) / drift.spread_um;
        up = std::max(0.0, up + off - least), down = std::max(0.0, down - off - least);
        if (up == 0.0) up_since = p + 1;
        if (down == 0.0) down_since = p + 1;
        period.up = up, period.down = down;
        if (drift.noticed || std::max(up, down) <= limit) continue;
        drift.noticed = p;
        drift.since = most_likely_start(drift, up > down ? up_since : down_since, p);
    }
    if (!drift.since) return;
    double sum = 0.0, count = 0.0;
    for (std::size_t p = *drift.since; p < drift.periods.size(); ++p) {
        sum += drift.periods[p].mean_um, count += 1.0;
    }
    drift.change_um = sum / count - drift.mean_um;
}

}  // namespace

std::vector<residual_series> residuals_in(const formats::csv_table &table) {
    std::vector<residual_series> all;
    for (const probe_columns &probe : find_probes(table)) {
        all.push_back(residuals_of_probe(table, probe));
    }
    if (all.empty()) {
        for (const auto &name : table.names) {
            if (!has_end(name, "_predicted")) continue;
            all.push_back(difference(table, without_end(name, "_predicted"), name));
        }
    }
    if (all.empty()) {
        for (const auto &name : table.names) {
            const bool error = name.compare(0, 6, "error_") == 0 && has_end(name, "_um");
            if (error) all.push_back(difference(table, name, ""));
        }
    }
    if (all.empty()) {
        throw input_error(
            table.file, 0, 0,
            "has neither probe columns (probe_NAME and probe_NAME_n), nor NAME_predicted "
            "beside NAME, nor error_NAME_um");
    }
    for (const auto &series : all) {
        if (!series.time_s.empty()) continue;
        throw input_error(table.file, 0, 0, "has no measurement of {}", series.name);
    }
    return all;
}

model_drift drift_of(const residual_series &series, const drift_options &options) {
    model_drift drift;
    drift.periods = periods_of(series, options.period_s);
    drift.reference = options.reference > 0 ? options.reference
                                            : std::max(least_reference, drift.periods.size() / 5);
    const bool enough = drift.periods.size() >= least_periods || options.reference > 0;
    if (!enough || drift.reference >= drift.periods.size()) {
        drift.reference = 0;
        return drift;
    }
    find_reference(drift);
    follow(drift);
    return drift;
}

std::string period_name(const drift_period &period, const drift_options &options) {
    constexpr double week_s = 604800.0;
    if (period.start_s <= since_1970_s) {
        return fmt::format("{} {:.0f}", options.period_s == week_s ? "week" : "day",
                           std::floor(period.start_s / options.period_s) + 1.0);
    }
    const auto seconds = static_cast<std::time_t>(period.start_s);
    std::tm date{};
    gmtime_r(&seconds, &date);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%d", &date);
    return text;
}

}  // namespace compbox::metrology
