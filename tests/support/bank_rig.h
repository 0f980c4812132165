// SPDX-License-Identifier: MIT
// A box with terms that have banks, its thermometers and the speed of a spindle.
#pragma once

#include <stdexcept>
#include <string>

#include "tests/support/box_from_text.h"

namespace compbox {

// in : terms, signals: entries of their lists
inline std::string bank_file(const std::string &terms, const std::string &more_signals = "") {
    return R"({
  "format": "compbox/1", "revision": 1, "machine": {"name": "m"}, "cycle": {"period_ms": 30, "lead_ms": 100},
  "plc": {"profile": "generic", "transport": {"tcp": {"host": "127.0.0.1"}},
    "read": {"start": 0, "count": 32}, "write": {"start": 100, "count": 16},
    "control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101, "heartbeat_timeout_ms": 200},
  "signals": [
    {"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001, "min": -2000, "max": 2000},
    {"name": "rpm", "unit": "1/min", "plc": 10, "type": "int32", "scale": 0.1, "min": -300, "max": 500, "max_age_ms": 60},
    {"name": "T1", "unit": "degC", "can": "0x181", "type": "int16le", "scale": 0.01, "min": -10, "max": 90,
     "max_rate_per_s": 40, "max_age_ms": 900},
    {"name": "T2", "unit": "degC", "can": "0x182", "type": "int16le", "scale": 0.01, "min": 10, "max": 40})" +
           more_signals + R"(],
  "terms": [)" +
           terms + R"(],
  "channels": [
    {"name": "X", "sum": ["banked"], "limit_um": 900, "error_um": 100000, "slew_um_per_s": 100000,
     "plc": 104, "type": "int32", "scale": 0.01}
  ],
  "safety": {"hold_ms": 500, "ramp_um_per_s": 50}
})";
}

// Indices of the signals.
enum { AT_X, AT_RPM, AT_T1, AT_T2 };

struct bank_rig : box_rig {
    double x = 0, rpm = 0, t1 = 20, t2 = 25;
    bool heard[4] = {true, true, true, true};

    explicit bank_rig(const std::string &terms, const std::string &signals = "")
        : bank_rig(from_text(bank_file(terms, signals))) {}
    explicit bank_rig(const config_builder &file) : box_rig(file) {}
    void go(int64_t elapsed_us = 30000) {
        position(8, x);
        put_int32(in.registers + 10, rpm * 10);
        now_us += elapsed_us;  // the samples are as new as the reading
        if (heard[AT_T1]) sample(AT_T1, static_cast<float>(t1 * 100));
        if (heard[AT_T2]) sample(AT_T2, static_cast<float>(t2 * 100));
        now_us -= elapsed_us;
        for (unsigned i = 0; i < in.sample_count; ++i) in.samples[i].time_us = now_us + elapsed_us;
        step(elapsed_us);
    }
    unsigned index(const std::string &name) const {
        for (unsigned i = 0; i < box->config.outputs_count; ++i)
            if (name == box->config.outputs[i].name) return i;
        throw std::out_of_range("no output has the name " + name);
    }
    float term(const std::string &name) const { return box->outputs[index(name)]; }
    bool live(const std::string &name) const {
        return box->terms[box->config.outputs[index(name)].term].live;
    }
    float slope(const std::string &name, uint8_t signal) const {
        float slopes[CB_MAX_OUTPUTS] = {};
        cb_terms_slopes(&box->config, box->signals, box->terms, box->outputs, signal, slopes);
        return slopes[index(name)];
    }
};

}  // namespace compbox
