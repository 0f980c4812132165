// SPDX-License-Identifier: MIT
// A coefficient file with everything in it, and the loader called on changed copies of it.
#pragma once

extern "C" {
#include "firmware/config/config.h"
#include "firmware/load/load.h"
}

#include <memory>
#include <stdexcept>
#include <string>

namespace compbox_test {

// The enumerator's name; of an unknown value its number.
inline std::string error_name(int error) {
    switch (error) {
#define CB_X(name, value) \
    case name:            \
        return #name;
        CB_ERRORS(CB_X)
#undef CB_X
    }
    return std::to_string(error);
}

constexpr cb_target every_target = {
    "testbox",
    1u << CB_SOURCE_PLC | 1u << CB_SOURCE_CAN | 1u << CB_SOURCE_BUS | 1u << CB_SOURCE_HAND,
    1u << CB_TRANSPORT_TCP | 1u << CB_TRANSPORT_RTU, 0};

// A copy per test, so that a test can derive other constants from it.
const std::string full_example = R"({
  "format": "compbox/1",
  "revision": 7,
  "machine": {"name": "gantry 14 m", "axes": ["X", "Y", "Z"]},
  "cycle": {"period_ms": 30, "lead_ms": 45},
  "plc": {
    "profile": "sinumerik-840d",
    "transport": {"tcp": {"host": "127.0.0.1", "port": 1502, "unit": 1}},
    "exchange": "fc3+fc16",
    "read": {"start": 0, "count": 32}, "write": {"start": 100, "count": 16, "counters": true},
    "control": 0, "plc_heartbeat": 1, "status": 101, "box_heartbeat": 102, "heartbeat_timeout_ms": 200,
    "referenced_bits": [1, 4, 15]
  },
  "signals": [
    {"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001, "min": 0, "max": 14300},
    {"name": "T1", "unit": "degC", "can": "0x181", "offset": 2, "type": "int16le", "scale": 0.1,
     "min": -10, "max": 90, "max_rate_per_s": 2, "max_age_ms": 2500},
    {"name": "T2", "unit": "°C", "bus": "pt100", "unit_id": 5, "register": 7, "type": "int16",
     "scale": 0.1, "zero": -20, "min": -10, "max": 90, "essential": true},
    {"name": "B", "unit": "deg", "plc": 10, "type": "float32", "min": -180.5, "max": 180.5}
  ],
  "terms": [
    {"name": "EZX", "type": "bspline", "signal": "X", "degree": 3,
     "knots": [0, 0, 0, 0, 7000, 14300, 14300, 14300, 14300], "control_points": [0, 10.5, -20, 5, 1e1]},
    {"name": "EYX", "type": "polyline", "signal": "X", "positions": [0, 240, 500], "values": [0, 12, -3]},
    {"name": "KT", "type": "polynomial", "signal": "T1", "coefficients": [1, -0.5, 0.25], "center": 20,
     "half_range": 50, "from": 0, "to": 80},
    {"name": "KB", "type": "polynomial", "signal": "B", "coefficients": [0.5]}
  ],
  "channels": [
    {"name": "Z", "sum": ["EZX", "KT"], "limit_um": 300, "error_um": 400, "slew_um_per_s": 500,
     "deadband_um": 0.5, "sign": -1, "plc": 104, "type": "int32", "scale": 0.01, "applied": 24},
    {"name": "Y1", "sum": ["EYX"], "limit_um": 100, "error_um": 100, "slew_um_per_s": 50,
     "plc": 106, "type": "int16", "scale": 1},
    {"name": "Y2", "sum": ["EYX", "KB"], "limit_um": 100, "error_um": 200, "slew_um_per_s": 50,
     "plc": 107, "type": "int16", "scale": 0.1}
  ],
  "pairs": [{"channels": ["Y1", "Y2"], "max_difference_um": 50}], "buses": [{"name": "pt100", "rtu": {"device": "/dev/ttyS1", "baud": 9600}, "every_ms": 250}],
  "safety": {"hold_ms": 500, "ramp_um_per_s": 50},
  "provenance": {"by": "nobody", "runs": [1, 2, {"deep": [null, true, false, "\ud83d\ude00"]}]}
}
)";

// Result of the loader.
struct loaded {
    cb_error error;
    std::string text;  // the message
    uint32_t line, column;
    std::shared_ptr<cb_config> config;
};

// Copies the text into a buffer of exactly its size, so that a sanitizer detects every byte read
// beyond it.
inline loaded load(const std::string &text, const cb_target &target = every_target) {
    auto config = std::make_shared<cb_config>();
    auto scratch = std::make_unique<cb_load_scratch>();
    const std::unique_ptr<char[]> exact(new char[text.size() + (text.empty() ? 1 : 0)]);
    text.copy(exact.get(), text.size());
    cb_message message;
    const cb_error error =
        cb_config_load(config.get(), exact.get(), text.size(), &target, scratch.get(), &message);
    return {error, message.text, message.line, message.column, config};
}

// The example with one piece, which must occur exactly once, replaced by another.
inline std::string with(const std::string &piece, const std::string &other,
                        std::string text = full_example) {
    const auto at = text.find(piece);
    if (at == std::string::npos || text.find(piece, at + 1) != std::string::npos)
        throw std::logic_error("not exactly once in the example: " + piece);
    return text.replace(at, piece.size(), other);
}

}  // namespace compbox_test
