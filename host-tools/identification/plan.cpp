// SPDX-License-Identifier: MIT
#include "host-tools/identification/plan.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

namespace compbox::identification {

namespace {

// Nodes relative to the middle of all (better digits), one array for each coordinate, so that the
// inner loop uses consecutive memory and vectorises. The coordinates are turned in cyclic order
// until x is the axis that moves; products of vectors do not change by that.
struct node_arrays {
    std::vector<double> x, y, z;
    point_mm middle{};
    // in : at least one node; axis 0 … 2
    node_arrays(const std::vector<point_mm> &given, int axis) {
        const auto turn = static_cast<std::size_t>(axis);
        std::vector<point_mm> nodes;
        for (const auto &node : given) {
            nodes.push_back({node[turn], node[(turn + 1) % 3], node[(turn + 2) % 3]});
        }
        for (const auto &node : nodes) {
            for (std::size_t k = 0; k < 3; ++k) {
                middle[k] += node[k] / static_cast<double>(nodes.size());
            }
        }
        for (const auto &node : nodes) {
            x.push_back(node[0] - middle[0]);
            y.push_back(node[1] - middle[1]);
            z.push_back(node[2] - middle[2]);
        }
    }
};

constexpr std::size_t block_size = 256;
constexpr double degenerate_merit = std::numeric_limits<double>::infinity();

// Sums common to all third points of one pair.
struct pair_sums {
    double x, y, z;  // of the two points
    double xx, yy, zz, xy, xz, yz;
    double middle[3];               // added to the centroid: back to the axis' frame
    double longest2;                // squared distance of the two
    double ax, ay, az, dx, dy, dz;  // first point; second - first
};

// What the merit of a triple depends on, besides its points. Coordinates as in node_arrays.
struct rating {
    double weight[6];      // 1 / preset^2, of angles in µm/mm
    double along, across;  // 1 / sigma^2 of the lines along x and across it
    // Shares of a variance over the positions: left of the part beside offset and slope; that of
    // the slopes of x, pitch and yaw, which the lines along x give.
    double left, slope;
    double least_seen2;  // square of the least height of a triangle as seen along x, mm
};

// Contribution of one variance of each kind to the merit, by criterion.
template <criterion kind>
inline double merit_of(const double (&variance)[6], const double (&weight)[6], double det) {
    if constexpr (kind == criterion::d) return -det;
    double sum = 0.0;
    for (int k = 0; k < 6; ++k) {
        if constexpr (kind == criterion::mean_cv) sum += std::sqrt(variance[k] * weight[k]);
        if constexpr (kind == criterion::a) sum += variance[k] * weight[k];
    }
    return sum / 6.0;
}

// in : pair, n third points from x, y, z
// out: merit[n], degenerate_merit for points with an obstacle(); of criterion d the determinant of
//      one position, and in seen[n] that of the slopes of the lines along x
// With M = sum q q^T: J = A^T W A of the angles, K = adj(J) / det(J); the lines along x alone see
// the lower right 2 x 2 of M. No branches, so that it vectorises.
template <criterion kind>
__attribute__((always_inline)) inline void rate(const pair_sums &pair, const double *x,
                                                const double *y, const double *z, std::size_t n,
                                                const rating &by, double *merit, double *seen) {
    constexpr double third = 1.0 / 3.0, least2 = least_height_mm * least_height_mm;
    for (std::size_t i = 0; i < n; ++i) {
        const double sx = pair.x + x[i], sy = pair.y + y[i], sz = pair.z + z[i];
        const double mxx = pair.xx + x[i] * x[i] - sx * sx * third;
        const double myy = pair.yy + y[i] * y[i] - sy * sy * third;
        const double mzz = pair.zz + z[i] * z[i] - sz * sz * third;
        const double mxy = pair.xy + x[i] * y[i] - sx * sy * third;
        const double mxz = pair.xz + x[i] * z[i] - sx * sz * third;
        const double myz = pair.yz + y[i] * z[i] - sy * sz * third;
        const double jxx = by.across * (myy + mzz), jyz = -by.along * myz;
        const double jyy = by.along * mzz + by.across * mxx, jxy = -by.across * mxy;
        const double jzz = by.along * myy + by.across * mxx, jxz = -by.across * mxz;
        const double kxx = jyy * jzz - jyz * jyz, kyy = jxx * jzz - jxz * jxz;
        const double kzz = jxx * jyy - jxy * jxy, kxy = jxz * jyz - jxy * jzz;
        const double kxz = jxy * jyz - jxz * jyy, kyz = jxy * jxz - jxx * jyz;
        const double det = jxx * kxx + jxy * kxy + jxz * kxz;
        // Area of the triangle by a cross product: exact near a line, where det loses its digits.
        const double ex = x[i] - pair.ax, ey = y[i] - pair.ay, ez = z[i] - pair.az;
        const double nx = pair.dy * ez - pair.dz * ey, ny = pair.dz * ex - pair.dx * ez;
        const double nz = pair.dx * ey - pair.dy * ex;
        const double fx = ex - pair.dx, fy = ey - pair.dy, fz = ez - pair.dz;
        const double eyz = ey * ey + ez * ez, fyz = fy * fy + fz * fz, e2 = ex * ex + eyz;
        const double f2 = fx * fx + fyz, dyz = pair.dy * pair.dy + pair.dz * pair.dz;
        double longest2 = pair.longest2 > e2 ? pair.longest2 : e2, across2 = dyz > eyz ? dyz : eyz;
        longest2 = longest2 > f2 ? longest2 : f2;
        across2 = across2 > fyz ? across2 : fyz;
        // Points less than 1 mm apart are no higher than that.
        longest2 = longest2 > 1.0 ? longest2 : 1.0;
        across2 = across2 > 1.0 ? across2 : 1.0;
        const double nx2 = nx * nx, area2 = nx2 + ny * ny + nz * nz;
        const double beside = area2 - least2 * longest2, across = nx2 - by.least_seen2 * across2;
        const bool flat = (beside < across ? beside : across) < 0.0;
        const double inverse = 1.0 / (flat ? 1.0 : det);
        const double slopes = by.slope / (by.along * (nx2 > 0.0 ? nx2 * third : 1.0));
        const double cx = sx * third + pair.middle[0], cy = sy * third + pair.middle[1];
        const double cz = sz * third + pair.middle[2];
        const double lever = cz * cz * myy - 2 * cy * cz * myz + cy * cy * mzz;
        const double variance[6] = {
            by.left * (third / by.along +
                       inverse * (cz * cz * kyy - 2 * cy * cz * kyz + cy * cy * kzz)) +
                by.slope * third / by.along + slopes * lever,
            by.left *
                (third / by.across + inverse * (cz * cz * kxx - 2 * cx * cz * kxz + cx * cx * kzz)),
            by.left *
                (third / by.across + inverse * (cy * cy * kxx - 2 * cx * cy * kxy + cx * cx * kyy)),
            by.left * inverse * kxx,
            by.left * inverse * kyy + slopes * myy,
            by.left * inverse * kzz + slopes * mzz};
        const double value = merit_of<kind>(variance, by.weight, det);
        merit[i] = flat ? degenerate_merit : value;
        if constexpr (kind == criterion::d) seen[i] = nx2 * third;
    }
}

// An amd64 processor may lack AVX2; every arm64 has NEON.
#ifdef __x86_64__
#define CB_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define CB_CLONES
#endif

CB_CLONES void rate_mean_cv(const pair_sums &pair, const double *x, const double *y,
                            const double *z, std::size_t n, const rating &by, double *merit) {
    rate<criterion::mean_cv>(pair, x, y, z, n, by, merit, nullptr);
}
CB_CLONES void rate_a(const pair_sums &pair, const double *x, const double *y, const double *z,
                      std::size_t n, const rating &by, double *merit) {
    rate<criterion::a>(pair, x, y, z, n, by, merit, nullptr);
}
CB_CLONES void rate_d(const pair_sums &pair, const double *x, const double *y, const double *z,
                      std::size_t n, const rating &by, double *merit, double *seen) {
    rate<criterion::d>(pair, x, y, z, n, by, merit, seen);
}

bool better(const ranked_triple &a, const ranked_triple &b) {
    return a.merit != b.merit ? a.merit < b.merit : a.node < b.node;
}

// The best results, as a heap whose front is the worst of them.
class best_list {
  public:
    explicit best_list(std::size_t size) : size_(size) {}
    double threshold() const {
        return heap_.size() < size_ ? std::numeric_limits<double>::max() : heap_.front().merit;
    }
    void offer(const ranked_triple &triple) {
        if (heap_.size() == size_) {
            if (!better(triple, heap_.front())) return;
            std::pop_heap(heap_.begin(), heap_.end(), better);
            heap_.pop_back();
        }
        heap_.push_back(triple);
        std::push_heap(heap_.begin(), heap_.end(), better);
    }
    const std::vector<ranked_triple> &all() const { return heap_; }

