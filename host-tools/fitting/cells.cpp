// SPDX-License-Identifier: MIT
#include "host-tools/fitting/cells.h"

#include <algorithm>
#include <cmath>

namespace compbox::fitting {

namespace {

// Weighted sums of the readings of one run in one cell; x from the cell's centre, y from the first
// reading, so that nothing cancels.
struct cell {
    std::size_t index = 0;
    double centre = 0.0, first = 0.0;
    double weight = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
    int count = 0;

    void add(double position, double error, double sigma) {
        const double w = 1.0 / (sigma * sigma), dx = position - centre, dy = error - first;
        weight += w;
        x += w * dx;
        y += w * dy;
        xx += w * dx * dx;
        xy += w * dx * dy;
        yy += w * dy * dy;
        ++count;
    }
    double mean_x() const { return centre + x / weight; }
    double mean_y() const { return first + y / weight; }
    // out: weighted squares about the cell's own line; needs three readings
    double squares() const {
        const double sxx = xx - x * x / weight, sxy = xy - x * y / weight;
        const double syy = yy - y * y / weight;
        return std::max(sxx > 0.0 ? syy - sxy * sxy / sxx : syy, 0.0);
    }
};

std::vector<cell> cells_of(const measured_run &run, double from, double width) {
    std::vector<cell> cells;
    for (std::size_t i = 0; i < run.position.size(); ++i) {
        const auto index = static_cast<std::size_t>((run.position[i] - from) / width + 0.5);
        if (cells.empty() || cells.back().index != index) {
            cell next;
            next.index = index;
            next.centre = from + static_cast<double>(index) * width;
            next.first = run.error[i];
            cells.push_back(next);
        }
        cells.back().add(run.position[i], run.error[i], run.sigma[i]);
    }
    return cells;
}

// The mean of cell k at its centre, by the slope between its neighbours.
double at_centre(const std::vector<cell> &cells, std::size_t k) {
    const cell &before = cells[k > 0 ? k - 1 : k],
               &after = cells[std::min(k + 1, cells.size() - 1)];
    const double way = after.mean_x() - before.mean_x();
    const double slope = way > 0.0 ? (after.mean_y() - before.mean_y()) / way : 0.0;
    return cells[k].mean_y() + slope * (cells[k].centre - cells[k].mean_x());
}

}  // namespace

measurement in_cells(const measurement &data, std::size_t most) {
    if (data.position.size() <= most || most < 2) return data;
    const double width = (data.to() - data.from()) / static_cast<double>(most - 1);
    measurement result = data;
    result.cells.width_mm = width;
    std::vector<std::vector<cell>> all;
    double squares = 0.0;
    std::size_t entries = 0;
    for (const auto &run : data.runs) {
        all.push_back(cells_of(run, data.from(), width));
        entries += all.back().size();
        result.cells.readings += run.position.size();
        for (const auto &one : all.back()) {
            if (one.count < 3) continue;
            squares += one.squares();
            result.cells.freedom += one.count - 2;
        }
    }
    const double usual = static_cast<double>(result.cells.readings) / static_cast<double>(entries);
    for (std::size_t r = 0; r < all.size(); ++r) {
        measured_run &run = result.runs[r];
        run.position.clear();
        run.error.clear();
        run.sigma.clear();
        for (std::size_t k = 0; k < all[r].size(); ++k) {
            const cell &one = all[r][k];
            run.position.push_back(one.centre);
            run.error.push_back(at_centre(all[r], k));
            run.sigma.push_back(std::sqrt((data.sigma_given ? 1.0 : usual) / one.weight));
        }
    }
    if (result.cells.freedom > 0) {
        result.cells.variance = squares / result.cells.freedom / (data.sigma_given ? 1.0 : usual);
    }
    average_runs(result);
    result.cells.cells = result.position.size();
    return result;
}

}  // namespace compbox::fitting
