// SPDX-License-Identifier: MIT
// One evaluation of one 19-20-3 network (tanh, linear output) at one random input: ours beside what
// people would use instead, all compiled with the same flags. Every contestant gets the weights in
// the form it likes best, made beforehand. All must agree before anything is timed.
//   network_bench [--write=FILE] [Google Benchmark options]
//     FILE: weights, inputs and our outputs, for other programs (network_report.py)
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

extern "C" {
#include "models/bpnet.h"
}
#ifdef HAVE_EMLEARN
#include <eml_net.h>
#endif
#ifdef HAVE_FANN
#include <floatfann.h>
#endif
#ifdef HAVE_GSL
#include <gsl/gsl_blas.h>
#endif

namespace {

constexpr int inputs = 19, hidden = 20, outputs = 3, points = 4096;
using input = std::array<float, inputs>;
using output = std::array<float, outputs>;

// As it was trained, rows of weights; inputs and outputs scaled to about 1.
struct network {
    std::array<float, hidden * inputs> w1;
    std::array<float, hidden> b1;
    std::array<float, outputs * hidden> w2;
    std::array<float, outputs> b2;
    std::vector<input> x = std::vector<input>(points);

    network() {
        std::mt19937 random(19);
        std::uniform_real_distribution<float> size(-1, 1);
        const auto fill = [&](auto &numbers) {
            for (float &number : numbers) number = size(random);
        };
        fill(w1), fill(b1), fill(w2), fill(b2);
        for (input &one : x) fill(one);
    }
};

struct compbox {
    std::vector<float> weights;
    cb_bpnet net{};

    explicit compbox(const network &n) {
        const std::vector<float> zeros(inputs, 0.0f), ones(inputs, 1.0f);
        const cb_bpnet_source source = {n.w1.data(),    n.b1.data(),  n.w2.data(), n.b2.data(),
                                        nullptr,        zeros.data(), ones.data(), zeros.data(),
                                        ones.data(),    inputs,       hidden,      outputs,
                                        CB_BPNET_TANSIG};
        weights.resize(cb_bpnet_floats(inputs, hidden, outputs, false));
        cb_bpnet_fold(&source, weights.data(), &net);
    }
    compbox(const compbox &) = delete;
    void operator()(const input &x, output &y) { cb_bpnet_evaluate(&net, x.data(), y.data()); }
};

// As anyone would write it, with sizes that the compiler knows and the C library's tanhf.
struct plain_loops {
    network n;

    explicit plain_loops(const network &from) : n(from) {}
    void operator()(const input &x, output &y) const {
        std::array<float, hidden> h;
        for (size_t i = 0; i < hidden; ++i) {
            float sum = n.b1[i];
            for (size_t j = 0; j < inputs; ++j) sum += n.w1[i * inputs + j] * x[j];
            h[i] = std::tanh(sum);
        }
        for (size_t k = 0; k < outputs; ++k) {
            float sum = n.b2[k];
            for (size_t i = 0; i < hidden; ++i) sum += n.w2[k * hidden + i] * h[i];
            y[k] = sum;
        }
    }
};

// Fixed sizes, which is its fastest form.
struct eigen {
    Eigen::Matrix<float, hidden, inputs> w1;
    Eigen::Matrix<float, hidden, 1> b1;
    Eigen::Matrix<float, outputs, hidden> w2;
    Eigen::Matrix<float, outputs, 1> b2;

    explicit eigen(const network &n)
        : w1(Eigen::Map<const Eigen::Matrix<float, hidden, inputs, Eigen::RowMajor>>(n.w1.data())),
          b1(n.b1.data()),
          w2(Eigen::Map<const Eigen::Matrix<float, outputs, hidden, Eigen::RowMajor>>(n.w2.data())),
          b2(n.b2.data()) {}
    void operator()(const input &x, output &y) const {
        const Eigen::Map<const Eigen::Matrix<float, inputs, 1>> in(x.data());
        const Eigen::Matrix<float, hidden, 1> h = (w1 * in + b1).array().tanh();
        Eigen::Map<Eigen::Matrix<float, outputs, 1>>(y.data()) = w2 * h + b2;
    }
};

#ifdef HAVE_EMLEARN
// Its own inference over the tables that its converter writes: weights input by input.
struct emlearn {
    std::array<float, inputs * hidden> w1;
    std::array<float, hidden * outputs> w2;
    network n;
    std::array<EmlNetLayer, 2> layers{};
    std::array<float, hidden> first{}, second{};
    EmlNet net{};

    explicit emlearn(const network &from) : n(from) {
        for (size_t i = 0; i < hidden; ++i) {
            for (size_t j = 0; j < inputs; ++j) w1[j * hidden + i] = n.w1[i * inputs + j];
            for (size_t k = 0; k < outputs; ++k) w2[i * outputs + k] = n.w2[k * hidden + i];
        }
        layers[0] = {hidden, inputs, w1.data(), n.b1.data(), EmlNetActivationTanh};
        layers[1] = {outputs, hidden, w2.data(), n.b2.data(), EmlNetActivationIdentity};
        net = {2, layers.data(), first.data(), second.data(), hidden};
    }
    emlearn(const emlearn &) = delete;
    void operator()(const input &x, output &y) {
        if (eml_net_regress(&net, x.data(), inputs, y.data(), outputs) != EmlOk) std::abort();
    }
};
#endif

#ifdef HAVE_FANN
struct fann_library {
    std::unique_ptr<fann, decltype(&fann_destroy)> net;

