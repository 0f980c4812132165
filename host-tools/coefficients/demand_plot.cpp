// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/demand_plot.h"

#include <algorithm>
#include <filesystem>

#include "host-tools/coefficients/compare.h"
#include "host-tools/coefficients/demand.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/plot.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::coefficients {

namespace {

constexpr int panel_width = 700, panel_height = 440, title_height = 60;
constexpr int least_width = 1000;  // of the title

// One channel with a panel for each of its positions.
struct channel_panels {
    unsigned channel;
    std::vector<unsigned> positions;
};

std::string block_name(const channel_panels &one, unsigned signal) {
    return fmt::format("demand{}_{}", one.channel, signal);
}

// out: x, demand with the other axes at home, and the lowest and highest for any of their positions
std::string data_of(demand_model &model, const channel_panels &one, unsigned signal) {
    std::vector<std::vector<double>> columns(4);
    for (const double x : model.places(signal)) {
        const demand_range band = model.across(one.channel, signal, x);
        const double row[] = {x, model.with_home(one.channel, signal, x), band.low_um,
                              band.high_um};
        for (std::size_t c = 0; c < columns.size(); ++c) columns[c].push_back(row[c]);
    }
    return formats::plot_data(block_name(one, signal), columns);
}

// A limit as a line in both directions. It is in the picture where it is near the demand.
std::string line_at(double um, const char *colour, const std::string &title) {
    const std::string style = fmt::format("with lines lw 1.6 dt 2 lc rgb '{}'", colour);
    return fmt::format(", {0} {1} title {2}, -{0} {1} notitle", um, style,
                       formats::plot_text(title));
}

// in : data_of() of the same signal is in the script
// out: commands for one panel: the band, the demand, and both limits
std::string panel(const cb_config &config, const channel_panels &one, unsigned signal,
                  const std::vector<double> &home) {
    const cb_channel_config &channel = config.channels[one.channel];
    const cb_signal_config &axis = config.signals[signal];
    std::vector<unsigned> others;
    for (const unsigned s : one.positions) {
        if (s != signal) others.push_back(s);
    }
    const std::string block = block_name(one, signal);
    const std::string at = others.empty() ? "demand" : "at " + place_text(config, others, home);
    std::string text = fmt::format(
        "set title {}\nset xrange [{}:{}]\nset xlabel {}\nset ylabel {}\nplot ",
        formats::plot_text(fmt::format("channel {} over {}", channel.name, axis.name)), axis.min,
        axis.max, formats::plot_text(fmt::format("{}, {}", axis.name, axis.unit)),
        formats::plot_text("demand, µm"));
    if (!others.empty()) {
        text += fmt::format("${} using 1:3:4 with filledcurves fc rgb '{}' title {}, ", block,
                            formats::plot_colour::band,
                            formats::plot_text("all positions of the other axes"));
    }
    text += fmt::format("${} using 1:2 with lines lw 2.2 lc rgb '{}' title {}", block,
                        formats::plot_colour::curve, formats::plot_text(at));
    text += line_at(static_cast<double>(channel.limit_um), formats::plot_colour::mean,
                    fmt::format("limit_um {:.6g}", channel.limit_um));
    return text +
           line_at(static_cast<double>(channel.error_um), formats::plot_colour::second,
                   fmt::format("error_um {:.6g}", channel.error_um)) +
           "\n";
}

// Draws the channels below each other into one file.
void draw(const cb_config &config, const std::vector<channel_panels> &channels,
          const std::vector<double> &home, const std::string &path) {
    demand_model model(config, home);
    std::string data, panels;
    std::size_t columns = 1;
    for (const auto &one : channels) columns = std::max(columns, one.positions.size());
    for (const auto &one : channels) {
        for (std::size_t i = 0; i < columns; ++i) {
            if (i >= one.positions.size()) {
                panels += "set multiplot next\n";
                continue;
            }
            data += data_of(model, one, one.positions[i]);
            panels += panel(config, one, one.positions[i], home);
        }
    }
    const int height = static_cast<int>(channels.size()) * panel_height + title_height;
    const std::string script =
        data +
        fmt::format(
            "set multiplot layout {},{} title {} font ',16'\n"
            "set border lw 0.8 lc rgb '#444444'\nset tics nomirror\n"
            "set grid lw 0.5 lc rgb '#dddddd'\nset key top right horizontal samplen 2\n"
            "set offsets 0, 0, graph 0.2, graph 0.04\nset lmargin 9\nset rmargin 3\n",
            channels.size(), columns,
            formats::plot_text(fmt::format("{}: demand of the compensation over the travel, "
                                           "revision {}",
                                           config.machine, config.revision))) +
        panels + "unset multiplot\n";
    const int width = std::max(least_width, panel_width * static_cast<int>(columns));
    formats::run_gnuplot(path, script, width, height);
}

}  // namespace

std::vector<std::string> plot_demand(const cb_config &config, const std::vector<double> &home,
                                     const std::string &path) {
    demand_model model(config, home);
    std::vector<channel_panels> channels;
    for (unsigned c = 0; c < config.channels_count; ++c) {
        const auto positions = model.positions_of(c);
        if (!positions.empty()) channels.push_back({c, positions});
    }
    if (channels.empty()) {
        throw input_error(path, 0, 0, "no channel depends on a position; leave --plot out");
    }
    if (std::filesystem::path(path).has_extension()) {
        draw(config, channels, home, path);
        return {path};
    }
    formats::make_folder(path);
    std::vector<std::string> files;
    for (const auto &one : channels) {
        files.push_back(fmt::format("{}/{}.svg", path, config.channels[one.channel].name));
        draw(config, {one}, home, files.back());
    }
    return files;
}

}  // namespace compbox::coefficients
