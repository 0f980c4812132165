// SPDX-License-Identifier: MIT
// Squareness and linear roll from the face and body diagonals of a working space (ISO 230-6): one
// least-squares adjustment of all readings.
//
// A laser along a diagonal shows the error of the tool in the diagonal's direction, from a zero of
// its own in each set-up. Squareness tilts all parallel faces alike; roll that grows along its axis
// tilts them differently, because its lever arm is another one in each face.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace compbox::coefficients {

struct diagonal_target {
    std::size_t set_up;  // the diagonal and its run: readings with one common zero
    std::array<double, 3> position_mm;
    std::array<double, 3> along;  // unit vector, from the first target of the diagonal to the last
    double tool_mm;
    double error_um;  // measured minus nominal way from the first target
};

// Reads a table with the columns diagonal (a name), X_mm, Y_mm, Z_mm and error_um, and optionally
// run and tool_mm. in : tool_mm: tool length where the table has no such column; nothing: it must
// have one. Throws input_error for fewer than two targets of a diagonal, and for targets more than
// 1 mm beside the line from the first to the last.
std::vector<diagonal_target> read_diagonals(const std::string &path, std::optional<double> tool_mm);

// A cause of errors along diagonals, of which the adjustment finds the size.
struct diagonal_cause {
    enum kind { squareness, roll } is;
    std::string name;
    std::vector<double> along_um;  // error along each target's diagonal by a cause of size 1
};

struct diagonal_adjustment {
    struct size {
        double value, sigma;  // sigma: 1 standard deviation, by the residuals
    };
    std::map<std::string, size> found;  // by name
    // Causes that these diagonals do not tell from others; they are zero. Roll gives way to
    // squareness.
    std::vector<std::string> hidden;
    size scale_ppm;          // common scale of all readings, which has no effect on the others
    double residual_um = 0;  // standard deviation of a reading
    int freedom = 0;
};

// out: the sizes with the least sum of squares over error - along_um * size - scale - zero
diagonal_adjustment adjust_diagonals(const std::vector<diagonal_target> &targets,
                                     const std::vector<diagonal_cause> &causes);

}  // namespace compbox::coefficients
