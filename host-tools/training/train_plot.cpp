// SPDX-License-Identifier: MIT
// The figure of a training: for each output the measured values, the written model's predictions,
// and those of a model trained without the run.
#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/plot.h"
#include "host-tools/training/train.h"

namespace compbox::training {

namespace {

constexpr std::size_t most_points = 4000;  // of one curve, more than a figure has pixels

// Rows of the file once, in order: time, measured, predicted, left out; a gap between runs.
struct panel {
    std::vector<double> x, measured, predicted, left_out;
};

// Left-out predictions by row of the file; NaN where there is none.
std::vector<double> left_out_of(const train_result &result, std::size_t output) {
    std::vector<double> values(result.data.rows(), std::numeric_limits<double>::quiet_NaN());
    const auto k = static_cast<Eigen::Index>(output);
    const bool network = result.network_better[output];
    const judged_model &model = network ? result.network : result.linear;
    for (Eigen::Index i = 0; i < model.left_out_predictions.rows(); ++i) {
        const Eigen::Index row = network ? result.network_rows[static_cast<std::size_t>(i)] : i;
        double &value = values[result.learn.source[static_cast<std::size_t>(row)]];
        if (std::isnan(value)) value = model.left_out_predictions(i, k);
    }
    return values;
}

// in : all: the rows of the first lag start; predicted: one row each
// out: the curves of one output over the rows of the file, at most most_points each
panel panel_of(const train_result &result, const model_rows &all, const Eigen::MatrixXd &predicted,
               std::size_t output) {
    panel lines;
    const auto left_out = left_out_of(result, output);
    const auto k = static_cast<Eigen::Index>(output);
    const std::size_t step = result.data.rows() / most_points + 1;
    double last = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t r = 0; r < result.data.rows(); ++r) {
        if (!std::isnan(left_out[r])) last = left_out[r];
        if (r % step != 0) continue;
        const auto at = static_cast<Eigen::Index>(r);
        lines.x.push_back(result.data.time_s.empty() ? static_cast<double>(r + 1)
                                                     : result.data.time_s[r]);
        lines.measured.push_back(all.y(at, k));
        lines.predicted.push_back(predicted(at, k));
        lines.left_out.push_back(last);
        last = std::numeric_limits<double>::quiet_NaN();
    }
    return lines;
}

// The measured less the predicted values, on an axis of their own.
std::string residual_panel(const std::string &name, const std::string &output,
                           const std::string &x_label) {
    return fmt::format(
        "set xlabel '{}'\nset ylabel {}\n"
        "plot 0 with lines lw 0.8 lc rgb '#444444' notitle, {} using 1:($2-$4) with points pt 7 ps "
        "0.18 lc rgb '{}' title 'left by the model that never saw this run', {} using 1:($2-$3) "
        "with lines lw 1.2 lc rgb '{}' title 'left by the model'\n",
        x_label, formats::plot_text(output + ", residual"), name, formats::plot_colour::second,
        name, formats::plot_colour::curve);
}

}  // namespace

void plot_training(const train_result &result, const std::string &path) {
    const model_rows all =
        rows_of(result.data, result.inputs,
                result.options.starts_of_lags == lag_starts::both ? lag_starts::once
                                                                  : result.options.starts_of_lags);
    const Eigen::MatrixXd predicted = result.predict(result.chosen, all.x, all);
    const std::size_t outputs = result.data.outputs.size();
    std::string script, panels;
    for (std::size_t k = 0; k < outputs; ++k) {
        const panel lines = panel_of(result, all, predicted, k);
        const std::string name = fmt::format("$output{}", k);
        script += formats::plot_data(fmt::format("output{}", k),
                                     {lines.x, lines.measured, lines.predicted, lines.left_out});
        panels += fmt::format("unset xlabel\nset ylabel {}\n",
                              formats::plot_text(result.data.outputs[k]));
        panels += fmt::format(
            "plot {} using 1:2 with lines lw 2.4 lc rgb '{}' title 'measured', {} using 1:3 with "
            "lines lw 1.4 lc rgb '{}' title 'model', {} using 1:4 with points pt 7 ps 0.18 lc rgb "
            "'{}' title 'model that never saw this run'\n",
            name, formats::plot_colour::grey, name, formats::plot_colour::curve, name,
            formats::plot_colour::second);
        panels += residual_panel(name, result.data.outputs[k],
                                 result.data.time_s.empty() ? "row" : "time, s");
    }
    script += fmt::format(
        "set multiplot layout {},1 title {}\n"
        "set border lw 0.8 lc rgb '#444444'\n"
        "set tics nomirror\n"
        "set grid lw 0.5 lc rgb '#dddddd'\n"
        "set key top right horizontal samplen 2\n"
        "set lmargin 10\n"
        "set rmargin 3\n"
        "{}unset multiplot\n",
        2 * outputs,
        formats::plot_text(
            fmt::format("{}: measured values, model and residuals, {}", result.options.name,
                        std::filesystem::path(result.data.file).filename().string())),
        panels);
    formats::run_gnuplot(path, script, 1000, 120 + 400 * static_cast<int>(outputs));
}

}  // namespace compbox::training
