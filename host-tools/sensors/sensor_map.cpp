// SPDX-License-Identifier: MIT
#include "host-tools/sensors/sensor_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host-tools/algebra/solvers.h"
#include "host-tools/formats/error.h"

namespace compbox::sensors {

namespace {

constexpr double common_shift = 10.0;         // K, of all sensors together: seasons
constexpr double above_left_out = 1.3;        // threshold over the largest residual left out
constexpr double least_threshold = 4.0;       // for records that are short and quiet
constexpr Eigen::Index least = 3, most = 32;  // CB_MAX_SENSORS
constexpr double accuracies[] = {0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0};

using rows = std::vector<Eigen::Index>;

// Mean and scatter of some rows.
struct statistics {
    Eigen::VectorXd center;
    Eigen::MatrixXd covariance;
};

statistics statistics_of(const Eigen::MatrixXd &values) {
    const Eigen::VectorXd center = values.colwise().mean();
    const Eigen::MatrixXd away = values.rowwise() - center.transpose();
    const double freedom = std::max(1.0, static_cast<double>(values.rows() - 1));
    return {center, away.transpose() * away / freedom};
}

// out: inverse of the covariance, with the sensors' own noise and the common shift in it
Eigen::MatrixXd precision_of(const statistics &of, double accuracy) {
    Eigen::MatrixXd all = of.covariance;
    all.diagonal().array() += accuracy * accuracy;
    all.array() += common_shift * common_shift;
    const Eigen::MatrixXd inverse = algebra::factor_positive_definite(all).inverse;
    return 0.5 * (inverse + inverse.transpose());
}

// One part of the record, and what the rest of it knows.
struct part {
    Eigen::MatrixXd values;
    rows row;  // of the record
    statistics rest;
};

Eigen::MatrixXd picked(const Eigen::MatrixXd &values, const rows &row) {
    Eigen::MatrixXd some(static_cast<Eigen::Index>(row.size()), values.cols());
    for (std::size_t i = 0; i < row.size(); ++i)
        some.row(static_cast<Eigen::Index>(i)) = values.row(row[i]);
    return some;
}

// Rows with a glitch belong to no part.
std::vector<part> parts_of(const training::training_data &data) {
    std::vector<rows> own;
    for (std::size_t r = 0; r < data.rows(); ++r) {
        const std::size_t run = data.run[r];
        const std::size_t number = data.together.empty() ? run : data.together[run];
        if (own.size() <= number) own.resize(number + 1);
        if (data.spoilt.empty() || !data.spoilt[r])
            own[number].push_back(static_cast<Eigen::Index>(r));
    }
    own.erase(std::remove_if(own.begin(), own.end(), [](const rows &r) { return r.empty(); }),
              own.end());
    std::vector<part> parts;
    for (std::size_t p = 0; own.size() > 1 && p < own.size(); ++p) {
        rows rest;
        for (std::size_t q = 0; q < own.size(); ++q)
            if (q != p) rest.insert(rest.end(), own[q].begin(), own[q].end());
        parts.push_back({picked(data.x, own[p]), own[p], statistics_of(picked(data.x, rest))});
    }
    return parts;
}

// The residuals of all parts, each by what the others know, for one accuracy.
struct left_out {
    double largest = 0.0;     // normalised
    disagreement where;       // of the largest
    Eigen::VectorXd squares;  // sum of (reading less prediction)^2, by sensor
    std::size_t count = 0;
};

// out: residuals as the box would have them with the map of each part's rest
left_out judge(const std::vector<part> &parts, double accuracy) {
    left_out all;
    all.squares = Eigen::VectorXd::Zero(parts.front().values.cols());
    for (const part &one : parts) {
        const Eigen::MatrixXd precision = precision_of(one.rest, accuracy);
        const Eigen::ArrayXd own = precision.diagonal();
        const Eigen::MatrixXd away = one.values.rowwise() - one.rest.center.transpose();
        const Eigen::ArrayXXd residual = (away * precision).array();
        const Eigen::ArrayXXd error = residual.rowwise() / own.transpose();
        const Eigen::ArrayXXd normal = residual.rowwise() / own.sqrt().transpose();
        Eigen::Index row = 0, sensor = 0;
        const double largest = normal.abs().maxCoeff(&row, &sensor);
        if (largest > all.largest) {
            all.largest = largest;
            all.where = {static_cast<std::size_t>(sensor),
                         static_cast<std::size_t>(one.row[static_cast<std::size_t>(row)]),
                         error(row, sensor)};
        }
        all.squares += error.square().colwise().sum().transpose().matrix();
        all.count += static_cast<std::size_t>(error.rows());
    }
    return all;
}

double threshold_of(const left_out &residuals) {
    return std::max(least_threshold, above_left_out * residuals.largest);
}

// out: by sensor, the offset whose normalised residual is the threshold
Eigen::ArrayXd smallest_offsets(const Eigen::MatrixXd &precision, double threshold) {
    return threshold * precision.diagonal().array().rsqrt();
}

void check(const training::training_data &data, std::size_t parts) {
    const Eigen::Index count = data.x.cols();
    if (count < least || count > most) {
        throw input_error(data.file, 0, 0, "{} sensors are named; name {} to {} with --sensors",
                          count, least, most);
    }
    if (parts < 2) {
        throw input_error(data.file, 0, 0,
                          "the record is one run: give one of two runs or days, so that one can be "
                          "left out");
    }
}

}  // namespace

sensor_map map_sensors(const training::training_data &data) {
    const std::vector<part> parts = parts_of(data);
    check(data, parts.size());
    rows sound;
    for (const part &one : parts) sound.insert(sound.end(), one.row.begin(), one.row.end());
    const statistics all = statistics_of(picked(data.x, sound));
    sensor_map best;
    double smallest = std::numeric_limits<double>::infinity();
    for (const double accuracy : accuracies) {
        const left_out residuals = judge(parts, accuracy);
        const Eigen::MatrixXd precision = precision_of(all, accuracy);
        const Eigen::ArrayXd offsets = smallest_offsets(precision, threshold_of(residuals));
        if (!(offsets.log().mean() < smallest)) continue;
        smallest = offsets.log().mean();
        best = {all.center,   precision, threshold_of(residuals), accuracy,
                parts.size(), {},        residuals.where};
        for (Eigen::Index j = 0; j < data.x.cols(); ++j) {
            best.sensors.push_back(
                {data.inputs[static_cast<std::size_t>(j)],
                 std::sqrt(residuals.squares[j] / static_cast<double>(residuals.count)),
                 offsets[j]});
        }
    }
    return best;
}

}  // namespace compbox::sensors
