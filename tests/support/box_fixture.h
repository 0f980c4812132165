// SPDX-License-Identifier: MIT
// Hand-made configurations and a PLC that shares no line with the box, for the tests of the box at
// run time.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

extern "C" {
#include "firmware/box/box.h"
#include "firmware/terms/kinds.h"
#include "firmware/wire/number.h"
#include "models/polyline.h"
}

namespace compbox {

// Builds a configuration. Read block 0 … 31, write block 100 … 115, 30 ms, control word in register
// 0, heartbeats in 1 and 101, status in 100: as in docs/DESIGN.md §6.
struct config_builder {
    std::unique_ptr<cb_config> config = std::make_unique<cb_config>();

    config_builder() {
        std::memset(config.get(), 0, sizeof *config);
        config->period_us = 30000;
        config->hold_us = 500000;
        config->ramp_um_per_s = 50;
        cb_plc_config &plc = config->plc;
        plc.read = {0, 32, false};
        plc.write = {100, 16, false};
        plc.control = 0;
        plc.plc_heartbeat = 1;
        plc.status = 0;
        plc.box_heartbeat = 1;
        plc.heartbeat_timeout_ms = 200;
        plc.referenced_mask = 1 << 1;
    }

    // An axis position in mm: int32, 0.1 µm per unit, essential.
    unsigned position(const char *name, unsigned reg, float min = 0, float max = 1000) {
        cb_signal_config &s = signal(name, "mm", CB_SOURCE_PLC, CB_NUMBER_INT32, reg);
        s.essential = s.leads = true;
        s.scale = 0.0001f;
        s.min = min;
        s.max = max;
        s.max_age_ms = 90;
        return config->signals_count - 1u;
    }

    // A thermometer in °C on CAN: int16, 0.1 °C per unit, not essential.
    unsigned thermometer(const char *name, uint32_t max_age_ms = 2000) {
        cb_signal_config &s = signal(name, "degC", CB_SOURCE_CAN, CB_NUMBER_INT16_LE, 0);
        s.scale = 0.1f;
        s.min = -10;
        s.max = 90;
        s.max_age_ms = max_age_ms;
        return config->signals_count - 1u;
    }

    cb_signal_config &signal(const char *name, const char *unit, cb_signal_source source,
                             cb_number_type type, unsigned reg) {
        cb_signal_config &s = config->signals[config->signals_count++];
        std::strncpy(s.name, name, sizeof s.name - 1);
        std::strncpy(s.unit, unit, sizeof s.unit - 1);
        s.source = source;
        s.type = type;
        s.reg = static_cast<uint16_t>(reg);
        s.scale = 1;
        s.max_age_ms = 90;
        return s;
    }

    // A polyline term of one output; returns its output.
    unsigned polyline(const char *name, unsigned of, const std::vector<float> &x,
                      const std::vector<float> &y) {
        cb_term_config &t = term(name, CB_TERM_POLYLINE, of);
        cb_curve_config &c = t.as.curve;
        const uint16_t count = static_cast<uint16_t>(x.size());
        cb_ppoly curve;
        float *breaks = config->pool + c.pool;
        cb_polyline_to_ppoly(x.data(), y.data(), count, breaks, breaks + count, &curve);
        c.degree = curve.degree;
        c.spans = curve.spans;
        c.spans_per_unit = curve.spans_per_unit;
        config->pool_count = static_cast<uint16_t>(c.pool + count + 2 * (count - 1));
        return t.first_output;
    }

    // y = a0 + a1 x + …; returns its output.
    unsigned polynomial(const char *name, unsigned of, std::initializer_list<float> coefficients) {
        cb_term_config &t = term(name, CB_TERM_POLYNOMIAL, of);
        cb_curve_config &c = t.as.curve;
        c.degree = static_cast<uint8_t>(coefficients.size() - 1);
        c.spans = 1;
        c.center = 0;
        c.inverse_half_range = 1;
        c.from = config->signals[of].min;
        c.to = config->signals[of].max;
        for (float a : coefficients) config->pool[config->pool_count++] = a;
        return t.first_output;
    }

    cb_term_config &term(const char *name, cb_term_type type, unsigned of) {
        const uint8_t index = config->terms_count++;
        cb_term_config &t = config->terms[index];
        t.type = type;
        t.outputs = 1;
        t.first_output = config->outputs_count;
        t.as.curve.signal = static_cast<uint8_t>(of);
        t.as.curve.pool = config->pool_count;
        cb_output_config &o = config->outputs[config->outputs_count++];
        std::strncpy(o.name, name, sizeof o.name - 1);
        o.term = index;
        return t;
    }

