// SPDX-License-Identifier: MIT
#include "host-tools/metrology/mirrored.h"

#include <algorithm>
#include <cmath>

#include "host-tools/metrology/straightness.h"

namespace compbox::metrology {

namespace {

constexpr std::size_t least_targets = 5;
constexpr double least_correlation = 0.9;

using curve = std::vector<double>;

double product(const curve &a, const curve &b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
}

double rms(const curve &a) {
    return std::sqrt(product(a, a) / static_cast<double>(a.size()));
}

// Two curves without their offsets: their correlation, and the size of one by the other.
struct likeness {
    double correlation = 0.0, factor = 0.0;
    likeness(const curve &one, const curve &reference) {
        const double own = product(one, one), other = product(reference, reference);
        if (own <= 0.0 || other <= 0.0) return;
        correlation = product(one, reference) / std::sqrt(own * other);
        factor = product(one, reference) / other;
    }
};

// out: the deviations less their mean, or less their least-squares line
curve centred(const std::vector<double> &x, curve y, bool with_line) {
    const straight_line line = least_squares_line(x, y);
    double mean = 0.0;
    for (const double value : y) mean += value / static_cast<double>(y.size());
    for (std::size_t i = 0; i < y.size(); ++i) y[i] -= with_line ? line.at(x[i]) : mean;
    return y;
}

// The sign of each run that brings all of them together, and the runs with it.
struct sign_choice {
    std::vector<int> sign;
    std::vector<curve> turned;
    double shape = 0.0, scatter = 0.0;  // rms of their mean, standard deviation of one about it
};

curve mean_of(const std::vector<curve> &runs, std::size_t without) {
    curve mean(runs.front().size(), 0.0);
    for (std::size_t r = 0; r < runs.size(); ++r) {
        if (r == without) continue;
        for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += runs[r][i];
    }
    const double count = static_cast<double>(runs.size() - (without < runs.size() ? 1 : 0));
    for (double &value : mean) value /= count;
    return mean;
}

// out: the run that has most in common with all others, whatever the sign
std::size_t typical_run(const std::vector<curve> &runs) {
    std::size_t best = 0;
    double most = -1.0;
    for (std::size_t r = 0; r < runs.size(); ++r) {
        double common = 0.0;
        for (const auto &other : runs) common += std::abs(product(runs[r], other));
        if (common > most) best = r;
        most = std::max(most, common);
    }
    return best;
}

// in : runs without offsets (free: 1) or lines (free: 2)
sign_choice choose_signs(const std::vector<curve> &runs, std::size_t free) {
    sign_choice choice;
    const curve &typical = runs[typical_run(runs)];
    for (const auto &run : runs) {
        choice.sign.push_back(product(run, typical) < 0.0 ? -1 : 1);
        choice.turned.push_back(run);
        for (double &value : choice.turned.back()) value *= choice.sign.back();
    }
    const curve mean = mean_of(choice.turned, runs.size());
    choice.shape = rms(mean);
    double squares = 0.0;
    for (const auto &run : choice.turned) {
        for (std::size_t i = 0; i < mean.size(); ++i) {
            squares += (run[i] - mean[i]) * (run[i] - mean[i]);
        }
    }
    const std::size_t freedom = (runs.size() - 1) * (mean.size() - free);
    choice.scatter = std::sqrt(squares / static_cast<double>(freedom));
    return choice;
}

// out: the sign of most runs of a direction; if they are even, that of the other runs; 0 if these
// are even too. So a lost motion that varies along the axis turns no run.
int usual_sign(const sign_choice &choice, const std::vector<directed_run> &runs, int direction) {
    int same = 0, other = 0;
    for (std::size_t r = 0; r < runs.size(); ++r) {
        (runs[r].direction == direction ? same : other) += choice.sign[r];
    }
    if (same == 0) same = other;
    return (same > 0) - (same < 0);
}

// out: the runs whose sign differs from the usual one of their direction, and which are a mirror
// image of the others in shape and in size
std::vector<std::size_t> turned_runs(const sign_choice &choice,
                                     const std::vector<directed_run> &runs) {
    std::vector<std::size_t> found;
    for (std::size_t r = 0; r < runs.size(); ++r) {
        const int usual = usual_sign(choice, runs, runs[r].direction);
        if (usual == 0 || choice.sign[r] == usual) continue;
        const likeness like(choice.turned[r], mean_of(choice.turned, r));
        if (like.correlation > least_correlation && like.factor > 0.5 && like.factor < 2.0) {
            found.push_back(r);
        }
    }
    return found;
}

bool is_doubled(const curve &before, const curve &after, double sigma) {
    const likeness like(after, before);
    return rms(before) > 3.0 * sigma && like.correlation > least_correlation && like.factor > 1.5 &&
           like.factor < 2.5;
}

}  // namespace

// The bend of the runs decides where it is clear, because set-ups and warming turn lines. Lines
// alone decide only where four runs agree closely.
std::vector<std::size_t> mirrored_runs(const std::vector<double> &position_mm,
                                       const std::vector<directed_run> &runs) {
    if (position_mm.size() < least_targets || runs.size() < 3) return {};
    for (const bool with_line : {true, false}) {
        if (!with_line && runs.size() < 4) break;
        std::vector<curve> curves;
        for (const auto &run : runs) {
            curves.push_back(centred(position_mm, run.deviation, with_line));
        }
        const sign_choice choice = choose_signs(curves, with_line ? 2 : 1);
        if (choice.shape > (with_line ? 3.0 : 6.0) * choice.scatter) {
            return turned_runs(choice, runs);
        }
    }
    return {};
}

std::optional<double> doubled_error(const std::vector<double> &position_mm,
                                    const std::vector<double> &before,
                                    const std::vector<double> &after, double sigma) {
    if (position_mm.size() < least_targets) return {};
    for (const bool with_line : {true, false}) {
        // Few points of unknown noise follow any line too easily once their own is gone.
        if (with_line && sigma <= 0.0 && position_mm.size() < 8) continue;
        const curve a = centred(position_mm, before, with_line);
        const curve b = centred(position_mm, after, with_line);
        if (is_doubled(a, b, sigma)) return likeness(b, a).factor;
    }
    return {};
}

}  // namespace compbox::metrology
