// SPDX-License-Identifier: MIT
// One value of one cubic B-spline of 20 control points at one random x: ours beside Eigen, GSL and
// de Boor's scheme. Every contestant gets the curve in the form it likes best, made beforehand, and
// returns the value alone, except ours, which also gives slope and range ("compbox"). All must
// agree before anything is timed.
//   bspline_bench [--write=DIR] [Google Benchmark options]     DIR: the curves, for other programs
#include <benchmark/benchmark.h>
#include <gsl/gsl_bspline.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <unsupported/Eigen/Splines>
#include <vector>

extern "C" {
#include "models/bspline.h"
#include "tests/support/ppoly_search.h"
}

namespace {

constexpr int degree = 3;
constexpr size_t count = 20, points = 4096;
constexpr float length = 14300.0f;

struct scene {
    std::string name;
    std::vector<float> knots, control_points, x;
};

// The same control points and places; knots even, or thrown at random.
scene make_scene(const std::string &name, bool uniform) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> size(-200, 200), place(0, length);
    scene made{name, std::vector<float>(degree + 1, 0.0f), {}, {}};
    for (size_t i = 1; i < count - degree; ++i) {
        made.knots.push_back(uniform ? length * static_cast<float>(i) / (count - degree)
                                     : place(random));
    }
    std::sort(made.knots.begin(), made.knots.end());
    made.knots.insert(made.knots.end(), degree + 1, length);
    for (size_t i = 0; i < count; ++i) made.control_points.push_back(size(random));
    for (size_t i = 0; i < points; ++i) made.x.push_back(place(random));
    return made;
}

struct ours {
    std::vector<float> breaks, coefficients;
    cb_ppoly curve{};

    explicit ours(const scene &s) {
        const cb_bspline spline{s.knots.data(), s.control_points.data(), count, degree};
        breaks.resize(cb_bspline_spans(&spline) + 1u);
        coefficients.resize((breaks.size() - 1) * (degree + 1));
        cb_bspline_to_ppoly(&spline, breaks.data(), coefficients.data(), &curve);
    }
    ours(const ours &) = delete;
};

struct with_slope : ours {
    using ours::ours;
    float operator()(float x) const {
        const cb_curve_value got = cb_ppoly_evaluate(&curve, x);
        benchmark::DoNotOptimize(got.slope);
        return got.value;
    }
};

struct value_alone : ours {
    using ours::ours;
    float operator()(float x) const { return searched_value(&curve, x); }
};

// Eigen, degree and dimension known at compile time, which is its fastest form.
template <typename scalar>
struct eigen {
    using spline = Eigen::Spline<scalar, 1, degree>;
    spline curve;

    explicit eigen(const scene &s) {
        typename spline::KnotVectorType knots(s.knots.size());
        typename spline::ControlPointVectorType control(1, count);
        for (size_t i = 0; i < s.knots.size(); ++i) knots(static_cast<long>(i)) = s.knots[i];
        for (size_t i = 0; i < count; ++i) control(static_cast<long>(i)) = s.control_points[i];
        curve = spline(knots, control);
    }
    float operator()(float x) const { return static_cast<float>(curve(x)(0)); }
};

// GSL, non-zero basis functions only, which is its fastest form.
struct gsl {
    std::unique_ptr<gsl_bspline_workspace, decltype(&gsl_bspline_free)> work;
    std::vector<double> control;
    mutable std::array<double, degree + 1> basis{};

    explicit gsl(const scene &s)
        : work(gsl_bspline_alloc(degree + 1, count - degree + 1), gsl_bspline_free),
          control(s.control_points.begin(), s.control_points.end()) {
        const std::vector<double> breaks(s.knots.begin() + degree, s.knots.end() - degree);
        const gsl_vector_const_view view =
            gsl_vector_const_view_array(breaks.data(), breaks.size());
        gsl_bspline_knots(&view.vector, work.get());
    }
    float operator()(float x) const {
        size_t first, last;
        gsl_vector_view view = gsl_vector_view_array(basis.data(), basis.size());
        gsl_bspline_eval_nonzero(static_cast<double>(x), &view.vector, &first, &last, work.get());
        double value = 0;
        for (size_t i = 0; i <= degree; ++i) value += basis[i] * control[first + i];
        return static_cast<float>(value);
    }
};

