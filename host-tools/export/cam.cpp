// SPDX-License-Identifier: MIT
#include "host-tools/export/cam.h"

#include <cmath>
#include <functional>

#include "host-tools/coefficients/curve_range.h"
#include "host-tools/export/expression.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::exports {

namespace {

using function = std::function<double(double)>;

// Positions of all signals as functions of the master position.
std::map<unsigned, function> read_path(const channel_model &model, const cam_options &options) {
    std::map<unsigned, function> path;
    path[model.signal(options.master)] = [](double x) { return x; };
    for (const auto &[name, formula] : options.path) {
        path[model.signal(name)] = parse_expression(formula, options.master);
    }
    if (options.path_file.empty()) return path;
    const formats::csv_table table = formats::read_csv(options.path_file);
    const auto master = table.values(options.master);
    for (std::size_t r = 1; r < master.size(); ++r) {
        if (master[r] > master[r - 1]) continue;
        throw input_error(table.file, table.lines[r], 0,
                          options.master +
                              " must ascend, since a cam has one slave position for "
                              "each master position");
    }
    if (master.size() < 2) throw input_error(table.file, 0, 0, "a path needs two rows at least");
    for (const auto &name : table.names) {
        if (name == options.master) continue;
        const auto along = [master, y = table.values(name)](double x) {
            return interpolate(master, y, x);
        };
        if (path.insert({model.signal(name), along}).second) continue;
        throw input_error(table.file, table.header_line, 0, "{} has a formula already (--path)",
                          name);
    }
    return path;
}

// out: the range asked for, else that of the path's file, the curves or the signal. Throws
// input_error for a range beyond the rows of the path's file.
coefficients::travel_range range_of_master(const channel_model &model, const cam_options &options) {
    const auto given = options.table.range.find(options.master);
    const bool is_given = given != options.table.range.end();
    if (!options.path_file.empty()) {
        const auto master = formats::read_csv(options.path_file).values(options.master);
        const coefficients::travel_range all{master.front(), master.back()};
        if (!is_given) return all;
        if (given->second.from_mm >= all.from_mm && given->second.to_mm <= all.to_mm) {
            return given->second;
        }
        throw input_error(
            options.path_file, 0, 0, "has {} from {} to {} only, and --range asks for {} to {}",
            options.master, all.from_mm, all.to_mm, given->second.from_mm, given->second.to_mm);
    }
    if (is_given) return given->second;
    const auto curves = coefficients::range_of_curves(model.file()["terms"], options.master);
    if (curves) return *curves;
    const auto &signal = model.config().signals[model.signal(options.master)];
    return {signal.min, signal.max};
}

struct cam_shop {
    const channel_model &model;
    const cam_options &options;
    std::map<unsigned, function> path;
    std::vector<unsigned> own_axis;
    channel_model::values standing;

    channel_model::values place(double master) const {
        channel_model::values at = standing;
        for (const auto &[signal, along] : path) {
            const auto &range = model.config().signals[signal];
            const double value = along(master);
            if (!(value >= range.min && value <= range.max)) {
                throw input_error(model.path(), 0, 0,
                                  "at {} {} the path has {} {}, outside {} to {}", options.master,
                                  master, range.name, value, range.min, range.max);
            }
            model.set(at, signal, value);
        }
        return at;
    }

    double slave(unsigned channel, double master) const {
        const channel_model::values at = place(master);
        return at[own_axis[channel]] + model.wanted_um(channel, at) * 1e-3;
    }
};

// Throws input_error if a channel depends on a signal that is neither on the path nor fixed.
void check_path(const cam_shop &shop) {
    std::vector<bool> known(shop.model.config().signals_count);
    for (const auto &[signal, along] : shop.path) known[signal] = true;
    for (const auto &[name, value] : shop.options.table.at) known[shop.model.signal(name)] = true;
    for (unsigned c = 0; c < shop.model.config().channels_count; ++c) {
        const auto &channel = shop.model.config().channels[c];
        std::set<unsigned> needed{shop.own_axis[c]};
        for (unsigned i = 0; i < channel.sum_count; ++i) {
            const auto &all = shop.model.dependencies(channel.sum[i]);
            needed.insert(all.begin(), all.end());
        }
        for (const unsigned s : needed) {
            if (known[s]) continue;
            const std::string name = shop.model.config().signals[s].name;
            throw input_error(shop.model.path(), 0, 0,
                              "channel {} depends on {}: give it along the path, --path "
                              "\"{}=formula of {}\", or a fixed value, --at {}=…",
                              channel.name, name, name, shop.options.master, name);
        }
    }
}

// Fills the set's points over the range at this step, in mm, and the largest error between them.
// out: whether every cam is within the tolerance
bool fill(const cam_shop &shop, const coefficients::travel_range &range, double step,
          cam_set &set) {
    set.step_mm = step;
    set.master_mm.clear();
    for (std::size_t k = 0;; ++k) {  // the last step may be shorter
        const double x = range.from_mm + static_cast<double>(k) * step;
        if (x > range.to_mm - 1e-6 * step) break;
        set.master_mm.push_back(x);
    }
    set.master_mm.push_back(range.to_mm);
    double worst = 0.0;
    for (auto &one : set.cams) {
        one.slave_mm.clear();
        one.step_error_um = one.step_error_at_mm = 0.0;
        for (const double x : set.master_mm) {
            one.slave_mm.push_back(std::round(shop.slave(one.channel, x) * 1e6) / 1e6);
        }
        for (std::size_t k = 0; k + 1 < set.master_mm.size(); ++k) {
            const double width = set.master_mm[k + 1] - set.master_mm[k];
            for (int i = 0; i <= looks_per_step; ++i) {
                const double x = set.master_mm[k] + width * i / looks_per_step;
                const double error = 1e3 * (interpolate(set.master_mm, one.slave_mm, x) -
                                            shop.slave(one.channel, x));
                if (std::fabs(error) <= std::fabs(one.step_error_um)) continue;
                one.step_error_um = error;
                one.step_error_at_mm = x;
            }
        }
        worst = std::max(worst, std::fabs(one.step_error_um));
    }
    return worst <= shop.options.table.tolerance_um;
}

// Fills the set at the widest round step within the tolerance, else at the finest with room. Throws
// input_error where none has room.
void choose_step(const cam_shop &shop, const coefficients::travel_range &range, cam_set &set) {
    const double travel = range.to_mm - range.from_mm;
    for (int power = static_cast<int>(std::ceil(std::log10(travel))); power > -4; --power) {
        for (const double digit : {5.0, 2.5, 2.0, 1.0}) {
            const double step = digit * std::pow(10.0, power);
            const bool room =
                travel / step + 2.0 <= static_cast<double>(shop.options.table.most_points);
            if (step > travel || !room) continue;
            set.tolerance_met = fill(shop, range, step, set);
            if (set.tolerance_met) return;
        }
    }
    if (!set.master_mm.empty()) return;
    throw input_error(shop.model.path(), 0, 0,
                      "{} from {} to {} mm: no round step gives {} points or fewer: choose "
                      "--step-mm, or another --range or --most-points",
                      shop.options.master, range.from_mm, range.to_mm,
                      shop.options.table.most_points);
}

}  // namespace

