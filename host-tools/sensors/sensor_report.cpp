// SPDX-License-Identifier: MIT
// Output of the sensors' map: the fragment for `build`, a table for a person.
#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "host-tools/formats/numbers.h"
#include "host-tools/sensors/sensor_map.h"

namespace compbox::sensors {

namespace {

json numbers(const Eigen::VectorXd &values) {
    json list = json::array();
    for (const double value : values) list.push_back(formats::short_float(value));
    return list;
}

}  // namespace

json fragment_of(const sensor_map &map, double after_s, const std::string &file) {
    json section{{"signals", json::array()},
                 {"center", numbers(map.center)},
                 {"precision", json::array()},
                 {"threshold", formats::short_float(map.threshold)},
                 {"after_s", formats::short_float(after_s)}};
    json smallest = json::object();
    for (const auto &sensor : map.sensors) {
        section["signals"].push_back(sensor.name);
        smallest[sensor.name] = formats::short_float(sensor.smallest);
    }
    for (const auto row : map.precision.rowwise()) section["precision"].push_back(numbers(row));
    return {{"sensors", section},
            {"provenance", {{"sensors", {{"data", file}, {"smallest_offset_found", smallest}}}}}};
}

std::string report_of(const sensor_map &map, const training::training_data &data, double find) {
    std::string text = fmt::format(
        "{} sensors, {} parts of the record left out in turn\n\n"
        "  sensor                   predicted within   smallest offset found\n",
        map.sensors.size(), map.parts);
    std::string blind;
    for (const auto &sensor : map.sensors) {
        text += fmt::format("  {:<23} {:>17.2f} {:>23.2f}\n", sensor.name, sensor.within,
                            sensor.smallest);
        if (sensor.smallest > find) blind += (blind.empty() ? "" : ", ") + sensor.name;
    }
    const disagreement &largest = map.largest;
    text += fmt::format(
        "\nLargest disagreement in the record: {} reads {:+.2f} against the others (row {}). If it "
        "was faulty then, leave that\npart out.\n",
        map.sensors[largest.sensor].name, largest.by, data.file_row[largest.row] + 1);
    if (blind.empty()) return text;
    return text +
           fmt::format(
               "An offset of {:g} is not found at: {}. The other sensors do not see the same "
               "heat; give these a second one nearby.\n",
               find, blind);
}

}  // namespace compbox::sensors