// The textbook: binary search and de Boor's scheme, in float.
struct de_boor {
    scene s;

    explicit de_boor(const scene &from) : s(from) {}
    float operator()(float x) const {
        const auto begin = s.knots.begin();
        const auto after = std::upper_bound(begin + degree + 1, begin + count, x);
        const size_t span = static_cast<size_t>(after - begin) - 1;
        std::array<float, degree + 1> d;
        for (size_t j = 0; j <= degree; ++j) d[j] = s.control_points[span - degree + j];
        for (size_t r = 1; r <= degree; ++r) {
            for (size_t j = degree; j >= r; --j) {
                const float left = s.knots[span - degree + j], right = s.knots[span + 1 + j - r];
                const float alpha = (x - left) / (right - left);
                d[j] = (1 - alpha) * d[j - 1] + alpha * d[j];
            }
        }
        return d[degree];
    }
};

template <typename contestant>
void enter(const char *name, const scene &s, const std::vector<float> &expected) {
    const auto curve = std::make_shared<contestant>(s);
    double sum = 0, expected_sum = 0;
    for (size_t i = 0; i < points; ++i) {
        const float value = (*curve)(s.x[i]);
        if (!(std::fabs(value - expected[i]) < 2e-3f)) {
            std::fprintf(stderr, "%s %s: %g at %g, but ours is %g\n", s.name.c_str(), name,
                         static_cast<double>(value), static_cast<double>(s.x[i]),
                         static_cast<double>(expected[i]));
            std::exit(1);
        }
        sum += value;
        expected_sum += expected[i];
    }
    std::printf("%-8s %-20s sum %.3f (ours %.3f)\n", s.name.c_str(), name, sum, expected_sum);
    const auto run = [curve, s](benchmark::State &state) {
        for (auto unused : state) {
            (void)unused;
            float total = 0;
            for (const float x : s.x) total += (*curve)(x);
            benchmark::DoNotOptimize(total);
        }
        state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(points));
    };
    benchmark::RegisterBenchmark((s.name + "/" + name).c_str(), run);
}

void enter_all(const scene &s) {
    const value_alone reference(s);
    std::vector<float> expected;
    for (const float x : s.x) expected.push_back(reference(x));
    enter<with_slope>("compbox", s, expected);
    enter<value_alone>("compbox, value alone", s, expected);
    enter<eigen<float>>("Eigen float", s, expected);
    enter<eigen<double>>("Eigen double", s, expected);
    enter<gsl>("GSL", s, expected);
    enter<de_boor>("de Boor float", s, expected);
}

// Four lines: knots, control points, x, our values.
void write(const scene &s, const std::string &folder) {
    const value_alone reference(s);
    std::vector<float> values;
    for (const float x : s.x) values.push_back(reference(x));
    std::ofstream file(folder + "/bspline-" + s.name + ".txt");
    file.precision(9);
    const auto line = [&file](const std::vector<float> &numbers) {
        for (const float v : numbers) file << v << ' ';
        file << '\n';
    };
    line(s.knots);
    line(s.control_points);
    line(s.x);
    line(values);
}

}  // namespace

int main(int argc, char **argv) {
    const std::string option = argc > 1 ? argv[1] : "";
    for (const bool uniform : {true, false}) {
        const scene s = make_scene(uniform ? "uniform" : "random", uniform);
        if (option.rfind("--write=", 0) == 0) write(s, option.substr(8));
        enter_all(s);
    }
    if (option.rfind("--write=", 0) == 0) {
        argv[1] = argv[0];
        ++argv, --argc;
    }
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
