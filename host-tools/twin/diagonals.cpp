// SPDX-License-Identifier: MIT
#include "host-tools/twin/diagonals.h"

#include <cmath>

#include "host-tools/twin/set_up.h"

namespace compbox::twin {

namespace {

using at_rest = std::function<twin_state(const xyz &)>;

std::array<std::size_t, 2> axes_of(const std::string &name) {
    if (name == "C0Y") return {0, 1};
    if (name == "B0Z") return {0, 2};
    return {1, 2};
}

// Length from one place to another minus the control's displayed length.
double lengthening_um(const twin_machine &twin, const xyz &from_mm, const xyz &to_mm,
                      laser_set_up &set_up, const at_rest &compensation) {
    xyz way = {};
    double length = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
        way[a] = to_mm[a] - from_mm[a];
        length += way[a] * way[a];
    }
    length = std::sqrt(length);
    const auto shown = [&](const xyz &place) {
        const xyz known = twin.explained_error_um(compensation(place));
        const xyz rest = set_up.unexplained_um(place);
        double along = 0.0;
        for (std::size_t a = 0; a < 3; ++a) along += (known[a] + rest[a]) * way[a] / length;
        return set_up.reading_um(along, 0.0);
    };
    const double start_um = shown(from_mm);
    return shown(to_mm) - start_um;
}

}  // namespace

diagonals measure_diagonals(const twin_machine &twin, const face &rectangle,
                            const at_rest &compensation) {
    const auto [first, second] = axes_of(rectangle.name);
    xyz low = rectangle.corner_mm, high = low, right = low, left = low;
    high[first] = right[first] = low[first] + rectangle.first_mm;
    high[second] = left[second] = low[second] + rectangle.second_mm;
    laser_set_up rising(twin, "rising diagonal " + rectangle.name, false);
    laser_set_up falling(twin, "falling diagonal " + rectangle.name, false);
    const int runs = twin.config().laser.runs;
    diagonals mean = {};
    for (int run = 0; run < runs; ++run) {
        mean.rising_um += lengthening_um(twin, low, high, rising, compensation) / runs;
        mean.falling_um += lengthening_um(twin, left, right, falling, compensation) / runs;
    }
    return mean;
}

}  // namespace compbox::twin
