// SPDX-License-Identifier: MIT
// What each sensor of a machine should read, by all its other sensors: the section "sensors" of a
// coefficient file (firmware/signals/sensors.h), from a record of healthy ones.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"
#include "host-tools/training/dataset.h"

namespace compbox::sensors {

// One sensor, by parts of the record that were left out.
struct checked_sensor {
    std::string name;
    double within = 0.0;    // rms of reading less prediction by the others, unit of the sensor
    double smallest = 0.0;  // smallest offset that the box finds, unit of the sensor
};

struct disagreement {
    std::size_t sensor = 0, row = 0;  // row of the training data
    double by = 0.0;                  // reading less prediction, unit of the sensor
};

struct sensor_map {
    Eigen::VectorXd center;
    Eigen::MatrixXd precision;  // symmetric, positive definite
    double threshold = 0.0;     // of the box's normalised residual
    double accuracy = 0.0;      // chosen: noise of each sensor alone, unit of the sensor
    std::size_t parts = 0;      // that were left out, one after the other
    std::vector<checked_sensor> sensors;
    disagreement largest;  // of the parts left out
};

// The covariance of the readings, with a common shift of all sensors of 10 K, because a record does
// not have every season, and the noise of each sensor alone. That noise is the one of a grid, 0.02
// to 2 K, with which the box finds the smallest offsets: in the geometric mean over the sensors,
// and with a threshold above every residual of the parts left out.
// in : data: runs as parts; three sensors at least, 32 at most. Throws input_error for fewer or
//      more, or a record of one part.
sensor_map map_sensors(const training::training_data &data);

// out: the fragment for `build`: {"sensors": …, "provenance": …}
json fragment_of(const sensor_map &map, double after_s, const std::string &file);

// out: the table for a person. find: the offset that each sensor should be checked for, its unit
std::string report_of(const sensor_map &map, const training::training_data &data, double find);

}  // namespace compbox::sensors