  private:
    std::size_t size_;
    std::vector<ranked_triple> heap_;
};

// out: how the options rate a triple whose coordinates node_arrays has turned
rating rating_of(const plan_options &options) {
    rating by{};
    const auto turn = static_cast<std::size_t>(options.model.axis);
    for (std::size_t k = 0; k < 6; ++k) {
        const double unit = k < 3 ? 1.0 : 1e3;  // µrad of µm/mm
        const double preset = options.preset[(k < 3 ? 0 : 3) + (turn + k) % 3];
        by.weight[k] = unit * unit / (preset * preset);
    }
    by.along = 1.0 / (options.along_um * options.along_um);
    by.across = 1.0 / (options.across_um * options.across_um);
    const bool separate = options.model.lines == setups::separate;
    const double n = options.model.positions;
    by.left = separate ? (n - 2.0) / n : 1.0;
    by.slope = separate ? 1.0 / n : 0.0;
    by.least_seen2 = separate ? least_height_mm * least_height_mm : 0.0;
    return by;
}

// The largest product of two nodes' extents across x that the slopes' determinant can reach.
double most_seen(const node_arrays &nodes) {
    const auto y = std::minmax_element(nodes.y.begin(), nodes.y.end());
    const auto z = std::minmax_element(nodes.z.begin(), nodes.z.end());
    const double extent = (*y.second - *y.first) * (*z.second - *z.first);
    return extent * extent;  // a sum of three squares about their mean is at most 2/3 of extent^2
}

struct worker {
    const node_arrays &nodes;
    const plan_options &options;
    rating how_rated;
    double power;     // of the slopes' determinant in that of all positions, criterion d
    double most = 1;  // of the slopes' determinant to that power
    best_list best;
    std::uint64_t degenerate = 0;

