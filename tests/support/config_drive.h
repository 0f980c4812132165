// SPDX-License-Identifier: MIT
// Runs the box on a configuration that the loader accepts, with inputs at the ends of its ranges
// and beyond: no value may become infinite, NaN or larger than its limit.
#pragma once

extern "C" {
#include "firmware/box/box.h"
#include "firmware/terms/kinds.h"
#include "firmware/wire/number.h"
}

#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "tests/support/dice.h"

namespace compbox_test {

class drive {
  public:
    drive(const cb_config &config, uint32_t seed) : random(seed), box(std::make_unique<cb_box>()) {
        box->config = config;
        cb_box_start(box.get());
        for (int step = 0; step < 12 && broken.empty(); ++step) run(step);
    }
    std::string broken;  // the failure, or empty

  private:
    dice random;
    std::unique_ptr<cb_box> box;

    // Nested products may overflow within the ranges of their signals; then they fade.
    static bool multiplies_products(const cb_config &config) {
        for (int i = 0; i < config.terms_count; ++i) {
            const cb_term_config &term = config.terms[i];
            if (term.type != CB_TERM_PRODUCT) continue;
            const int used = config.outputs[term.as.product.output].term;
            if (config.terms[used].type == CB_TERM_PRODUCT) return true;
        }
        return false;
    }

    // A raw number for the signal, mostly with a value at an end or inside its range.
    float raw_for(const cb_signal_config &signal) {
        const float values[] = {signal.min, signal.max, 0.5f * signal.min + 0.5f * signal.max};
        const float wild[] = {0.0f,
                              -1.0f,
                              3.4e38f,
                              -3.4e38f,
                              1e-45f,
                              std::numeric_limits<float>::infinity(),
                              std::numeric_limits<float>::quiet_NaN()};
        if (random(8u) == 0) return wild[random(7u)];
        return (values[random(3u)] - signal.zero) / signal.scale;
    }

    // in : step: the number of the cycle, which moves the heartbeat
    // out: random registers and samples, the signals' plausible, the control word enabled
    void fill(cb_inputs &in, int64_t now_us, int step) {
        const cb_config &config = box->config;
        for (uint16_t &word : in.registers) word = static_cast<uint16_t>(random());
        for (uint8_t i = 0; i < config.signals_count; ++i) {
            const cb_signal_config &signal = config.signals[i];
            const float raw = raw_for(signal);
            if (signal.source == CB_SOURCE_PLC) {
                cb_number_encode(static_cast<cb_number_type>(signal.type), raw,
                                 in.registers + signal.reg);
            } else {
                in.samples[in.sample_count++] = {i, raw, now_us};
            }
        }
        in.registers[config.plc.control] = 0xFFFB;  // all but fault reset
        in.registers[config.plc.plc_heartbeat] = static_cast<uint16_t>(step);
        if (config.plc.read.counters) {
            in.registers[0] = static_cast<uint16_t>(step);
            in.registers[config.plc.read.count - 1] = static_cast<uint16_t>(step);
        }
    }

    // Runs one cycle and sets `broken` if an output is not finite or beyond its limit.
    void run(int step) {
        const cb_config &config = box->config;
        const int64_t now_us = 1000000 + step * static_cast<int64_t>(config.period_us);
        cb_inputs in = {};
        cb_outputs out = {};
        in.read_ok = true;
        in.read_us = now_us;
        in.last_write = CB_TRANSFER_OK;
        fill(in, now_us, step);
        cb_box_step(box.get(), &in, now_us, &out);
        if (box->counters.terms_not_finite > 0 && !multiplies_products(config))
            broken = "a term is not finite";
        for (int i = 0; i < config.outputs_count; ++i)
            if (!std::isfinite(box->outputs[i])) broken = "an output is not finite";
        for (int i = 0; i < config.channels_count; ++i) {
            if (!std::isfinite(box->channels[i].wanted_um)) broken = "a demand is not finite";
            if (!(std::fabs(out.channel_um[i]) <= config.channels[i].limit_um))
                broken = "a channel is beyond its limit";
        }
        for (unsigned i = 0; i < cb_all_channels(&config); ++i) {
            if (!(std::fabs(box->channels[i].output_um) <= config.channels[i].limit_um))
                broken = "a slope is beyond its limit";
        }
    }
};

}  // namespace compbox_test
