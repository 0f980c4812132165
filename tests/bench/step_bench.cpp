// SPDX-License-Identifier: MIT
// Time of one whole step of the box and of loading its file, and the memory they take.
//   step_bench [Google Benchmark options]
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

extern "C" {
#include "firmware/box/box.h"
#include "firmware/load/load.h"
}

namespace {

constexpr cb_target target = {"step_bench", 1u << CB_SOURCE_PLC | 1u << CB_SOURCE_CAN,
                              1u << CB_TRANSPORT_TCP, 0};

std::string numbers(const std::vector<double> &values) {
    std::string text;
    for (const double v : values) text += (text.empty() ? "" : ", ") + std::to_string(v);
    return "[" + text + "]";
}

// A cubic of 20 control points over the travel, knots uneven.
std::string bspline(const std::string &name, const std::string &signal, double travel,
                    std::mt19937 &random) {
    std::uniform_real_distribution<double> size(-10, 10), place(0, travel);
    std::vector<double> knots, points;
    for (int i = 0; i < 16; ++i) knots.push_back(place(random));
    for (int i = 0; i < 4; ++i) knots.insert(knots.end(), {0, travel});
    std::sort(knots.begin(), knots.end());
    for (int i = 0; i < 20; ++i) points.push_back(size(random));
    return R"({"name": ")" + name + R"(", "type": "bspline", "signal": ")" + signal +
           R"(", "degree": 3, "knots": )" + numbers(knots) + R"(, "control_points": )" +
           numbers(points) + "}";
}

// Three axes, a PLC of 48 registers, `curves` B-splines summed into `channels` channels.
std::string coefficient_file(int curves, int channels) {
    std::mt19937 random(5);
    const std::string axes[] = {"X", "Y", "Z"};
    const double travel[] = {14300, 3000, 2500};
    std::string signals, terms, outputs;
    for (int i = 0; i < 3; ++i) {
        signals += (i ? ", " : "") + std::string(R"({"name": ")") + axes[i] +
                   R"(", "unit": "mm", "plc": )" + std::to_string(8 + 2 * i) +
                   R"(, "type": "int32", "scale": 0.0001, "min": 0, "max": )" +
                   std::to_string(travel[i]) + "}";
    }
    for (int i = 0; i < curves; ++i) {
        terms +=
            (i ? ",\n" : "") + bspline("E" + std::to_string(i), axes[i % 3], travel[i % 3], random);
    }
    for (int i = 0; i < channels; ++i) {
        std::string sum;
        for (int k = i; k < curves; k += channels) {
            sum += (sum.empty() ? "\"E" : ", \"E") + std::to_string(k) + "\"";
        }
        outputs += (i ? ",\n" : "") + std::string(R"({"name": "C)") + std::to_string(i) +
                   R"(", "sum": [)" + sum +
                   R"(], "limit_um": 300, "error_um": 400, "slew_um_per_s": 500, "plc": )" +
                   std::to_string(104 + 2 * i) + R"(, "type": "int32", "scale": 0.01})";
    }
    return R"({"format": "compbox/1", "revision": 1, "machine": {"name": "bench", "axes": ["X", "Y", "Z"]},
"cycle": {"period_ms": 30, "lead_ms": 45},
"plc": {"profile": "generic", "transport": {"tcp": {"host": "127.0.0.1", "port": 1502, "unit": 1}},
"exchange": "fc3+fc16", "read": {"start": 0, "count": 32}, "write": {"start": 100, "count": 32},
"control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101, "heartbeat_timeout_ms": 200},
"signals": [)" +
           signals + "],\n\"terms\": [" + terms + "],\n\"channels\": [" + outputs +
           R"(], "pairs": [], "safety": {"hold_ms": 500, "ramp_um_per_s": 50}})";
}

void load(const std::string &text, cb_config &config, cb_load_scratch &scratch) {
    cb_message message;
    if (cb_config_load(&config, text.data(), text.size(), &target, &scratch, &message) != CB_OK) {
        std::fprintf(stderr, "step_bench: line %u: %s\n", message.line, message.text);
        std::exit(1);
    }
}

// A PLC that answers every time while the three axes travel to and fro at 10 m/min.
struct machine {
    cb_inputs in{};
    cb_outputs out{};
    int64_t now_us = 1000000;

    void cycle(cb_box &box) {
        now_us += 30000;
        in.registers[0] = 0xB;
        ++in.registers[1];
        for (int i = 0; i < 3; ++i) {
            const int64_t way = now_us / 6 % 40000000;  // 0.1 µm; 10 m/min are 1.67 per µs
            const uint32_t at = static_cast<uint32_t>(way < 20000000 ? way : 40000000 - way);
            in.registers[8 + 2 * i] = static_cast<uint16_t>(at >> 16);
            in.registers[9 + 2 * i] = static_cast<uint16_t>(at);
        }
        in.read_ok = true;
        in.read_us = now_us;
        in.last_write = static_cast<uint8_t>(out.write ? CB_TRANSFER_OK : CB_TRANSFER_NONE);
        cb_box_step(&box, &in, now_us, &out);
    }
};

void step(benchmark::State &state, int curves, int channels) {
    const auto box = std::make_unique<cb_box>();
    const auto scratch = std::make_unique<cb_load_scratch>();
    load(coefficient_file(curves, channels), box->config, *scratch);
    cb_box_start(box.get());
    machine plc;
    for (int i = 0; i < 100; ++i) plc.cycle(*box);
    for (auto unused : state) {
        (void)unused;
        plc.cycle(*box);
        benchmark::DoNotOptimize(plc.out);
    }
    if (box->mode.mode != CB_MODE_ACTIVE) state.SkipWithError("the box is not ACTIVE");
}

void loading(benchmark::State &state, int curves, int channels) {
    const auto config = std::make_unique<cb_config>();
    const auto scratch = std::make_unique<cb_load_scratch>();
    const std::string text = coefficient_file(curves, channels);
    for (auto unused : state) {
        (void)unused;
        load(text, *config, *scratch);
    }
    state.SetBytesProcessed(state.iterations() * static_cast<int64_t>(text.size()));
}

}  // namespace

int main(int argc, char **argv) {
    std::printf("struct cb_box   %6zu bytes, of which configuration %zu   / %d\n", sizeof(cb_box),
                sizeof(cb_config), 64 * 1024);
    std::printf("loader scratch  %6zu bytes                              / %d\n",
                sizeof(cb_load_scratch), 32 * 1024);
    benchmark::RegisterBenchmark("step, 6 B-splines, 3 channels", step, 6, 3);
    benchmark::RegisterBenchmark("step, 18 B-splines, 6 channels", step, 18, 6);
    benchmark::RegisterBenchmark("step, 60 B-splines, 12 channels", step, 60, 12);
    benchmark::RegisterBenchmark("load, 18 B-splines, 6 channels", loading, 18, 6)
        ->Unit(benchmark::kMicrosecond);
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