    // A channel of int32, 0.01 µm per unit, limit 300 µm, error 400 µm, slew 500 µm/s.
    cb_channel_config &channel(const char *name, std::initializer_list<unsigned> sum,
                               unsigned reg) {
        cb_channel_config &c = config->channels[config->channels_count++];
        std::strncpy(c.name, name, sizeof c.name - 1);
        for (unsigned output : sum) c.sum[c.sum_count++] = static_cast<uint8_t>(output);
        c.type = CB_NUMBER_INT32;
        c.sign = 1;
        c.reg = static_cast<uint16_t>(reg);
        c.limit_um = 300;
        c.error_um = 400;
        c.slew_um_per_s = 500;
        c.scale = 0.01f;
        return c;
    }

    void pair(unsigned a, unsigned b, float max_difference_um) {
        config->pairs[config->pairs_count++] = {static_cast<uint8_t>(a), static_cast<uint8_t>(b),
                                                max_difference_um};
    }
};

// X in register 8, error 0 … 100 µm over 0 … 1000 mm, one channel in register 104.
inline config_builder simple() {
    config_builder b;
    const unsigned x = b.position("X", 8);
    const unsigned ezx = b.polyline("EZX", x, {0, 1000}, {0, 100});
    b.channel("Z", {ezx}, 4);
    return b;
}

// Registers in the PLC's byte order, big-endian.
inline void put_int32(uint16_t *registers, double number) {
    const int64_t n = std::llround(number);
    registers[0] = static_cast<uint16_t>((n >> 16) & 0xFFFF);
    registers[1] = static_cast<uint16_t>(n & 0xFFFF);
}
inline double get_int32(const uint16_t *registers) {
    return static_cast<int32_t>(static_cast<uint32_t>(registers[0]) << 16 | registers[1]);
}

// A box, its inputs and a clock, one step at a time. Each step is a good one unless the test
// changes it first: the reading is good, the heartbeat moves, the last write was confirmed, the
// write block is read back at the first contact (zeros, unless the test sets values).
struct box_rig {
    std::unique_ptr<cb_box> box = std::make_unique<cb_box>();
    cb_inputs in{};
    cb_outputs out{};
    int64_t now_us = 1000000;
    uint16_t heartbeat = 0;
    int64_t reading_us = 0;  // from the time of a reading to its step
    bool reading = true, beating = true;
    cb_transfer write = CB_TRANSFER_OK;

    explicit box_rig(const config_builder &builder) {
        std::memset(box.get(), 0, sizeof *box);
        box->config = *builder.config;
        cb_box_start(box.get());
        control(1 | 2);
    }

    void control(unsigned word) {
        in.registers[box->config.plc.control] = static_cast<uint16_t>(word);
    }
    void position(unsigned reg, double mm) { put_int32(in.registers + reg, mm / 0.0001); }
    void sample(unsigned signal, float raw) {
        in.samples[in.sample_count++] = {static_cast<uint8_t>(signal), raw, now_us};
    }

    // From now on readings and writes fail, or succeed again.
    void lose_plc() { reading = false, write = CB_TRANSFER_FAILED; }
    void find_plc() { reading = true, write = CB_TRANSFER_OK; }

    cb_mode mode() const { return static_cast<cb_mode>(box->mode.mode); }
    cb_reason reason() const { return static_cast<cb_reason>(box->mode.reason); }
    double output(unsigned channel = 0) const { return box->channels[channel].output_um; }
    // The PLC's view of a channel of the default kind.
    double written(unsigned reg) const { return get_int32(out.registers + reg) * 0.01; }

    void step(int64_t elapsed_us = 30000) {
        now_us += elapsed_us;
        if (beating) ++heartbeat;
        in.registers[box->config.plc.plc_heartbeat] = heartbeat;
        in.read_ok = reading;
        if (reading && box->plc.contact == CB_CONTACT_NONE && in.held == CB_TRANSFER_NONE)
            in.held = CB_TRANSFER_OK;
        in.read_us = now_us - reading_us;
        in.last_write = static_cast<uint8_t>(out.write ? write : CB_TRANSFER_NONE);
        cb_box_step(box.get(), &in, now_us, &out);
        in.sample_count = 0;
        in.missed_ticks = 0;
        in.held = CB_TRANSFER_NONE;
    }
    void steps(unsigned count) {
        for (unsigned i = 0; i < count; ++i) step();
    }
};

}  // namespace compbox
