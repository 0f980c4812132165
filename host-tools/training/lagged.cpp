// SPDX-License-Identifier: MIT
#include "host-tools/training/lagged.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

namespace compbox::training {

namespace {

bool is_in(const std::vector<std::string> &names, const std::string &name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

void check_names(const training_data &data, const std::vector<std::string> &names,
                 const char *option) {
    for (const auto &name : names) {
        if (is_in(data.inputs, name)) continue;
        throw input_error(
            fmt::format("{} names '{}', which is not among the inputs", option, name));
    }
}

// base + suffix, the base cut to the box's length. Equal results get numbers.
std::string new_name(const std::vector<model_input> &taken, const std::string &base,
                     const std::string &suffix) {
    for (int attempt = 1;; ++attempt) {
        const std::string end = attempt == 1 ? suffix : fmt::format("-{}{}", attempt, suffix);
        const std::string name = base.substr(0, longest_name - end.size()) + end;
        const auto same = [&](const model_input &input) { return input.name == name; };
        if (std::none_of(taken.begin(), taken.end(), same)) return name;
    }
}

std::string lag_suffix(double tau_s) {
    return fmt::format("_lag{}", tau_s);
}

// One column's lag over one run.
void follow(const Eigen::VectorXd &u, const std::vector<double> &time_s, double tau_s,
            std::size_t from, std::size_t to, Eigen::Ref<Eigen::VectorXd> y) {
    const auto at = [](std::size_t row) { return static_cast<Eigen::Index>(row); };
    y[at(from)] = u[at(from)];
    for (std::size_t r = from + 1; r < to; ++r) {
        const double h = (time_s[r] - time_s[r - 1]) / tau_s;
        const double gain = -std::expm1(-h), ramp = 1.0 - gain / h;
        const double last = y[at(r - 1)], u0 = u[at(r - 1)], u1 = u[at(r)];
        y[at(r)] = last + gain * (u0 - last) + ramp * (u1 - u0);
    }
}

// The column's lag at each row, computed over the history.
Eigen::VectorXd remembered(const training_data &data, const Eigen::VectorXd &u, double tau_s) {
    const auto at = [](std::size_t row) { return static_cast<Eigen::Index>(row); };
    const std::size_t count = data.history_s.size();
    Eigen::VectorXd y(u.size()), rows(at(data.rows()));
    follow(u, data.history_s, tau_s, 0, count, y);
    for (std::size_t r = 0; r < data.rows(); ++r) {
        const double now_s = data.time_s[r];
        const auto above = std::upper_bound(data.history_s.begin(), data.history_s.end(), now_s);
        const auto row = static_cast<std::size_t>(above - data.history_s.begin()) - 1;
        rows[at(r)] = y[at(row)];
        const double since_s = now_s - data.history_s[row];
        if (since_s <= 0.0 || row + 1 == count) continue;
        // On the straight line to the next row of the history.
        const double share = since_s / (data.history_s[row + 1] - data.history_s[row]);
        const double h = since_s / tau_s, gain = -std::expm1(-h), ramp = 1.0 - gain / h;
        rows[at(r)] +=
            gain * (u[at(row)] - y[at(row)]) + ramp * share * (u[at(row + 1)] - u[at(row)]);
    }
    return rows;
}

Eigen::VectorXd to_power(Eigen::VectorXd u, int power) {
    const Eigen::ArrayXd base = u.array();
    for (int k = 1; k < power; ++k) u.array() *= base;
    return u;
}

// All inputs, with lags over the history.
Eigen::MatrixXd inputs_remembered(const training_data &data,
                                  const std::vector<model_input> &inputs) {
    Eigen::MatrixXd x(data.x.rows(), inputs.size());
    for (std::size_t c = 0; c < inputs.size(); ++c) {
        const auto column = static_cast<Eigen::Index>(inputs[c].column);
        const auto at = static_cast<Eigen::Index>(c);
        if (inputs[c].tau_s > 0.0) {
            x.col(at) = remembered(data, to_power(data.history.col(column), inputs[c].power),
                                   inputs[c].tau_s);
        } else {
            x.col(at) = to_power(data.x.col(column), inputs[c].power);
        }
    }
    return x;
}

void multiply_slopes(Eigen::Ref<Eigen::MatrixXd> x, const training_data &data,
                     const std::vector<model_input> &inputs) {
    for (std::size_t c = 0; c < inputs.size(); ++c) {
        for (std::size_t k = 0; k < inputs[c].along.size(); ++k) {
            x.col(static_cast<Eigen::Index>(c)).array() *=
                data.x.col(inputs[c].along[k]).array() - inputs[c].origin[k];
        }
    }
}

// All inputs, with lags that start at the rows in `starts` (the first is 0).
Eigen::MatrixXd inputs_from(const training_data &data, const std::vector<model_input> &inputs,
                            const std::vector<std::size_t> &starts) {
    Eigen::MatrixXd x(data.x.rows(), inputs.size());
    for (std::size_t c = 0; c < inputs.size(); ++c) {
        const auto at = static_cast<Eigen::Index>(c);
        const Eigen::VectorXd u =
            to_power(data.x.col(static_cast<Eigen::Index>(inputs[c].column)), inputs[c].power);
        x.col(at) = u;
        for (std::size_t k = 0; inputs[c].tau_s > 0.0 && k < starts.size(); ++k) {
            const std::size_t end = k + 1 < starts.size() ? starts[k + 1] : data.rows();
            follow(u, data.time_s, inputs[c].tau_s, starts[k], end, x.col(at));
        }
    }
    return x;
}

// out: the columns of a slope's inputs, in the order of the list; * matches any text
std::vector<std::size_t> columns_like(const training_data &data,
                                      const std::vector<std::string> &patterns) {
    std::vector<std::size_t> columns;
    for (const auto &pattern : patterns) {
        const std::size_t before = columns.size();
        for (std::size_t c = 0; c < data.inputs.size(); ++c) {
            if (::fnmatch(pattern.c_str(), data.inputs[c].c_str(), 0) == 0) columns.push_back(c);
        }
        if (columns.size() == before) check_names(data, {pattern}, "--slope");
    }
    return columns;
}

}  // namespace

std::vector<model_input> model_inputs(const training_data &data, const lag_options &options) {
    check_names(data, options.only, "--lag-only");
    check_names(data, options.squares, "--squares");
    std::vector<model_input> inputs;
    for (std::size_t c = 0; c < data.inputs.size(); ++c) inputs.push_back({data.inputs[c], c});
    for (const double tau_s : options.lags_s) {
        for (std::size_t c = 0; c < data.inputs.size(); ++c) {
            if (!options.only.empty() && !is_in(options.only, data.inputs[c])) continue;
            inputs.push_back({new_name(inputs, data.inputs[c], lag_suffix(tau_s)), c, tau_s, 1});
        }
    }
    for (std::size_t c = 0; c < data.inputs.size(); ++c) {
        if (!is_in(options.squares, data.inputs[c])) continue;
        inputs.push_back({new_name(inputs, data.inputs[c], "_sq"), c, square_tau_s, 2});
        for (const double tau_s : options.lags_s) {
            inputs.push_back(
                {new_name(inputs, data.inputs[c], "_sq" + lag_suffix(tau_s)), c, tau_s, 2});
        }
    }
    return inputs;
}

void add_slopes(std::vector<model_input> &inputs, const training_data &data,
                const std::vector<slope_option> &slopes) {
    const auto index_of = [&](const std::string &name) {
        check_names(data, {name}, "--slope");
        return std::find(data.inputs.begin(), data.inputs.end(), name) - data.inputs.begin();
    };
    for (const auto &slope : slopes) {
        model_input input;
        std::string positions;
        for (const auto &name : slope.along) {
            const auto along = static_cast<int>(index_of(name));
            const auto position = data.x.col(along);
            input.along.push_back(along);
            input.origin.push_back(std::round(0.5 * (position.minCoeff() + position.maxCoeff())));
            positions += " * " + name;
        }
        for (const std::size_t column : columns_like(data, slope.of)) {
            input.column = column;
            input.name = data.inputs[column] + positions;
            inputs.push_back(input);
        }
    }
}

model_rows rows_of(const training_data &data, const std::vector<model_input> &inputs,
                   lag_starts starts) {
    const bool twice = starts == lag_starts::both;
    if (data.history_s.empty() && data.reordered && starts != lag_starts::each_run &&
        !data.time_s.empty()) {
        throw input_error(data.file, 0, 0,
                          "rows of the runs stand between each other, so they are not one record: "
                          "choose --lags-start run");
    }
    const Eigen::Index n = data.x.rows();
    model_rows rows;
    rows.x.resize(twice ? 2 * n : n, static_cast<Eigen::Index>(inputs.size()));
    rows.y.resize(rows.x.rows(), data.y.cols());
    if (starts != lag_starts::each_run && !data.history_s.empty()) {
        rows.x.topRows(n) = inputs_remembered(data, inputs);
    } else {
        rows.x.topRows(n) = inputs_from(
            data, inputs,
            starts == lag_starts::each_run ? data.run_starts : std::vector<std::size_t>{0});
    }
    if (twice) rows.x.bottomRows(n) = inputs_from(data, inputs, data.run_starts);
    multiply_slopes(rows.x.topRows(n), data, inputs);
    if (twice) multiply_slopes(rows.x.bottomRows(n), data, inputs);
    for (int copy = 0; copy < (twice ? 2 : 1); ++copy) {
        rows.y.middleRows(copy * n, n) = data.y;
        for (std::size_t r = 0; r < data.rows(); ++r) {
            rows.run.push_back(data.run[r]);
            rows.source.push_back(r);
        }
    }
    return rows;
}

}  // namespace compbox::training
