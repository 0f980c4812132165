// SPDX-License-Identifier: MIT
#include "host-tools/identification/monte_carlo.h"

#include <cmath>
#include <random>

#include "host-tools/algebra/solvers.h"

namespace compbox::identification {

namespace {

using vector6 = Eigen::Matrix<double, 6, 1>;

// Standard normal numbers by Box and Muller. The standard library's distribution differs between
// libraries, its generator does not.
class normal_numbers {
  public:
    explicit normal_numbers(std::uint64_t seed) : generator_(seed) {}

    double next() {
        if (spare_) {
            const double value = *spare_;
            spare_.reset();
            return value;
        }
        const double radius = std::sqrt(-2.0 * std::log(uniform()));
        const double angle = 2.0 * M_PI * uniform();
        spare_ = radius * std::sin(angle);
        return radius * std::cos(angle);
    }

  private:
    // In (0, 1].
    double uniform() { return (static_cast<double>(generator_() >> 11) + 1.0) * 0x1p-53; }

    std::mt19937_64 generator_;
    std::optional<double> spare_;
};

// Running mean and sum of squares (Welford).
struct tally {
    vector6 mean = vector6::Zero(), squares = vector6::Zero();
    double count = 0.0;

    void add(const vector6 &value) {
        count += 1.0;
        const vector6 before = value - mean;
        mean += before / count;
        squares += before.cwiseProduct(value - mean);
    }

    method_statistics statistics(const six &closed_form) const {
        method_statistics result;
        for (int k = 0; k < 6; ++k) {
            const auto i = static_cast<std::size_t>(k);
            result.mean[i] = mean(k);
            result.sigma[i] = std::sqrt(squares(k) / (count - 1.0));
            result.closed_form[i] = closed_form[i];
        }
        return result;
    }
};

}  // namespace

monte_carlo_result monte_carlo(const points_mm &points, const monte_carlo_options &options) {
    const Eigen::MatrixXd A = observation_matrix(points);
    const Eigen::Index lines = A.rows();
    const line_sigma sigma_um =
        options.sigma_um.size() > 0 ? options.sigma_um : line_sigma::Ones(lines);
    const auto rows = traditional_rows_of(options.axis);
    Eigen::Matrix<double, 6, 6> sequence;
    for (int i = 0; i < 6; ++i) sequence.row(i) = A.row(rows[static_cast<std::size_t>(i)]);
    six traditional_closed{};
    const bool solvable = traditional_sigma(points, options.axis, sigma_um, traditional_closed);
    const Eigen::VectorXd weight = sigma_um.cwiseInverse();
    const Eigen::MatrixXd improved =
        algebra::solve_least_squares(weight.asDiagonal() * A,
                                     Eigen::MatrixXd::Identity(lines, lines))
            .x *
        weight.asDiagonal();
    const Eigen::Matrix<double, 6, 6> traditional =
        algebra::solve_least_squares(sequence, Eigen::MatrixXd::Identity(6, 6)).x;
    const vector6 preset = Eigen::Map<const vector6>(options.preset.data());
    const Eigen::VectorXd ideal = A * preset;

    normal_numbers noise(options.seed);
    tally improved_tally, traditional_tally;
    for (unsigned run = 0; run < options.runs; ++run) {
        Eigen::VectorXd readings = ideal;
        for (Eigen::Index line = 0; line < lines; ++line) {
            readings(line) += sigma_um(line) * noise.next();
        }
        improved_tally.add(improved * readings);
        if (solvable) {
            vector6 six_readings;
            for (int i = 0; i < 6; ++i)
                six_readings(i) = readings(rows[static_cast<std::size_t>(i)]);
            traditional_tally.add(traditional * six_readings);
        }
        if (options.progress && run % 1024 == 0) options.progress(run / (1.0 * options.runs));
    }
    if (options.progress) options.progress(1.0);
    monte_carlo_result result;
    result.improved = improved_tally.statistics(closed_form_sigma(points, sigma_um));
    if (solvable) result.traditional = traditional_tally.statistics(traditional_closed);
    return result;
}

}  // namespace compbox::identification
