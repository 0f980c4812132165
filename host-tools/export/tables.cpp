// SPDX-License-Identifier: MIT
#include "host-tools/export/tables.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "host-tools/coefficients/curve_range.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/numbers.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::exports {

namespace {

constexpr unsigned places_in_space = 4000;

// Inputs of the computation of tables.
struct workshop {
    const channel_model &model;
    const table_options &options;
    channel_model::values at;  // of the signals that do not move
    std::vector<unsigned> own_axis;

    const cb_channel_config &channel(unsigned c) const { return model.config().channels[c]; }
    std::string signal_name(unsigned s) const { return model.config().signals[s].name; }

    std::size_t positions_of(unsigned output) const {
        const auto &all = model.dependencies(output);
        return static_cast<std::size_t>(std::count_if(
            all.begin(), all.end(), [&](unsigned s) { return model.is_position(s); }));
    }

    // out: displacement of channel c by the position of an axis, µm; see make_tables
    std::function<double(double)> function(unsigned c, unsigned axis, int direction = 0) const {
        const auto rest = model.outputs(at);
        return [this, c, axis, direction, rest](double position) {
            channel_model::values moved = at;
            model.set(moved, axis, position);
            const auto here = model.outputs(moved, direction);
            double sum = 0.0;
            for (unsigned i = 0; i < channel(c).sum_count; ++i) {
                const unsigned o = channel(c).sum[i];
                const bool depends = model.dependencies(o).count(axis) > 0;
                const bool alone = positions_of(o) == 1;
                if (depends) sum += here[o] - (alone ? 0.0 : rest[o]);
                if (!alone && own_axis[c] == axis) sum += rest[o];
            }
            return -sum;
        };
    }

