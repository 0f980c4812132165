// SPDX-License-Identifier: MIT
// Geometric errors: six of each axis and three of squareness, combined by full homogeneous matrices
// along the kinematic chain (docs/twin.md, "The geometry").
#pragma once

#include <map>

#include "host-tools/twin/error_curve.h"
#include "host-tools/twin/part.h"

namespace compbox::twin {

class geometry : public error_part {
  public:
    explicit geometry(const twin_config &config);

    xyz error_um(const twin_state &state) const override;

    // For the virtual instruments: one error of one axis ("EZX": µm, "EAX": µrad), or the
    // positioning error of one side of a stage by the name of its drive ("X1"). The name must
    // exist.
    double curve(const std::string &name, double position_mm) const;
    // Displacement in µm of a point fixed to the carriage of an axis; point_mm in the axis' own
    // frame.
    xyz carriage_point_um(int axis, const xyz &point_mm, double position_mm) const;

  private:
    // {δx δy δz, εx εy εz} in µm and µrad.
    using six = std::array<double, 6>;
    using drives = std::array<double, 2>;

    six errors_of(int axis, double position_mm, const drives &drive_um) const;
    void add_stage(int axis, double position_mm, const drives &drive_um, six &errors) const;

    struct placed_curve {
        int axis, direction;  // direction: 0..5 as in error_name
        error_curve curve;
    };

    twin_chain chain_;
    std::array<std::optional<twin_stage>, 3> stages_;
    std::map<std::string, placed_curve> curves_;  // by ISO 230-1 name
    std::map<std::string, error_curve> sides_;    // by drive
};

}  // namespace compbox::twin
