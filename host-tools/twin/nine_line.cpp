// SPDX-License-Identifier: MIT
#include "host-tools/twin/nine_line.h"

#include <fmt/core.h>

#include "host-tools/formats/file.h"
#include "host-tools/formats/rtl.h"
#include "host-tools/twin/laser.h"
#include "host-tools/twin/set_up.h"

namespace compbox::twin {

namespace {

constexpr double um_per_mm_per_ppm = 1e-3, reference_degC = 20.0;

// in : point from 0: P1 …; direction 0 … 2: x … z
// out: all runs of this line, as one set-up of its own; deviations in µm
formats::laser_file measure_line(const twin_machine &twin, const nine_line_options &options,
                                 std::size_t point, std::size_t direction) {
    const auto a = static_cast<std::size_t>(axis_index(options.axis));
    const bool along = direction == a;
    const std::string name = fmt::format("P{}{}", point + 1, "xyz"[direction]);
    laser_set_up set_up(twin, std::string(1, options.axis) + " " + name, !along);
    formats::laser_file file;
    file.machine = twin.config().machine;
    file.axis = std::string(1, options.axis);
    file.title = name;
    file.targets_mm = virtual_laser(twin).targets_mm(options.axis);
    const double scale = along ? um_per_mm_per_ppm * options.scale_ppm_per_degC *
                                     (options.temperature_degC - reference_degC)
                               : 0.0;
    xyz position_mm = twin.config().start_mm;
    for (int run = 0; run < twin.config().laser.runs; ++run) {
        formats::laser_run one;
        for (std::size_t i = 0; i < file.targets_mm.size(); ++i) {
            const double at_mm = position_mm[a] = file.targets_mm[i];
            const xyz moved_um = twin.geometry().carriage_point_um(static_cast<int>(a),
                                                                   options.points_mm[point], at_mm);
            const double error_um =
                moved_um[direction] + set_up.unexplained_um(position_mm)[direction] + scale * at_mm;
            one.target.push_back(i);
            one.deviation.push_back(set_up.reading_um(error_um, at_mm - file.targets_mm.front()));
        }
        file.runs.push_back(one);
    }
    return file;
}

}  // namespace

std::vector<std::string> measure_nine_lines(const twin_machine &twin,
                                            const nine_line_options &options,
                                            const std::string &folder) {
    formats::make_folder(folder);
    std::vector<std::string> paths;
    for (std::size_t point = 0; point < options.points_mm.size(); ++point) {
        for (std::size_t direction = 0; direction < 3; ++direction) {
            const formats::laser_file file = measure_line(twin, options, point, direction);
            paths.push_back(fmt::format("{}/{}.rtl", folder, file.title));
            formats::write_file(paths.back(), formats::laser_text(file));
        }
    }
    return paths;
}

}  // namespace compbox::twin
