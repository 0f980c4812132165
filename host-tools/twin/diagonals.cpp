// SPDX-License-Identifier: MIT
#include "host-tools/twin/diagonals.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "host-tools/twin/set_up.h"

namespace compbox::twin {

namespace {

struct diagonal {
    std::string name;
    xyz from_mm, to_mm;
};

// Makes the axis fall along the diagonal.
void turn(diagonal &one, std::size_t axis) {
    std::swap(one.from_mm[axis], one.to_mm[axis]);
}

// out: both diagonals of each face, then those of the body, from low to high X (Y on faces YZ)
std::vector<diagonal> diagonals_of(const xyz &low_mm, const xyz &high_mm) {
    std::vector<diagonal> made;
    for (std::size_t across = 0; across < 3; ++across) {
        const std::size_t first = across == 0 ? 1 : 0, second = across == 2 ? 1 : 2;
        for (const bool high : {false, true}) {
            diagonal face = {
                fmt::format("{}{} {}", "XYZ"[first], "XYZ"[second], high ? "high" : "low"), low_mm,
                high_mm};
            face.from_mm[across] = face.to_mm[across] = high ? high_mm[across] : low_mm[across];
            diagonal rising = face, falling = face;
            rising.name += " rising";
            falling.name += " falling";
            turn(falling, second);
            made.insert(made.end(), {rising, falling});
        }
    }
    for (const bool y : {false, true}) {
        for (const bool z : {false, true}) {
            diagonal body = {fmt::format("body{}{}{}", y ? " Y" : "", z ? " Z" : "",
                                         y || z ? " falling" : " rising"),
                             low_mm, high_mm};
            if (y) turn(body, 1);
            if (z) turn(body, 2);
            made.push_back(body);
        }
    }
    return made;
}

}  // namespace

std::vector<diagonal_reading> measure_diagonals(
    const twin_machine &twin, const xyz &low_mm, const xyz &high_mm, int targets,
    const std::function<twin_state(const xyz &)> &compensation) {
    std::vector<diagonal_reading> readings;
    for (const diagonal &one : diagonals_of(low_mm, high_mm)) {
        laser_set_up set_up(twin, one.name + " diagonal", false);
        xyz way = {};
        for (std::size_t a = 0; a < 3; ++a) way[a] = one.to_mm[a] - one.from_mm[a];
        const double length = std::hypot(way[0], way[1], way[2]);
        for (int run = 1; run <= twin.config().laser.runs; ++run) {
            for (int k = 0; k < targets; ++k) {
                xyz place = one.from_mm;
                for (std::size_t a = 0; a < 3; ++a) place[a] += way[a] * k / (targets - 1);
                const xyz known = twin.explained_error_um(compensation(place));
                const xyz rest = set_up.unexplained_um(place);
                double along = 0.0;
                for (std::size_t a = 0; a < 3; ++a) along += (known[a] + rest[a]) * way[a] / length;
                readings.push_back({one.name, run, place, set_up.reading_um(along, 0.0)});
            }
        }
    }
    return readings;
}

std::string diagonals_text(const std::vector<diagonal_reading> &readings) {
    std::string text = "diagonal,run,X_mm,Y_mm,Z_mm,error_um\n";
    for (const diagonal_reading &one : readings) {
        fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{}\n", one.diagonal, one.run,
                       one.position_mm[0], one.position_mm[1], one.position_mm[2], one.error_um);
    }
    return text;
}

}  // namespace compbox::twin
