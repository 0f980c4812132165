// SPDX-License-Identifier: MIT
#include "host-tools/fitting/knots.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace compbox {

namespace {

using knots = std::vector<double>;

// What one least-squares fit is worth: `worst` decides, `merit` guides the moves.
struct score {
    double worst = std::numeric_limits<double>::infinity();
    double merit = std::numeric_limits<double>::infinity();  // sum of (residual / tolerance)^8
};

// Where the curve may pass half-way between two points: between the straight line and the cubic
// through four points there, widened by their tolerances.
struct gate {
    double x, low, high;
};

std::vector<gate> gates_of(const knot_task &task) {
    const auto &x = task.points.x, &y = task.points.y;
    const auto n = static_cast<long>(x.size());
    std::vector<gate> gates;
    for (long i = 0; i + 1 < n; ++i) {
        const auto u = static_cast<std::size_t>(i);
        const double middle = 0.5 * (x[u] + x[u + 1]), chord = 0.5 * (y[u] + y[u + 1]);
        const long first = std::clamp(i - 1, 0L, std::max(n - 4, 0L));
        const long last = std::min(first + 4, n);
        double cubic = 0.0;
        for (long a = first; a < last; ++a) {
            double share = 1.0;
            for (long b = first; b < last; ++b) {
                const auto p = static_cast<std::size_t>(a), q = static_cast<std::size_t>(b);
                if (a != b) share *= (middle - x[q]) / (x[p] - x[q]);
            }
            cubic += share * y[static_cast<std::size_t>(a)];
        }
        const double wide = 1.5 * std::max(task.tolerance[u], task.tolerance[u + 1]);
        gates.push_back({middle, std::min(chord, cubic) - wide, std::max(chord, cubic) + wide});
    }
    return gates;
}

class search {
  public:
    explicit search(const knot_task &task)
        : task_(task),
          solver_(task.points),
          from_(task.points.x.front()),
          to_(task.points.x.back()) {
        if (task.guard_between) gates_ = gates_of(task);
        curve_.degree = task.degree;
        inverse_.reserve(task.tolerance.size());
        for (const double tolerance : task.tolerance) inverse_.push_back(1.0 / tolerance);
    }
    knot_result run();

  private:
    score fit(const knots &inner);
    bool between_is_calm() const;
    bool accepted(const score &now) const { return now.worst <= 1.0 && between_is_calm(); }
    bool grow(knots &inner);
    bool add_where_outside(knots &inner);
    void prune(knots &inner);
    std::vector<std::size_t> least_needed_first(const knots &inner);
    bool drop(knots &inner, std::size_t which);
    bool mend(knots &inner, std::size_t near, score now);
    bool has_points(double low, double high) const;

    const knot_task &task_;
    spline_least_squares solver_;
    double from_, to_;
    std::vector<gate> gates_;
    std::vector<double> inverse_;  // 1 / tolerance
    spline curve_;                 // of the last fit
    int fits_ = 0;
};

score search::fit(const knots &inner) {
    ++fits_;
    const int p = task_.degree;
    curve_.knots.assign(static_cast<std::size_t>(p) + 1, from_);
    curve_.knots.insert(curve_.knots.end(), inner.begin(), inner.end());
    curve_.knots.insert(curve_.knots.end(), static_cast<std::size_t>(p) + 1, to_);
    score result;
    if (!solver_.fit(curve_)) return result;
    const auto &residuals = solver_.residuals();
    double worst = 0.0, merit = 0.0;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
        const double ratio = residuals[i] * inverse_[i], square = ratio * ratio;
        worst = std::max(worst, square);
        merit += square * square * square * square;
    }
    result.worst = std::sqrt(worst);
    result.merit = merit;
    return result;
}

bool search::between_is_calm() const {
    for (const gate &g : gates_) {
        const double value = value_at(curve_, g.x);
        if (value < g.low || value > g.high) return false;
    }
    return true;
}

bool search::has_points(double low, double high) const {
    const auto &x = task_.points.x;
    const auto first = std::upper_bound(x.begin(), x.end(), low);
    return first != x.end() && *first < high;
}

// After a fit: one more knot in each span with a residual outside, where its residuals balance.
// False when no span could take one.
bool search::add_where_outside(knots &inner) {
    const auto &x = task_.points.x;
    const auto &residuals = solver_.residuals();
    const auto &spans = solver_.spans();
    knots added;
    for (std::size_t i = 0; i < x.size();) {
        double worst = 0.0, sum = 0.0, moment = 0.0;
        const int span = spans[i];
        for (; i < x.size() && spans[i] == span; ++i) {
            const double ratio = residuals[i] * inverse_[i], square = ratio * ratio;
            worst = std::max(worst, square);
            sum += square;
            moment += square * x[i];
        }
        if (worst <= 1.0) continue;
        const double low = curve_.knots[static_cast<std::size_t>(span)];
        const double high = curve_.knots[static_cast<std::size_t>(span) + 1];
        double knot = std::clamp(moment / sum, 0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high);
        if (!has_points(low, knot) || !has_points(knot, high)) knot = 0.5 * (low + high);
        if (has_points(low, knot) && has_points(knot, high)) added.push_back(knot);
    }
    const std::size_t coefficients =
        inner.size() + added.size() + static_cast<std::size_t>(task_.degree) + 1;
    if (added.empty() || coefficients > x.size() ||
        coefficients > static_cast<std::size_t>(task_.max_coefficients)) {
        return false;
    }
    inner.insert(inner.end(), added.begin(), added.end());
    std::sort(inner.begin(), inner.end());
    return true;
}

