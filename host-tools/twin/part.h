// SPDX-License-Identifier: MIT
// One cause of errors of the tool: geometry, heat, force … The twin's error is the sum of its
// parts. A part is constant; the state holds all that changes.
#pragma once

#include <memory>

#include "host-tools/twin/random.h"
#include "host-tools/twin/state.h"

namespace compbox::twin {

class error_part {
  public:
    virtual ~error_part() = default;
    // Displacement of the tool relative to the workpiece. Finite for every state inside the
    // travels.
    virtual xyz error_um(const twin_state &state) const = 0;
    // Sets the part's variables in the state, besides time and positions, as on a working machine.
    // For estimates of the range of errors.
    virtual void vary(twin_state &, random_stream &) const {}
};

using part_pointer = std::shared_ptr<const error_part>;

inline xyz sum_of(const xyz &a, const xyz &b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

}  // namespace compbox::twin
