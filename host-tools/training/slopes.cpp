// SPDX-License-Identifier: MIT
#include "host-tools/training/slopes.h"

#include <algorithm>

#include "host-tools/formats/error.h"

namespace compbox::training {

namespace {

// The plain input with this column.
Eigen::Index plain_input(const train_result &result, std::size_t column) {
    for (std::size_t i = 0; i < result.inputs.size(); ++i) {
        const model_input &input = result.inputs[i];
        if (input.column == column && input.tau_s == 0.0 && input.power == 1 && !input.is_slope()) {
            return static_cast<Eigen::Index>(i);
        }
    }
    return -1;  // unreachable: every column is an input (model_inputs)
}

}  // namespace

// A slope's column is s = x (P - o), scaled (s - c_s) / r_s with weight L. With x = c + (x - c):
//     L s / r_s = gain (x - c)(P - o) + gain c (P - o),  gain = L / r_s
// The last part is linear in P and belongs to the weight of P; constants belong to the bias. Along
// several positions the last part has no weight of its own, so the slope counts its input from 0.
plain_linear linear_without_slopes(const train_result &result) {
    const trained_model &model = result.chosen;
    const regression::network_parts<const double> net(model.shape, model.parameters.data());
    const auto plain = static_cast<Eigen::Index>(result.plain_inputs());
    plain_linear all;
    all.bias = net.bias2;
    all.weights = Eigen::MatrixXd::Zero(model.shape.outputs, plain);
    if (!model.shape.linear) return all;
    all.weights = net.linear.leftCols(plain);
    for (std::size_t i = 0; i < result.inputs.size(); ++i) {
        const model_input &slope = result.inputs[i];
        if (!slope.is_slope()) continue;
        const auto at = static_cast<Eigen::Index>(i);
        const Eigen::Index x = plain_input(result, slope.column);
        const Eigen::VectorXd gain = net.linear.col(at) / model.in.scale[at];
        if (slope.along.size() > 1) {
            all.bias -= gain * model.in.centre[at];
            continue;
        }
        const Eigen::Index p = plain_input(result, static_cast<std::size_t>(slope.along[0]));
        const double centre = model.in.centre[x];
        all.weights.col(p) += gain * centre * model.in.scale[p];
        all.bias += gain * (centre * (model.in.centre[p] - slope.origin[0]) - model.in.centre[at]);
    }
    return all;
}

std::string positions_of(const train_result &result, const model_input &slope) {
    std::string names;
    for (const int column : slope.along) {
        names += result.data.inputs[static_cast<std::size_t>(column)];
    }
    return names;
}

// out: the contribution of each slope, in the order of the inputs
std::vector<slope_gain> slope_gains(const train_result &result) {
    const trained_model &model = result.chosen;
    const regression::network_parts<const double> net(model.shape, model.parameters.data());
    std::vector<slope_gain> gains;
    for (std::size_t i = 0; i < result.inputs.size(); ++i) {
        const model_input &slope = result.inputs[i];
        if (!slope.is_slope()) continue;
        const auto at = static_cast<Eigen::Index>(i);
        slope_gain gain;
        gain.along = slope.along;
        gain.input = plain_input(result, slope.column);
        if (slope.along.size() == 1) gain.from = model.in.centre[gain.input];
        gain.um_per_mm = model.out.scale.cwiseProduct(net.linear.col(at)) / model.in.scale[at];
        gains.push_back(gain);
    }
    return gains;
}

std::vector<Eigen::Index> distinct_positions(const train_result &result, const model_input &slope) {
    std::vector<Eigen::Index> inputs;
    if (slope.along.size() == 1) return inputs;
    for (const int column : slope.along) {
        const Eigen::Index at = plain_input(result, static_cast<std::size_t>(column));
        if (std::find(inputs.begin(), inputs.end(), at) == inputs.end()) inputs.push_back(at);
    }
    return inputs;
}

void check_slopes(const train_result &result) {
    for (const auto &slope : result.inputs) {
        if (!slope.is_slope()) continue;
        const std::string position = positions_of(result, slope);
        for (const auto &output : result.data.outputs) {
            const std::string name = fmt::format("{}_per_{}", output, position);
            if (is_name_of_the_box(name) &&
                is_name_of_the_box(fmt::format("{}_per_{}", result.options.name, position))) {
                continue;
            }
            throw input_error("--slope: the box has no room for the name '" + name +
                              "' of 23 characters at most: give the columns, or --name, shorter "
                              "names");
        }
    }
}

}  // namespace compbox::training
