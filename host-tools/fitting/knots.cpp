// SPDX-License-Identifier: MIT
#include "host-tools/fitting/knots.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>

#include "host-tools/fitting/course.h"

namespace compbox::fitting {

namespace {

using knots = std::vector<double>;

// Rating of one least-squares fit: `worst` decides, `merit` guides the moves.
struct score {
    double worst = std::numeric_limits<double>::infinity();
    double merit = std::numeric_limits<double>::infinity();  // sum of (residual / tolerance)^8
};

class search {
  public:
    explicit search(const knot_task &task)
        : task_(task),
          solver_(task.points),
          from_(task.points.x.front()),
          to_(task.points.x.back()) {
        if (task.guard_between) gates_ = gates_of(task.points, task.tolerance);
        curve_.degree = task.degree;
        inverse_.reserve(task.tolerance.size());
        for (const double tolerance : task.tolerance) inverse_.push_back(1.0 / tolerance);
    }
    knot_result run();

  private:
    score fit(const knots &inner);
    double swing() const;
    bool accepted(const score &now) const { return now.worst <= 1.0 && swing() <= swing_allowed_; }
    bool grow(knots &inner);
    bool thicken(knots &inner);
    bool add_where_swinging(knots &inner);
    bool start(knots &inner);
    bool add_where_outside(knots &inner);
    void prune(knots &inner);
    std::vector<std::size_t> least_needed_first(const knots &inner);
    bool drop(knots &inner, std::size_t which);
    bool mend(knots &inner, std::size_t near, score now);
    bool has_points(double low, double high) const;
    bool has_room(std::size_t knot_count) const;