    bool acts(unsigned c, unsigned axis) const {
        for (unsigned i = 0; i < channel(c).sum_count; ++i) {
            const unsigned o = channel(c).sum[i];
            if (model.dependencies(o).count(axis) > 0) return true;
            if (own_axis[c] == axis && positions_of(o) == 0) return true;
        }
        return false;
    }
};

// out: values of constant signals: from `at`, else the middle of a position's range
channel_model::values standing(const channel_model &model, const table_options &options,
                               table_set &result) {
    channel_model::values at = model.middle();
    std::vector<bool> used(model.config().signals_count), several(used);
    for (unsigned c = 0; c < model.config().channels_count; ++c) {
        const auto &channel = model.config().channels[c];
        for (unsigned i = 0; i < channel.sum_count; ++i) {
            const auto &all = model.dependencies(channel.sum[i]);
            std::size_t positions = 0;
            for (const unsigned s : all) positions += model.is_position(s);
            for (const unsigned s : all) used[s] = true;
            for (const unsigned s : all) several[s] = several[s] || positions > 1;
        }
    }
    hold(model, options.at, at);
    for (unsigned s = 0; s < model.config().signals_count; ++s) {
        const auto &signal = model.config().signals[s];
        const bool given = options.at.count(signal.name) > 0;
        if (!used[s] || signal.source == CB_SOURCE_LAG) continue;
        if (!model.is_position(s) && !given) {
            throw input_error(
                model.path(), 0, 0,
                "a table cannot follow the signal {}: say at which value it shall hold, --at {}=…",
                signal.name, signal.name);
        }
        if (!model.is_position(s) || several[s]) result.held_at[signal.name] = at[s];
    }
    return at;
}

coefficients::travel_range range_of(const workshop &shop, unsigned axis) {
    const std::string name = shop.signal_name(axis);
    const auto given = shop.options.range.find(name);
    if (given != shop.options.range.end()) return given->second;
    const auto curves = coefficients::range_of_curves(shop.model.file()["terms"], name);
    if (curves) return *curves;
    const auto &signal = shop.model.config().signals[axis];
    return {signal.min, signal.max};
}

// out: number of points, at most a billion
std::size_t points_for(const coefficients::travel_range &range, double step) {
    const double steps = std::ceil((range.to_mm - range.from_mm) / step - 1e-9);
    return static_cast<std::size_t>(std::clamp(steps, 0.0, 1e9)) + 1;
}

// out: the values to write. A last point beyond the travel is extrapolated from the point before it
// and the curve at the end of the travel.
std::vector<double> values_of(const axis_table &table,
                              const std::function<double(double)> &wanted) {
    std::vector<double> all;
    for (const double x : table.position_mm) {
        double value = wanted(std::min(x, table.to_mm));
        if (x > table.to_mm + 1e-6 && !all.empty()) {
            const double before = x - table.step_mm;
            value = all.back() + (value - all.back()) * table.step_mm / (table.to_mm - before);
        }
        all.push_back(std::round(value * 1e3) / 1e3);
    }
    return all;
}

// out: the largest difference between the linear interpolation of the column and a curve
void judge_steps(const axis_table &table, const std::vector<double> &written,
                 const std::function<double(double)> &wanted, table_column &column) {
    for (std::size_t k = 0; k + 1 < table.position_mm.size(); ++k) {
        for (int i = 0; i <= looks_per_step; ++i) {
            const double x =
                std::min(table.position_mm[k] + table.step_mm * i / looks_per_step, table.to_mm);
            const double error = interpolate(table.position_mm, written, x) - wanted(x);
            if (std::fabs(error) <= std::fabs(column.step_error_um)) continue;
            column.step_error_um = error;
            column.step_error_at_mm = x;
        }
    }
}

// Computes values and step error of one column, by direction if its curves have branches.
void fill_column(const workshop &shop, const axis_table &table, table_column &column) {
    column.step_error_um = column.step_error_at_mm = 0.0;
    column.half_um.clear();
    const bool branches =
        shop.options.directions && shop.model.has_branches(column.channel, table.signal);
    if (!branches) {
        const auto wanted = shop.function(column.channel, table.signal);
        column.wanted_um = values_of(table, wanted);
        judge_steps(table, column.wanted_um, wanted, column);
        return;
    }
    const auto forward = shop.function(column.channel, table.signal, 1);
    const auto backward = shop.function(column.channel, table.signal, -1);
    const auto up = values_of(table, forward), down = values_of(table, backward);
    column.wanted_um.clear();
    for (std::size_t k = 0; k < up.size(); ++k) {
        column.wanted_um.push_back(0.5 * (up[k] + down[k]));
        column.half_um.push_back(0.5 * (up[k] - down[k]));
    }
    judge_steps(table, up, forward, column);
    judge_steps(table, down, backward, column);
}

// Fills the table for one step; true when every column is within tolerance.
bool fill(const workshop &shop, const coefficients::travel_range &range, double step,
          axis_table &table) {
    table.step_mm = step;
    table.from_mm = range.from_mm;
    table.to_mm = range.to_mm;
    table.position_mm.clear();
    for (std::size_t k = 0; k < points_for(range, step); ++k) {
        table.position_mm.push_back(range.from_mm + static_cast<double>(k) * step);
    }
    double worst = 0.0;
    for (auto &column : table.columns) {
        fill_column(shop, table, column);
        worst = std::max(worst, std::fabs(column.step_error_um));
    }
    return worst <= shop.options.tolerance_um;
}

// Round steps (1, 2, 2.5, 5 · 10^k) from wide to narrow, as far as the control has room.
void choose_step(const workshop &shop, const coefficients::travel_range &range, axis_table &table) {
    const double travel = range.to_mm - range.from_mm;
    std::vector<double> steps;
    for (int power = static_cast<int>(std::ceil(std::log10(travel))); power > -4; --power) {
        for (const double digit : {5.0, 2.5, 2.0, 1.0}) {
            const double step = digit * std::pow(10.0, power);
            if (step <= travel && points_for(range, step) <= shop.options.most_points) {
                steps.push_back(step);
            }
        }
    }
    if (steps.empty()) {
        throw input_error(shop.model.path(), 0, 0,
                          "{} from {} to {} mm: no round step gives 2 to {} points: choose "
                          "--step-mm, or another --range or --most-points",
                          shop.signal_name(table.signal), range.from_mm, range.to_mm,
                          shop.options.most_points);
    }
    for (const double step : steps) {
        table.tolerance_met = fill(shop, range, step, table);
        if (table.tolerance_met) return;
    }
}

// Fills the table at the given step, or at the coarsest that keeps the tolerance. Throws
// input_error where the step gives fewer than 2 or too many points.
void fill_table(const workshop &shop, axis_table &table) {
    const coefficients::travel_range range = range_of(shop, table.signal);
    if (!shop.options.step_mm) {
        choose_step(shop, range, table);
        return;
    }
    const double step = *shop.options.step_mm;
    const std::size_t points = points_for(range, step);
    if (points < 2 || points > shop.options.most_points) {
        throw input_error(
            shop.model.path(), 0, 0,
            "{} from {} to {} mm at {} mm is {} points, and the table holds 2 to {}: choose "
            "--step-mm from {} to {}",
            shop.signal_name(table.signal), range.from_mm, range.to_mm, step, points,
            shop.options.most_points,
            (range.to_mm - range.from_mm) / static_cast<double>(shop.options.most_points - 1),
            range.to_mm - range.from_mm);
    }
    table.tolerance_met = fill(shop, range, step, table);
}

// The k-th of a sequence that fills (0, 1) evenly (Halton).
double halton(unsigned k, unsigned base) {
    double value = 0.0, share = 1.0;
    for (; k > 0; k /= base) {
        share /= base;
        value += share * (k % base);
    }
    return value;
}

// out: largest difference in the working space between the box's channel and the sum of its tables
std::vector<channel_loss> measure_losses(const workshop &shop,
                                         const std::vector<axis_table> &tables) {
    static const unsigned bases[] = {2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53};
    std::vector<channel_loss> losses(shop.model.config().channels_count);
    std::vector<std::pair<unsigned, coefficients::travel_range>> axes;
    for (unsigned s = 0; s < shop.model.config().signals_count && axes.size() < 16; ++s) {
        const bool lag = shop.model.config().signals[s].source == CB_SOURCE_LAG;
        if (!lag && shop.model.is_position(s)) axes.push_back({s, range_of(shop, s)});
    }
    for (unsigned k = 1; k <= places_in_space; ++k) {
        channel_model::values place = shop.at;
        for (std::size_t a = 0; a < axes.size(); ++a) {
            const auto &[s, range] = axes[a];
            shop.model.set(place, s,
                           range.from_mm + (range.to_mm - range.from_mm) * halton(k, bases[a]));
        }
        for (unsigned c = 0; c < losses.size(); ++c) {
            double missed = shop.model.wanted_um(c, place);
            for (const auto &table : tables) {
                for (const auto &column : table.columns) {
                    if (column.channel != c) continue;
                    missed -= interpolate(table.position_mm, column.wanted_um, place[table.signal]);
                }
            }
            losses[c].channel = c;
            if (std::fabs(missed) <= std::fabs(losses[c].largest_um)) continue;
            losses[c].largest_um = missed;
            for (const auto &[s, range] : axes) losses[c].where[shop.signal_name(s)] = place[s];
        }
    }
    return losses;
}

// Adds a remark for curves with branches in a table without directions.
void judge_directions(const workshop &shop, table_set &result) {
    for (const auto &table : result.tables) {
        for (const auto &column : table.columns) {
            if (!column.half_um.empty() || !shop.model.has_branches(column.channel, table.signal)) {
                continue;
            }
            result.remarks.push_back(fmt::format(
                "channel {} over {}: forward and backward differ; the table holds their mean",
                shop.channel(column.channel).name, shop.signal_name(table.signal)));
        }
    }
}

// Adds a remark for each table that misses the tolerance or exceeds the channel's limit_um.
void judge(const workshop &shop, table_set &result) {
    judge_directions(shop, result);
    for (const auto &table : result.tables) {
        if (!table.tolerance_met && !shop.options.step_mm) {
            result.remarks.push_back(
                fmt::format("the table over {} is as fine as the control holds ({} points) and "
                            "does not reach the tolerance of {} um",
                            shop.signal_name(table.signal), table.position_mm.size(),
                            shop.options.tolerance_um));
        }
        for (const auto &column : table.columns) {
            const auto &channel = shop.channel(column.channel);
            const auto lost = shop.options.lost_motion_um.find(channel.name);
            const bool has_lost = column.own && lost != shop.options.lost_motion_um.end();
            double most_um = 0.0;  // of both directions
            for (std::size_t k = 0; k < column.wanted_um.size(); ++k) {
                const double half_um = !column.half_um.empty() ? column.half_um[k]
                                       : has_lost              ? 0.5 * lost->second
                                                               : 0.0;
                most_um = std::max(most_um, std::fabs(column.wanted_um[k]) + std::fabs(half_um));
            }
            if (most_um > channel.limit_um) {
                result.remarks.push_back(fmt::format(
                    "channel {} over {}: the table goes beyond the box's limit_um of {}",
                    channel.name, shop.signal_name(table.signal), channel.limit_um));
            }
        }
    }
}

}  // namespace