    explicit fann_library(const network &n)
        : net(fann_create_standard(3, inputs, hidden, outputs), fann_destroy) {
        fann_set_activation_function_hidden(net.get(), FANN_SIGMOID_SYMMETRIC);
        fann_set_activation_function_output(net.get(), FANN_LINEAR);
        fann_set_activation_steepness_hidden(net.get(), 1.0f);
        fann_set_activation_steepness_output(net.get(), 1.0f);
        // neurons are counted through the layers, each with a bias at its end
        const unsigned first = inputs + 1, last = first + hidden + 1;
        for (unsigned i = 0; i < hidden; ++i) {
            for (unsigned j = 0; j < inputs; ++j)
                fann_set_weight(net.get(), j, first + i, n.w1[i * inputs + j]);
            fann_set_weight(net.get(), inputs, first + i, n.b1[i]);
        }
        for (unsigned k = 0; k < outputs; ++k) {
            for (unsigned i = 0; i < hidden; ++i)
                fann_set_weight(net.get(), first + i, last + k, n.w2[k * hidden + i]);
            fann_set_weight(net.get(), first + hidden, last + k, n.b2[k]);
        }
    }
    void operator()(const input &x, output &y) const {
        const fann_type *got = fann_run(net.get(), const_cast<float *>(x.data()));
        for (size_t k = 0; k < outputs; ++k) y[k] = got[k];
    }
};
#endif

#ifdef HAVE_GSL
// Its single-precision BLAS for the layers, the C library's tanhf between them.
struct gsl {
    network n;

    explicit gsl(const network &from) : n(from) {}
    static void layer(const float *w, const float *b, size_t rows, size_t columns, const float *x,
                      float *y) {
        std::copy(b, b + rows, y);
        const gsl_matrix_float_const_view m = gsl_matrix_float_const_view_array(w, rows, columns);
        const gsl_vector_float_const_view from = gsl_vector_float_const_view_array(x, columns);
        gsl_vector_float_view to = gsl_vector_float_view_array(y, rows);
        gsl_blas_sgemv(CblasNoTrans, 1.0f, &m.matrix, &from.vector, 1.0f, &to.vector);
    }
    void operator()(const input &x, output &y) const {
        std::array<float, hidden> h;
        layer(n.w1.data(), n.b1.data(), hidden, inputs, x.data(), h.data());
        for (float &one : h) one = std::tanh(one);
        layer(n.w2.data(), n.b2.data(), outputs, hidden, h.data(), y.data());
    }
};
#endif

template <typename contestant>
void enter(const char *name, const network &n, const std::vector<output> &expected) {
    const auto net = std::make_shared<contestant>(n);
    for (size_t i = 0; i < points; ++i) {
        output y;
        (*net)(n.x[i], y);
        for (size_t k = 0; k < outputs; ++k) {
            if (std::fabs(y[k] - expected[i][k]) < 2e-5f) continue;
            std::fprintf(stderr, "%s: output %zu of point %zu is %g, but ours is %g\n", name, k, i,
                         static_cast<double>(y[k]), static_cast<double>(expected[i][k]));
            std::exit(1);
        }
    }
    const auto run = [net, &n](benchmark::State &state) {
        for (auto unused : state) {
            (void)unused;
            for (const input &x : n.x) {
                output y;
                (*net)(x, y);
                benchmark::DoNotOptimize(y);
            }
        }
        state.SetItemsProcessed(state.iterations() * points);
    };
    benchmark::RegisterBenchmark(name, run);
}

// Six lines: the four tables of weights, the inputs, our outputs.
void write(const network &n, const std::vector<output> &y, const std::string &path) {
    std::ofstream file(path);
    file.precision(9);
    const auto line = [&file](const auto &numbers) {
        for (const float v : numbers) file << v << ' ';
    };
    line(n.w1), file << '\n';
    line(n.b1), file << '\n';
    line(n.w2), file << '\n';
    line(n.b2), file << '\n';
    for (const input &one : n.x) line(one);
    file << '\n';
    for (const output &one : y) line(one);
    file << '\n';
}

}  // namespace

int main(int argc, char **argv) {
    const network n;
    compbox reference(n);
    std::vector<output> expected(points);
    for (size_t i = 0; i < points; ++i) reference(n.x[i], expected[i]);
    const std::string option = argc > 1 ? argv[1] : "";
    if (option.rfind("--write=", 0) == 0) {
        write(n, expected, option.substr(8));
        argv[1] = argv[0];
        ++argv, --argc;
    }
    enter<compbox>("compbox", n, expected);
    enter<plain_loops>("plain loops, tanhf", n, expected);
    enter<eigen>("Eigen", n, expected);
#ifdef HAVE_EMLEARN
    enter<emlearn>("emlearn", n, expected);
#endif
#ifdef HAVE_FANN
    enter<fann_library>("FANN", n, expected);
#endif
#ifdef HAVE_GSL
    enter<gsl>("GSL", n, expected);
#endif
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