    const knot_task &task_;
    spline_least_squares solver_;
    double from_, to_;
    std::vector<gate> gates_;
    std::vector<double> inverse_;  // 1 / tolerance
    spline curve_;                 // of the last fit
    double swing_allowed_ = 0.0;   // larger if no calmer start curve was found
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

double search::swing() const {
    double largest = 0.0;
    for (const gate &g : gates_) {
        const double off = std::abs(value_at(curve_, g.x) - g.centre);
        largest = std::max(largest, off - g.half_width);
    }
    return largest;
}

bool search::has_points(double low, double high) const {
    const auto &x = task_.points.x;
    const auto first = std::upper_bound(x.begin(), x.end(), low);
    return first != x.end() && *first < high;
}

// Whether this number of inner knots needs no more coefficients than points and than the maximum.
bool search::has_room(std::size_t knot_count) const {
    const std::size_t coefficients = knot_count + static_cast<std::size_t>(task_.degree) + 1;
    return coefficients <= task_.points.x.size() &&
           coefficients <= static_cast<std::size_t>(task_.max_coefficients);
}

// After a fit: adds a knot to each span with a residual outside, at the residuals' centre of
// gravity. False when no span could take one.
bool search::add_where_outside(knots &inner) {
    const auto &x = task_.points.x;
    const auto &residuals = solver_.residuals();
    const auto &first = solver_.first_points();
    knots added;
    for (std::size_t span = 0; span + 1 < first.size(); ++span) {
        double worst = 0.0, sum = 0.0, moment = 0.0;
        for (std::size_t i = first[span]; i < first[span + 1]; ++i) {
            const double ratio = residuals[i] * inverse_[i], square = ratio * ratio;
            worst = std::max(worst, square);
            sum += square;
            moment += square * x[i];
        }
        if (worst <= 1.0) continue;
        const double low = curve_.knots[span + static_cast<std::size_t>(task_.degree)];
        const double high = curve_.knots[span + static_cast<std::size_t>(task_.degree) + 1];
        double knot = std::clamp(moment / sum, 0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high);
        if (!has_points(low, knot) || !has_points(knot, high)) knot = 0.5 * (low + high);
        if (has_points(low, knot) && has_points(knot, high)) added.push_back(knot);
    }
    if (added.empty() || !has_room(inner.size() + added.size())) return false;
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

// The inner knots in order of the curve's bend at them: the jump of the highest derivative, times
// the neighbouring spans' ability to replace it.
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

// Moves the knots beside a gap until all residuals are inside. out: success; `inner` holds the best
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
                if (accepted(moved)) return true;
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

// Removes one knot if the curve stays inside without it; else changes nothing.
bool search::drop(knots &inner, std::size_t which) {
    const knots held = inner;
    inner.erase(inner.begin() + static_cast<long>(which));
    const score now = fit(inner);
    if (accepted(now)) return true;
    if (now.worst < task_.mendable && mend(inner, which, now)) return true;
    inner = held;
    return false;
}

// A needed knot is tried again only after a change near it: the effect of a knot on a least-squares
// spline fades within a few spans.
void search::prune(knots &inner) {
    constexpr long near = 4;
    std::vector<char> needed(inner.size(), 0);
    for (bool dropped = true; dropped && !inner.empty();) {
        dropped = false;
        fit(inner);
        for (const std::size_t which : least_needed_first(inner)) {
            if (needed[which]) continue;
            if (!drop(inner, which)) {
                needed[which] = 1;
                continue;
            }
            const auto place = static_cast<long>(which), size = static_cast<long>(inner.size());
            needed.erase(needed.begin() + place);
            std::fill(needed.begin() + std::max(place - near, 0L),
                      needed.begin() + std::min(place + near, size), 0);
            dropped = true;
            break;
        }
    }
}

// For a failed growth: adds the knots of interpolation around every point that is still outside,
// each time over more points. True once all are inside; else `inner` is unchanged.
bool search::thicken(knots &inner) {
    const knots held = inner;
    constexpr int rounds = 8;
    const auto &x = task_.points.x;
    const auto n = static_cast<long>(x.size());
    const knots through = interpolating_knots(x, task_.degree);
    for (int round = 0; round < rounds; ++round) {
        if (!has_room(inner.size())) break;
        if (fit(inner).worst <= 1.0) return true;
        const long reach = task_.degree + round;
        for (long i = 0; i < n; ++i) {
            const auto at = static_cast<std::size_t>(i);
            if (std::abs(solver_.residuals()[at]) * inverse_[at] <= 1.0) continue;
            const double low = x[static_cast<std::size_t>(std::max(i - reach, 0L))];
            const double high = x[static_cast<std::size_t>(std::min(i + reach, n - 1))];
            const auto inside = [&](double knot) { return knot >= low && knot <= high; };
            inner.erase(std::remove_if(inner.begin(), inner.end(), inside), inner.end());
            std::copy_if(through.begin(), through.end(), std::back_inserter(inner), inside);
            std::sort(inner.begin(), inner.end());
        }
    }
    inner = held;
    return false;
}

// Adds a knot at the largest swing; false if there are too few points for it.
bool search::add_where_swinging(knots &inner) {
    double largest = 0.0, where = 0.0;
    for (const gate &g : gates_) {
        const double off = std::abs(value_at(curve_, g.x) - g.centre) - g.half_width;
        if (off <= largest) continue;
        largest = off;
        where = g.x;
    }
    const auto after = std::upper_bound(inner.begin(), inner.end(), where);
    const double low = after == inner.begin() ? from_ : *(after - 1);
    const double high = after == inner.end() ? to_ : *after;
    const double knot = 0.5 * (low + high);
    if (!has_points(low, knot) || !has_points(knot, high)) return false;
    if (!has_room(inner.size() + 1)) return false;
    inner.insert(after, knot);
    return true;
}

// Start curve for removing knots; false when none is inside. If the grown one swings, tries a few
// more knots, then the curve through every point, and takes the calmest.
bool search::start(knots &inner) {
    constexpr int few = 12;
    const bool grown = grow(inner) || thicken(inner);
    fit(inner);
    double calmest = swing();
    knots more = inner;
    for (int i = 0; i < few && grown && calmest > 0.0 && add_where_swinging(more); ++i) {
        if (fit(more).worst > 1.0 || swing() >= calmest) continue;
        calmest = swing();
        inner = more;
    }
    if (grown && calmest <= 0.0) return true;
    const knots through = interpolating_knots(task_.points.x, task_.degree);
    if (!has_room(through.size())) return grown;
    const bool reaches = fit(through).worst <= 1.0;
    if (reaches && (!grown || swing() < calmest)) {
        calmest = swing();
        inner = through;
    }
    swing_allowed_ = calmest;
    return grown || reaches;
}

knot_result search::run() {
    knots inner;
    const bool reached = start(inner);
    if (reached) prune(inner);
    knot_result result;
    const score now = fit(inner);
    result.curve = curve_;
    result.worst = now.worst;
    result.inside = reached;
    result.swing = swing();
    result.fits = fits_;
    return result;
}

}  // namespace

knot_result fewest_knots(const knot_task &task) {
    return search(task).run();
}

}  // namespace compbox::fitting