// Adds knots until all residuals are inside. On failure `inner` is the best seen.
bool search::grow(knots &inner) {
    knots best = inner;
    double best_worst = std::numeric_limits<double>::infinity();
    for (;;) {
        const score now = fit(inner);
        if (now.worst < best_worst) {
            best_worst = now.worst;
            best = inner;
        }
        if (now.worst <= 1.0) return true;
        if (!std::isfinite(now.worst) || !add_where_outside(inner)) break;
    }
    inner = best;
    return false;
}

// The inner knots by how little the curve turns at them: the jump of the highest derivative,
// times what the neighbouring spans could make of it.
std::vector<std::size_t> search::least_needed_first(const knots &inner) {
    const int p = task_.degree;
    std::vector<double> derivative = curve_.control_points;
    const auto &t = curve_.knots;
    for (int k = 1; k <= p; ++k) {
        for (std::size_t i = 0; i + static_cast<std::size_t>(k) < curve_.control_points.size();
             ++i) {
            const std::size_t low = i + static_cast<std::size_t>(k);
            const double width = t[i + static_cast<std::size_t>(p) + 1] - t[low];
            derivative[i] = (derivative[i + 1] - derivative[i]) * (p - k + 1) / width;
        }
    }
    std::vector<double> need(inner.size());
    for (std::size_t j = 0; j < inner.size(); ++j) {
        const double before = inner[j] - (j == 0 ? from_ : inner[j - 1]);
        const double after = (j + 1 == inner.size() ? to_ : inner[j + 1]) - inner[j];
        const double reach = before * after / (before + after);
        need[j] = std::abs(derivative[j + 1] - derivative[j]) * std::pow(reach, p);
    }
    std::vector<std::size_t> order(inner.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return need[a] < need[b]; });
    return order;
}

// Moves the knots beside a gap until all residuals are inside; true then. `inner` holds the best.
bool search::mend(knots &inner, std::size_t near, score now) {
    double part = 0.35;
    int trials = task_.patience;
    while (trials > 0) {
        bool better = false;
        for (const int side : {-1, 0}) {
            const long index = static_cast<long>(near) + side;
            if (index < 0 || index >= static_cast<long>(inner.size())) continue;
            const auto j = static_cast<std::size_t>(index);
            for (const double way : {side < 0 ? 1.0 : -1.0, side < 0 ? -1.0 : 1.0}) {
                if (trials-- <= 0) return false;
                const double held = inner[j];
                const double low = j == 0 ? from_ : inner[j - 1];
                const double high = j + 1 == inner.size() ? to_ : inner[j + 1];
                inner[j] += way * part * (way > 0 ? high - held : held - low);
                const score moved = fit(inner);
                if (moved.worst <= 1.0 && between_is_calm()) return true;
                if (moved.merit < now.merit) {
                    now = moved;
                    better = true;
                    break;
                }
                inner[j] = held;
            }
        }
        if (!better) part *= 0.5;
        if (part < 0.08) return false;
    }
    return false;
}

// Takes one knot away if the rest can do without it; else leaves all as it was.
bool search::drop(knots &inner, std::size_t which) {
    const knots held = inner;
    inner.erase(inner.begin() + static_cast<long>(which));
    const score now = fit(inner);
    if (accepted(now)) return true;
    if (now.worst < 4.0 && mend(inner, which, now)) return true;
    inner = held;
    return false;
}

void search::prune(knots &inner) {
    bool dropped = true;
    while (dropped && !inner.empty()) {
        dropped = false;
        fit(inner);
        const auto order = least_needed_first(inner);
        for (const std::size_t which : order) {
            if (!drop(inner, which)) continue;
            dropped = true;
            break;
        }
    }
}

knot_result search::run() {
    knots inner;
    const bool reached = grow(inner);
    if (reached) prune(inner);
    knot_result result;
    const score now = fit(inner);
    result.curve = curve_;
    result.worst = now.worst;
    result.inside = reached;
    result.fits = fits_;
    return result;
}

}  // namespace

knot_result fewest_knots(const knot_task &task) {
    return search(task).run();
}

}  // namespace compbox