cam_set make_cams(const channel_model &model, const cam_options &options) {
    cam_shop shop{model, options, read_path(model, options), {}, model.middle()};
    cam_set set;
    for (unsigned c = 0; c < model.config().channels_count; ++c) {
        shop.own_axis.push_back(axis_of_channel(model, c, options.table.axis_of));
        set.cams.push_back({c, {}, 0.0, 0.0});
    }
    hold(model, options.table.at, shop.standing);
    check_path(shop);
    for (unsigned c = 0; c < model.config().channels_count; ++c) {
        for (unsigned s = 0; s < model.config().signals_count; ++s) {
            if (!model.has_branches(c, s)) continue;
            set.remarks.push_back(
                fmt::format("channel {}: forward and backward differ; the cam holds their mean",
                            model.config().channels[c].name));
        }
    }
    const coefficients::travel_range range = range_of_master(model, options);
    if (!options.table.step_mm) {
        choose_step(shop, range, set);
        if (!set.tolerance_met) {
            set.remarks.push_back(
                fmt::format("the cams have as many points as are allowed and do not reach the "
                            "tolerance of {} um",
                            options.table.tolerance_um));
        }
        return set;
    }
    const double step = *options.table.step_mm, travel = range.to_mm - range.from_mm;
    if (step > travel || travel / step + 2.0 > static_cast<double>(options.table.most_points)) {
        throw input_error(model.path(), 0, 0,
                          "--step-mm {} over {} mm gives fewer than 2 or more than {} points", step,
                          travel, options.table.most_points);
    }
    set.tolerance_met = fill(shop, range, step, set);
    return set;
}

// out: lines for a person: the path, the largest table step error of each cam, held signals
std::vector<std::string> cam_loss_lines(const channel_model &model, const cam_set &set,
                                        const cam_options &how) {
    std::string path;
    for (const auto &[name, formula] : how.path) path += fmt::format(", {} = {}", name, formula);
    if (!how.path_file.empty()) {
        path += ", " + how.path_file.substr(how.path_file.find_last_of('/') + 1);
    }
    std::vector<std::string> lines{
        fmt::format("right on this path only: master {}{}", how.master, path)};
    for (const auto &one : set.cams) {
        lines.push_back(fmt::format(
            "channel {}: {} points every {} mm; largest table step error {:.3f} um at {} mm",
            model.config().channels[one.channel].name, set.master_mm.size(), set.step_mm,
            one.step_error_um, one.step_error_at_mm));
    }
    for (const auto &[name, value] : how.table.at) {
        lines.push_back(fmt::format("cams hold {} at {}", name, value));
    }
    for (const auto &remark : set.remarks) lines.push_back(remark);
    return lines;
}

std::vector<output_file> twincat_cam(const channel_model &model, const cam_set &set,
                                     const cam_options &how, const text_options &options) {
    std::vector<output_file> files;
    std::string about =
        fmt::format("compbox export of {}, revision {}\n", options.source, model.config().revision);
    for (const auto &line : cam_loss_lines(model, set, how)) about += line + "\n";
    for (const auto &one : set.cams) {
        std::string text;
        for (std::size_t k = 0; k < set.master_mm.size(); ++k) {
            text += fmt::format("{}, {}\r\n", fixed6(set.master_mm[k]), fixed6(one.slave_mm[k]));
        }
        files.push_back({std::string(model.config().channels[one.channel].name) + ".csv", text});
    }
    files.push_back({"EXPORT.TXT", about});
    return files;
}

}  // namespace compbox::exports