    worker(const node_arrays &all, const plan_options &how)
        : nodes(all),
          options(how),
          how_rated(rating_of(how)),
          power(how_rated.slope > 0.0 ? 1.0 / std::max(1, how.model.positions - 2) : 0.0),
          best(how.best) {
        if (power > 0.0) most = std::pow(most_seen(all), power);
    }

    // Sums over the nodes i and j of coordinates (mm), squares and products, and their difference.
    pair_sums sums_of(std::size_t i, std::size_t j) const {
        const double ax = nodes.x[i], ay = nodes.y[i], az = nodes.z[i];
        const double bx = nodes.x[j], by = nodes.y[j], bz = nodes.z[j];
        const double dx = bx - ax, dy = by - ay, dz = bz - az;
        return {ax + bx,
                ay + by,
                az + bz,
                ax * ax + bx * bx,
                ay * ay + by * by,
                az * az + bz * bz,
                ax * ay + bx * by,
                ax * az + bx * bz,
                ay * az + by * bz,
                {nodes.middle[0], nodes.middle[1], nodes.middle[2]},
                dx * dx + dy * dy + dz * dz,
                ax,
                ay,
                az,
                dx,
                dy,
                dz};
    }

    void rate_block(const pair_sums &pair, std::size_t from, std::size_t n, double *merit) const {
        const double *x = nodes.x.data() + from, *y = nodes.y.data() + from;
        const double *z = nodes.z.data() + from;
        switch (options.rank_by) {
            case criterion::mean_cv:
                return rate_mean_cv(pair, x, y, z, n, how_rated, merit);
            case criterion::a:
                return rate_a(pair, x, y, z, n, how_rated, merit);
            case criterion::d:
                double seen[block_size];
                rate_d(pair, x, y, z, n, how_rated, merit, seen);
                return rate_slopes(n, merit, seen);
        }
    }

    // Criterion d: multiplies by the slopes' determinant. A power takes longer than all the rest,
    // so only triples that could enter the list get it; the others are rated too well, but worse
    // than the list.
    void rate_slopes(std::size_t n, double *merit, const double *seen) const {
        if (power == 0.0) return;
        const double threshold = best.threshold();
        for (std::size_t k = 0; k < n; ++k) {
            if (merit[k] == degenerate_merit) continue;
            merit[k] *= merit[k] * most <= threshold ? std::pow(seen[k], power) : most;
        }
    }

