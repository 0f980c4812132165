// SPDX-License-Identifier: MIT
// A small machine behind a fakeplc in virtual time, and a box that consists of requests only.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "host-tools/fakeplc/plc.h"

namespace compbox {

// Modes as written by the box.
constexpr unsigned standby = 0, active = 1, hold = 2, ramp = 3, faulty = 4, stopped = 5;

inline fakeplc::number_format format(const char *name) {
    return fakeplc::number_format::parse(name).value();
}

constexpr std::int64_t ms = 1000;  // in us

// Registers: control 0, heartbeat 1, X 2 (int32, 0.1 µm), T 4 (int16), applied 6; status 10, box
// heartbeat 11, channel X 12 (int32, 0.01 µm).
inline fakeplc::register_map small_map() {
    fakeplc::register_map map;
    map.read = {0, 8, false};
    map.write = {10, 6, false};
    map.control = 0, map.plc_heartbeat = 1, map.status = 10, map.box_heartbeat = 11;
    const auto i32 = fakeplc::number_format::parse("int32").value();
    const auto i16 = fakeplc::number_format::parse("int16").value();
    map.signals = {{"X", 2, i32, 0.0001, 0.0, {}, {}}, {"T", 4, i16, 0.1, -50.0, {}, {}}};
    map.channels = {{"X", 12, 6, i32, 0.01}};
    return map;
}

inline twin::twin_config small_machine() {
    twin::twin_config config;
    config.axes[0] = {true, 0.0, 1000.0, 200.0, 1000.0, 50.0, 250.0, 1};
    config.errors["EXX"].amplitude = 30.0;
    config.signals["T"] = 21.5;
    config.start_mm = {12.3456, 0.0, 0.0};
    return config;
}

// A box that consists of requests only.
struct rig {
    fakeplc::register_map map;
    fakeplc::fake_plc plc;
    std::int64_t now_us = 0;
    std::uint16_t beat = 0;
    std::vector<std::string> events;

    explicit rig(const twin::twin_config &config = small_machine(),
                 const fakeplc::register_map &m = small_map(), const char *profile = "generic")
        : rig(config, m, fakeplc::plc_profile::find(profile).value()) {}
    rig(const twin::twin_config &config, const fakeplc::register_map &m,
        const fakeplc::plc_profile &profile)
        : map(m), plc(config, m, profile, 0) {}

    void run_ms(std::int64_t duration_ms) {
        now_us += duration_ms * ms;
        plc.run_to(now_us, [this](const fakeplc::plc_state &state) {
            events.insert(events.end(), state.events.begin(), state.events.end());
        });
    }
    std::uint16_t reg(int address) {
        const auto reply = plc.answer({3, 0, static_cast<std::uint8_t>(address), 0, 1});
        return static_cast<std::uint16_t>(reply.at(2) << 8 | reply.at(3));
    }
    double int32_at(int address) {
        const auto bits = static_cast<std::uint32_t>(reg(address)) << 16 | reg(address + 1);
        return static_cast<double>(static_cast<std::int32_t>(bits));
    }
    void set_reg(int address, unsigned value) {
        plc.answer({16, 0, static_cast<std::uint8_t>(address), 0, 1, 2,
                    static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)});
    }
    // Writes of a box in one cycle: status, heartbeat, channel.
    void write(unsigned mode, double channel_um) {
        const auto raw = static_cast<std::uint32_t>(std::lround(channel_um * 100.0));
        const int channel = map.channels[0].address;
        set_reg(map.status, mode);
        set_reg(map.box_heartbeat, ++beat);
        set_reg(channel, raw >> 16);
        set_reg(channel + 1, raw & 0xFFFF);
    }
    // A running box that writes for this time.
    void box_runs_ms(std::int64_t duration_ms, unsigned mode, double channel_um) {
        for (std::int64_t t = 0; t < duration_ms; t += 30) {
            write(mode, channel_um);
            run_ms(30);
        }
    }
    double applied() const { return plc.state().applied_um[0]; }
    bool had(const std::string &words) const {
        for (const auto &event : events) {
            if (event.find(words) != std::string::npos) return true;
        }
        return false;
    }
};

}  // namespace compbox