double interpolate(const std::vector<double> &x, const std::vector<double> &y, double at) {
    if (at <= x.front()) return y.front();
    if (at >= x.back()) return y.back();
    const auto above = std::upper_bound(x.begin(), x.end(), at);
    const std::size_t k = static_cast<std::size_t>(above - x.begin()) - 1;
    return y[k] + (y[k + 1] - y[k]) * (at - x[k]) / (x[k + 1] - x[k]);
}

unsigned axis_of_channel(const channel_model &model, unsigned channel,
                         const std::map<std::string, std::string> &named) {
    const std::string name = model.config().channels[channel].name;
    const auto is_length = [&](unsigned s) {
        return model.is_position(s) && std::string(model.config().signals[s].unit) == "mm";
    };
    const auto given = named.find(name);
    if (given != named.end()) {
        const unsigned s = model.signal(given->second);
        if (is_length(s)) return s;
        throw input_error(model.path(), 0, 0,
                          "channel {} moves an axis in mm, and {} is no position in mm (--axis)",
                          name, given->second);
    }
    for (const std::string &guess : {name, name.substr(0, 1)}) {
        for (unsigned s = 0; s < model.config().signals_count; ++s) {
            if (guess == model.config().signals[s].name && is_length(s)) return s;
        }
    }
    throw input_error(model.path(), 0, 0,
                      "channel {}: say which signal is the position of its axis, --axis {}=SIGNAL",
                      name, name);
}

