// SPDX-License-Identifier: MIT
#include "host-tools/training/glitches.h"

#include <algorithm>
#include <cmath>

namespace compbox::training {

namespace {

constexpr std::size_t longest_glitch = 5;  // rows
constexpr double beyond_steps = 8.0;       // of the step that 19 of 20 steps do not exceed
constexpr double part_of_range = 0.05;     // smaller ones do no harm
constexpr double beyond_others = 3.0;      // of the largest step that remains
constexpr double smooth_range = 4.0;       // least range of a smooth column, in such steps

Eigen::Index at(std::size_t row) {
    return static_cast<Eigen::Index>(row);
}

// Row numbers first … end - 1 of one run.
struct stretch {
    std::size_t first, end;
};

std::vector<stretch> runs_of(const Eigen::VectorXd &values,
                             const std::vector<std::size_t> &starts) {
    std::vector<stretch> runs;
    for (std::size_t k = 0; k < starts.size(); ++k) {
        const std::size_t end =
            k + 1 < starts.size() ? starts[k + 1] : static_cast<std::size_t>(values.size());
        runs.push_back({starts[k], end});
    }
    return runs;
}

std::vector<double> steps_of(const Eigen::VectorXd &values, const std::vector<stretch> &runs) {
    std::vector<double> steps;
    for (const stretch &run : runs) {
        for (std::size_t r = run.first + 1; r < run.end; ++r) {
            steps.push_back(std::abs(values[at(r)] - values[at(r - 1)]));
        }
    }
    return steps;
}

// out: the smallest step that counts as a jump; infinite for a column without steps
double least_jump(const Eigen::VectorXd &values, const std::vector<stretch> &runs) {
    std::vector<double> steps = steps_of(values, runs), sorted(values.begin(), values.end());
    if (steps.empty()) return INFINITY;
    const auto part = [](std::vector<double> &of, double quantile) {
        const auto place =
            of.begin() + static_cast<std::ptrdiff_t>(quantile * static_cast<double>(of.size() - 1));
        std::nth_element(of.begin(), place, of.end());
        return *place;
    };
    const double range = part(sorted, 0.99) - part(sorted, 0.01);
    return std::max({beyond_steps * part(steps, 0.95), part_of_range * range, 1e-9});
}

// in : from: a row behind a jump, in the run; jump: the least
// out: the last row of the glitch that begins there, or its run's end if it does not come back
std::size_t end_of_glitch(const Eigen::VectorXd &values, const stretch &run, std::size_t from,
                          double jump) {
    const double home = values[at(from - 1)];
    const double away = values[at(from)] - home;
    for (std::size_t r = from + 1; r < run.end && r <= from + longest_glitch; ++r) {
        const double back = values[at(r)] - values[at(r - 1)];
        if (std::abs(back) > jump && std::abs(values[at(r)] - home) < 0.5 * std::abs(away)) {
            return r - 1;
        }
    }
    const bool last_rows = from + longest_glitch >= run.end;
    return last_rows ? run.end - 1 : run.end;
}

glitch between(const Eigen::VectorXd &values, const stretch &run, std::size_t first,
               std::size_t last) {
    glitch found{first, last, values[at(first)], 0.0, 0.0};
    found.after = values[at(last + 1 < run.end ? last + 1 : first - 1)];
    found.before = first > run.first ? values[at(first - 1)] : found.after;
    for (std::size_t r = first; r <= last; ++r) {
        if (std::abs(values[at(r)] - found.before) > std::abs(found.reached - found.before)) {
            found.reached = values[at(r)];
        }
    }
    return found;
}

// The stretches of one run that leave and come back.
void find_in(const Eigen::VectorXd &values, const stretch &run, double jump,
             std::vector<glitch> &found) {
    if (run.end - run.first <= 2 * longest_glitch) return;
    const auto jumps = [&](std::size_t r) {
        return std::abs(values[at(r)] - values[at(r - 1)]) > jump;
    };
    std::size_t r = run.first + 1;
    // A jump in the first rows of a run: its beginning is the glitch, unless it comes back.
    for (; r <= run.first + longest_glitch; ++r) {
        if (!jumps(r)) continue;
        if (end_of_glitch(values, run, r, jump) < run.end) break;
        found.push_back(between(values, run, run.first, r - 1));
        ++r;
        break;
    }
    for (; r < run.end; ++r) {
        if (!jumps(r)) continue;
        const std::size_t last = end_of_glitch(values, run, r, jump);
        if (last == run.end) continue;
        found.push_back(between(values, run, r, last));
        r = last + 1;
    }
}

// Keeps the glitches that stand out from the other steps of a smooth column.
void keep_clear(const Eigen::VectorXd &values, const std::vector<stretch> &runs,
                std::vector<glitch> &found) {
    Eigen::VectorXd mended = values;
    bridge(mended, found);
    const std::vector<double> steps = steps_of(mended, runs);
    const double largest = *std::max_element(steps.begin(), steps.end());
    const double range = mended.maxCoeff() - mended.minCoeff();
    const bool smooth = range > smooth_range * largest;
    const auto unclear = [&](const glitch &one) {
        return !smooth || std::abs(one.reached - one.before) <= beyond_others * largest;
    };
    found.erase(std::remove_if(found.begin(), found.end(), unclear), found.end());
}

}  // namespace

std::vector<glitch> find_glitches(const Eigen::VectorXd &values,
                                  const std::vector<std::size_t> &starts) {
    const std::vector<stretch> runs = runs_of(values, starts);
    const double jump = least_jump(values, runs);
    std::vector<glitch> found;
    for (const stretch &run : runs) find_in(values, run, jump, found);
    if (!found.empty()) keep_clear(values, runs, found);
    return found;
}

void bridge(Eigen::Ref<Eigen::VectorXd> values, const std::vector<glitch> &glitches) {
    for (const glitch &one : glitches) {
        const double steps = static_cast<double>(one.last - one.first + 2);
        for (std::size_t r = one.first; r <= one.last; ++r) {
            const double share = static_cast<double>(r - one.first + 1) / steps;
            values[at(r)] = one.before + share * (one.after - one.before);
        }
    }
}

}  // namespace compbox::training
