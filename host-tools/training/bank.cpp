// SPDX-License-Identifier: MIT
#include "host-tools/training/bank.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include "host-tools/formats/csv.h"

namespace compbox::training {

namespace {

constexpr std::size_t most_time_constants = 10;
constexpr double shortest_s = 60.0, longest_of_days_s = 43200.0;
constexpr double days_s = 4.0 * 86400.0;
constexpr std::size_t highest_power = 3;
constexpr double most_of_usual = 5.0;  // a column that moves more has another quantity

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Duration of the longest run and the median time between rows.
struct pace {
    double longest_s = 0.0, row_s = 0.0, whole_s = 0.0;
};

pace pace_of(const training_data &data) {
    pace found;
    std::vector<double> steps;
    std::size_t start = 0;
    for (std::size_t r = 1; r < data.rows(); ++r) {
        if (data.run[r] != data.run[r - 1]) start = r;
        if (start != r) steps.push_back(data.time_s[r] - data.time_s[r - 1]);
        found.longest_s = std::max(found.longest_s, data.time_s[r] - data.time_s[start]);
    }
    if (!steps.empty()) found.row_s = median(steps);
    found.whole_s = data.time_s.back() - data.time_s.front();
    return found;
}

// A number with two digits.
double two_digits(double value) {
    const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
    return std::round(value / unit) * unit;
}

double spread(const Eigen::VectorXd &values) {
    const double square = (values.array() - values.mean()).square().mean();
    return std::max(std::sqrt(square), 1e-6);
}

}  // namespace

bool is_name_of_a_speed(const std::string &name) {
    std::string lower;
    for (const char c : name) {
        lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    const auto has = [&](const char *word) { return lower.find(word) != std::string::npos; };
    return has("rpm") || has("speed") || has("drehzahl");
}

std::size_t powers_of(const std::vector<std::string> &speeds, const std::string &name) {
    return std::find(speeds.begin(), speeds.end(), name) == speeds.end() ? 1 : highest_power;
}

std::size_t room_for_lags(const std::vector<std::string> &inputs,
                          const std::vector<std::string> &speeds) {
    std::size_t columns = 0;
    for (const auto &name : inputs) columns += powers_of(speeds, name);
    return std::min(most_time_constants, most_bank_lags / columns);
}

std::vector<double> time_constants(const training_data &data, std::size_t count) {
    if (data.time_s.empty() || count == 0) return {};
    const pace rows = pace_of(data);
    const double usual = rows.whole_s >= days_s ? longest_of_days_s : usual_longest_s;
    const double from = std::max(shortest_s, 2.0 * rows.row_s);
    const double to = std::min(usual, rows.longest_s);
    if (to < 1.2 * from || count == 1) return {two_digits(std::max(from, std::sqrt(from * to)))};
    // Steps of a fifth are as fine as a warm-up can distinguish.
    const auto useful = static_cast<std::size_t>(std::log(to / from) / std::log(1.2)) + 1;
    const std::size_t steps = std::min(count, std::max<std::size_t>(useful, 2)) - 1;
    std::vector<double> tau_s;
    for (std::size_t k = 0; k <= steps; ++k) {
        const double part = static_cast<double>(k) / static_cast<double>(steps);
        tau_s.push_back(two_digits(from * std::pow(to / from, part)));
    }
    tau_s.erase(std::unique(tau_s.begin(), tau_s.end()), tau_s.end());
    return tau_s;
}

std::vector<model_input> bank_inputs(const training_data &data,
                                     const std::vector<std::string> &speeds,
                                     const std::vector<double> &tau_s) {
    std::vector<model_input> inputs;
    for (std::size_t c = 0; c < data.inputs.size(); ++c) {
        const std::string &name = data.inputs[c];
        for (std::size_t power = 1; power <= powers_of(speeds, name); ++power) {
            const std::string base = power == 1 ? name : fmt::format("{}^{}", name, power);
            inputs.push_back({base, c, 0.0, static_cast<int>(power)});
            for (const double tau : tau_s) {
                inputs.push_back(
                    {fmt::format("{} ({} s)", base, tau), c, tau, static_cast<int>(power)});
            }
        }
    }
    return inputs;
}

std::vector<std::vector<Eigen::Index>> bank_members(const std::vector<model_input> &inputs) {
    std::size_t taus = 0;
    while (taus + 1 < inputs.size() && inputs[taus + 1].tau_s > 0.0) ++taus;
    int highest = 1;
    for (const auto &input : inputs) highest = std::max(highest, input.power);
    std::vector<std::vector<Eigen::Index>> members;
    const auto add = [&](std::size_t stride, std::size_t offset, int most_power) {
        std::vector<Eigen::Index> columns;
        for (std::size_t i = 0; i < inputs.size(); ++i) {
            const std::size_t lag = i % (taus + 1);
            const bool used = lag == 0 || (lag - 1) % stride == offset;
            if (used && inputs[i].power <= most_power) {
                columns.push_back(static_cast<Eigen::Index>(i));
            }
        }
        members.push_back(columns);
    };
    for (int most_power = std::min(highest, 2); most_power <= highest; ++most_power) {
        for (std::size_t stride = 1; stride <= std::clamp<std::size_t>(taus, 1, 3); ++stride) {
            for (std::size_t offset = 0; offset < stride; ++offset) add(stride, offset, most_power);
        }
    }
    return members;
}

std::string unit_of(const std::string &column) {
    const std::size_t mark = column.find_last_of('_');
    const std::string unit = mark == std::string::npos ? "" : column.substr(mark + 1);
    return unit.empty() || unit.size() > 5 ? "1" : unit;  // a unit of the box has 7 bytes
}

Eigen::VectorXd bank_scales(const Eigen::MatrixXd &x, const std::vector<model_input> &inputs,
                            const std::vector<std::string> &columns) {
    const auto is_unlagged = [](const model_input &input) { return input.tau_s == 0.0; };
    std::map<std::size_t, int> powers;  // of each column: the highest
    for (const auto &input : inputs) powers[input.column] = input.power;
    std::map<std::string, std::vector<double>> by_unit;
    Eigen::VectorXd scales(x.cols());
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
        const model_input &input = inputs[static_cast<std::size_t>(i)];
        scales[i] = is_unlagged(input) ? spread(x.col(i)) : scales[i - 1];
        if (is_unlagged(input) && powers[input.column] == 1) {
            by_unit[unit_of(columns[input.column])].push_back(scales[i]);
        }
    }
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
        const std::size_t column = inputs[static_cast<std::size_t>(i)].column;
        if (powers[column] > 1) continue;
        const double usual = median(by_unit[unit_of(columns[column])]);
        if (scales[i] < most_of_usual * usual) scales[i] = usual;
    }
    return scales;
}

}  // namespace compbox::training
