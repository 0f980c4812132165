// SPDX-License-Identifier: MIT
// The inputs of a bank: columns to their powers, each unlagged and with each time constant, and the
// parts of them that the averaged maps use.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host-tools/training/lagged.h"

namespace compbox::training {

constexpr std::size_t most_bank_lags = 256;   // CB_MAX_BANK_LAGS
constexpr std::size_t most_bank_inputs = 64;  // CB_MAX_SIGNALS
constexpr double usual_longest_s = 10800.0;   // time constant, of a record of less than four days

// Whether a name has "rpm", "speed" or "drehzahl" in it, in any case.
bool is_name_of_a_speed(const std::string &name);

// Columns with their powers: speeds are taken to the powers 1, 2 and 3.
std::size_t powers_of(const std::vector<std::string> &speeds, const std::string &name);

// out: number of time constants that fit the box, for these inputs; at most ten
std::size_t room_for_lags(const std::vector<std::string> &inputs,
                          const std::vector<std::string> &speeds);

// in : data.time_s, or none; count: at most so many
// out: time constants in geometric steps, s, ascending: from a minute, or two rows, to three hours
//      (half a day in a record of four days), or the longest run; none without a time
std::vector<double> time_constants(const training_data &data, std::size_t count);

// The inputs in the order of the coefficient file: column, power, time constant (0 first).
std::vector<model_input> bank_inputs(const training_data &data,
                                     const std::vector<std::string> &speeds,
                                     const std::vector<double> &tau_s);

// The parts of the inputs that the averaged maps use: with every one, every second and every third
// time constant from each beginning; speeds to their square and to their cube.
std::vector<std::vector<Eigen::Index>> bank_members(const std::vector<model_input> &inputs);

// in : rows of bank_inputs
// out: the scale of each input for weight decay. Lags of an input share the spread of the unlagged
//      one. Sensors share the median spread of those with the same unit, so that one that hardly
//      moves gets less weight; a column that moves by five times as much keeps its own
Eigen::VectorXd bank_scales(const Eigen::MatrixXd &x, const std::vector<model_input> &inputs,
                            const std::vector<std::string> &columns);

// The unit at the end of a column's name (t1_degC), else 1.
std::string unit_of(const std::string &column);

}  // namespace compbox::training
