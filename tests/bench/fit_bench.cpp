// SPDX-License-Identifier: MIT
// Adaptive B-spline fits of given points to a tolerance, as `compbox fit --tolerance-um E
// --fewest-knots` does them.
//   fit_bench FILE…    each FILE: the tolerance, then a line "x y" for each point
// Prints for each: coefficients, largest residual, microseconds of one fit (median CPU time) and
// milliseconds of the best estimate, which gives the band and the warnings and is not part of it.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <vector>

#include "host-tools/fitting/knots.h"
#include "host-tools/fitting/smooth.h"

namespace {

compbox::fitting::knot_task read_task(const char *path) {
    compbox::fitting::knot_task task;
    std::ifstream file(path);
    double tolerance = 0.0, x = 0.0, y = 0.0;
    file >> tolerance;
    while (file >> x >> y) {
        task.points.x.push_back(x);
        task.points.y.push_back(y);
        task.points.weight.push_back(1.0);
        task.tolerance.push_back(tolerance);
    }
    return task;
}

double now_us() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return 1e6 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_nsec);
}

double estimate_ms(const compbox::fitting::knot_task &task) {
    compbox::fitting::measurement data;
    data.runs.resize(1);
    data.runs[0].position = task.points.x;
    data.runs[0].error = task.points.y;
    data.runs[0].sigma = task.points.weight;
    compbox::fitting::average_runs(data);
    const double start = now_us();
    compbox::fitting::smooth(data, 1);
    return 1e-3 * (now_us() - start);
}

}  // namespace

int main(int argc, char **argv) {
    for (int i = 1; i < argc; ++i) {
        const compbox::fitting::knot_task task = read_task(argv[i]);
        if (task.points.size() < 4) {
            std::fprintf(stderr, "fit_bench: %s has fewer than 4 points\n", argv[i]);
            return 1;
        }
        compbox::fitting::knot_result result;
        std::vector<double> times;
        for (int repetition = 0; repetition < 31; ++repetition) {
            const double start = now_us();
            result = compbox::fitting::fewest_knots(task);
            times.push_back(now_us() - start);
        }
        std::sort(times.begin(), times.end());
        std::printf("%zu %.17g %.3f %.3f\n", result.curve.control_points.size(),
                    result.worst * task.tolerance[0], times[times.size() / 2], estimate_ms(task));
    }
    return 0;
}