    // All triples i < j < k of one first point.
    void first_point(std::size_t i) {
        const std::size_t count = nodes.x.size();
        double merit[block_size];
        for (std::size_t j = i + 1; j + 1 < count; ++j) {
            const pair_sums pair = sums_of(i, j);
            for (std::size_t from = j + 1; from < count; from += block_size) {
                const std::size_t n = std::min(block_size, count - from);
                rate_block(pair, from, n, merit);
                keep(i, j, from, n, merit);
            }
        }
    }

    void keep(std::size_t i, std::size_t j, std::size_t from, std::size_t n, const double *merit) {
        for (std::size_t k = 0; k < n; ++k) {
            degenerate += merit[k] == degenerate_merit;
            if (!(merit[k] <= best.threshold())) continue;
            ranked_triple triple;
            triple.merit = merit[k];
            triple.node = {static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j),
                           static_cast<std::uint32_t>(from + k)};
            best.offer(triple);
        }
    }
};

}  // namespace

std::vector<point_mm> grid::nodes() const {
    std::vector<point_mm> all;
    const auto value = [this](std::size_t k, int i) {
        return counts[k] < 2 ? low_mm[k]
                             : low_mm[k] + (high_mm[k] - low_mm[k]) * i / (counts[k] - 1);
    };
    for (int i = 0; i < counts[0]; ++i) {
        for (int j = 0; j < counts[1]; ++j) {
            for (int k = 0; k < counts[2]; ++k) {
                all.push_back({value(0, i), value(1, j), value(2, k)});
            }
        }
    }
    return all;
}

plan_result plan_points(const std::vector<point_mm> &nodes, const plan_options &options) {
    const node_arrays arrays(nodes, options.model.axis);
    const std::size_t count = nodes.size();
    std::vector<worker> workers(std::max(1u, options.threads), worker(arrays, options));
    std::atomic<std::size_t> next{0};
    const auto work = [&](worker &one, bool reports) {
        for (std::size_t i = next++; i < count; i = next++) {
            one.first_point(i);
            if (reports && options.progress) {
                const double left = 1.0 - static_cast<double>(i) / static_cast<double>(count);
                options.progress(1.0 - left * left * left);
            }
        }
    };
    std::vector<std::thread> threads;
    for (std::size_t t = 1; t < workers.size(); ++t) {
        threads.emplace_back(work, std::ref(workers[t]), false);
    }
    work(workers[0], true);
    for (auto &thread : threads) thread.join();

    plan_result result;
    best_list best(options.best);
    for (const auto &one : workers) {
        for (const auto &triple : one.best.all()) best.offer(triple);
        result.degenerate += one.degenerate;
    }
    result.best = best.all();
    std::sort(result.best.begin(), result.best.end(), better);
    for (auto &triple : result.best) {
        for (const auto node : triple.node) triple.points.push_back(nodes[node]);
    }
    const std::uint64_t n = count;
    result.triples = n * (n - 1) / 2 * (n - 2) / 3;
    return result;
}

six planned_sigma(const points_mm &points, const plan_options &options) {
    const line_sigma sigma =
        sigma_of_lines(options.along_um, options.across_um, options.model.axis, points.size());
    return sigma_over_positions(points, sigma, closed_form_sigma(points, sigma), options.model);
}

bool order_for_traditional(points_mm &points, const plan_options &options, six &sigma) {
    const line_sigma readings =
        sigma_of_lines(options.along_um, options.across_um, options.model.axis, 3);
    std::array<std::size_t, 3> order{0, 1, 2};
    points_mm best;
    double best_sum = std::numeric_limits<double>::infinity();
    do {
        const points_mm first{points[order[0]], points[order[1]], points[order[2]]};
        six one;
        if (!traditional_sigma(first, options.model.axis, readings, one)) continue;
        double sum = 0.0;
        for (const double s : one) sum += s;
        if (!(sum < best_sum)) continue;
        best_sum = sum;
        sigma = sigma_over_positions(first, readings, one, options.model);
        best = first;
    } while (std::next_permutation(order.begin(), order.end()));
    if (best.empty()) return false;
    points = best;
    return true;
}

}  // namespace compbox::identification
