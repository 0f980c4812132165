// SPDX-License-Identifier: MIT
// A box with a term that a probe of the control adapts.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "tests/support/box_fixture.h"
#include "tests/support/box_from_text.h"

namespace compbox {

// X: model T1 (1 µm/°C) adapted by a probe, beside EXX of the position (0.1 µm/mm). Read block 0 …
// 31, request in register 12 of the write block. `changed`: pieces replaced in the text, one after
// the other.
inline std::string adapted_file(
    std::initializer_list<std::pair<std::string, std::string>> changed = {}) {
    std::string text = R"({
"format": "compbox/1", "revision": 1, "machine": {"name": "m", "axes": ["X"]}, "cycle": {"period_ms": 30},
"plc": {"profile": "generic", "transport": {"tcp": {"host": "127.0.0.1"}}, "read": {"start": 0, "count": 32},
 "write": {"start": 100, "count": 16}, "control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101,
 "request": 112, "heartbeat_timeout_ms": 200},
"signals": [{"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001, "min": 0, "max": 1000},
 {"name": "T1", "unit": "degC", "plc": 10, "type": "int16", "scale": 0.1, "min": -100, "max": 100, "max_age_ms": 90},
 {"name": "probe", "unit": "um", "plc": 12, "type": "int32", "scale": 0.01, "min": -1000, "max": 1000},
 {"name": "probe_n", "unit": "1", "plc": 14, "type": "uint16", "min": 0, "max": 65535}],
"terms": [{"name": "EXX", "type": "polyline", "signal": "X", "positions": [0, 1000], "values": [0, 100]},
 {"name": "thermal", "type": "linear", "inputs": ["T1"], "weights": [1]},
 {"name": "adapted", "type": "adapt", "of": "thermal", "probe": {"value": "probe", "count": "probe_n"},
  "bias_max_um": 30, "gain_max": 0.5, "step_max_um": 5, "drift_um_per_sqrt_h": 6, "gain_drift_per_sqrt_h": 0.5,
  "sigma_um": 1.5, "min_interval_s": 1}],
"channels": [{"name": "X", "sum": ["adapted", "EXX"], "limit_um": 200, "error_um": 400, "slew_um_per_s": 500,
 "plc": 104, "type": "int32", "scale": 0.01}],
"safety": {"hold_ms": 500, "ramp_um_per_s": 50}})";
    for (const auto &[piece, other] : changed) {
        const size_t at = text.find(piece);
        EXPECT_NE(at, std::string::npos) << piece;
        text.replace(at, piece.size(), other);
    }
    return text;
}

// The model as a bank that states its sigma: T1 of 0 °C is in the middle of what was trained, and
// each 5 °C one further along.
inline const std::pair<std::string, std::string> with_sigma = {
    R"("inputs": ["T1"], "weights": [1]})",
    R"("bank": {"inputs": ["T1"], "tau_s": [0], "weights": [[1]]},
  "sigma": {"floor_um": [8], "along_um": [4], "offsets": [0], "directions": [[0.2]]}})"};

struct probe_rig : box_rig {
    uint16_t count = 65534;

    explicit probe_rig(const std::string &text = adapted_file()) : box_rig(from_text(text)) {
        position(8, 200);
        temperature(20);
        in.registers[14] = count;
        run_s(3);
        EXPECT_EQ(mode(), CB_MODE_ACTIVE);
        EXPECT_NEAR(output(), -40, 0.011);
    }
    void temperature(double degC) {
        in.registers[10] = static_cast<uint16_t>(std::lround(degC * 10));
    }
    // The PLC returns what it holds whenever it is asked.
    void stand_by() {
        in.held = CB_TRANSFER_OK;
        std::copy(std::begin(out.registers), std::end(out.registers),
                  std::begin(in.held_registers));
    }
    void run_s(double seconds) { steps(static_cast<unsigned>(std::lround(seconds / 0.03))); }
    void probe(double um, int by = 1) {
        put_int32(in.registers + 12, um * 100);
        in.registers[14] = count = static_cast<uint16_t>(count + by);
        step();
    }
    // A machine with this error at the probe, touched with the compensation that it has.
    void touch(double error_um) {
        probe(error_um + output());
        run_s(3);
    }
    const cb_probe_state &state() const { return box->probes[0]; }
    float y() const { return box->outputs[2]; }
    float m() const { return box->outputs[1]; }
    bool asks() const { return out.registers[12] & 1; }
};

}  // namespace compbox