void hold(const channel_model &model, const std::map<std::string, double> &at,
          channel_model::values &values) {
    for (const auto &[name, value] : at) {
        const unsigned s = model.signal(name);
        const double low = formats::short_float(model.config().signals[s].min);
        const double high = formats::short_float(model.config().signals[s].max);
        if (!(value >= low && value <= high)) {
            throw input_error(model.path(), 0, 0, "{} {} is outside {} to {} (--at)", name, value,
                              low, high);
        }
        model.set(values, s, value);
    }
}

table_set make_tables(const channel_model &model, const table_options &options) {
    table_set result;
    workshop shop{model, options, {}, {}};
    for (unsigned c = 0; c < model.config().channels_count; ++c) {
        shop.own_axis.push_back(axis_of_channel(model, c, options.axis_of));
    }
    shop.at = standing(model, options, result);
    for (unsigned s = 0; s < model.config().signals_count; ++s) {
        axis_table table;
        table.signal = s;
        if (model.config().signals[s].source == CB_SOURCE_LAG || !model.is_position(s)) continue;
        for (unsigned c = 0; c < model.config().channels_count; ++c) {
            const bool own = shop.own_axis[c] == s;
            if (!shop.acts(c, s) || !(own || options.cross)) continue;
            table.columns.push_back({c, own, {}, {}, 0.0, 0.0});
        }
        if (table.columns.empty()) continue;
        fill_table(shop, table);
        result.tables.push_back(std::move(table));
    }
    if (result.tables.empty()) {
        throw input_error(
            model.path(), 0, 0,
            "no channel has an error that depends on its own axis, and this format holds no other: "
            "use sinumerik-cec or heidenhain-com");
    }
    result.losses = measure_losses(shop, result.tables);
    judge(shop, result);
    return result;
}

}  // namespace compbox::exports
