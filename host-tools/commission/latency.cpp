// SPDX-License-Identifier: MIT
// Time from writing a step of a channel until the PLC reports it applied.
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>

#include "host-tools/commission/checks.h"
#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/config/config.h"
#include "firmware/config/profile.h"
}

namespace compbox::commission {

namespace {

constexpr double patience_s = 3.0;  // until one value is applied

// One step of the channel and its progress through writes and readings.
struct step_watch {
    double from_um = 0.0;      // applied value before the step
    double notable_um = 0.0;   // the PLC ignores a smaller change of a write
    double visible_um = 0.0;   // a smaller change of `applied` is noise
    std::int64_t sent_us = 0;  // the first write that exceeds notable_um; 0: not yet
    std::int64_t seen_us = 0;  // the first reading that shows it
};

struct watcher {
    live_box &live;
    std::size_t channel;
    step_watch step;
    std::vector<std::int64_t> writes_us;

    void attach() {
        live.on_write = [this](const box_write &write) {
            if (write.confirmed) writes_us.push_back(write.done_us - write.sent_us);
            const double moved_um = std::abs(write.output_um[channel] - step.from_um);
            if (step.sent_us == 0 && moved_um > step.notable_um) step.sent_us = write.sent_us;
        };
        live.on_reading = [this](const plc_reading &reading) {
            const double applied_um = *live.applied_um(channel, reading);
            const bool moved = std::abs(applied_um - step.from_um) > step.visible_um;
            if (step.sent_us != 0 && step.seen_us == 0 && moved)
                step.seen_us = (reading.requested_us + reading.received_us) / 2;
        };
    }
    void detach() {
        live.on_write = nullptr;
        live.on_reading = nullptr;
        live.read_between_cycles(false);
    }
};

// in : target of the channel. out: µs from write to applied; nothing: not within patience_s
std::optional<std::int64_t> time_step(watcher &watch, double to_um) {
    live_box &live = watch.live;
    const cb_channel_config &channel = live.config().channels[watch.channel];
    const double near_um = live.config().plc.deadband_um + 1.01 * channel.scale;
    live.cycle_until(patience_s, [&] {
        const double off_um = *live.applied_um(watch.channel) - live.output_um(watch.channel);
        return live.read_ok() && std::abs(off_um) <= near_um;
    });
    watch.step = {*live.applied_um(watch.channel), live.config().plc.deadband_um,
                  0.5 * channel.scale};
    live.set_offset_um(watch.channel, to_um);
    const auto seen = [&] {
        must_be_active(live);
        return watch.step.seen_us != 0;
    };
    if (!live.cycle_until(patience_s, seen)) return std::nullopt;
    return watch.step.seen_us - watch.step.sent_us;
}

[[noreturn]] void refuse_lost(const cb_channel_config &channel) {
    throw input_error("channels." + std::string(channel.name) +
                      ".applied: small steps were not applied within 3 s; is the deadband of the "
                      "PLC program larger than plc.deadband_um?");
}

// out: a step that the PLC applies and the machine tolerates, µm
double step_um(const cb_config &config, const cb_channel_config &channel) {
    return std::max(4.0 * config.plc.deadband_um, 2.0 * channel.scale);
}

}  // namespace

loop_times measure_times(live_box &live, std::size_t channel, int steps, double update_ms) {
    const double high_um = step_um(live.config(), live.config().channels[channel]);
    std::vector<std::int64_t> taken_us, exchanges_us;
    std::mt19937 random(1);
    int lost = 0;  // steps lost on a busy line
    watcher watch{live, channel, {}, {}};
    watch.attach();
    live.read_between_cycles(true);
    try {
        for (int i = 0; i < steps; ++i) {
            const auto took_us = time_step(watch, i % 2 == 0 ? high_um : 0.0);
            if (took_us) taken_us.push_back(*took_us);
            lost += !took_us;
            if (lost > 1 + steps / 20) refuse_lost(live.config().channels[channel]);
            // no two steps at the same phase of the PLC's scan
            for (auto wait = 2 + random() % 5; wait > 0; --wait) {
                live.cycle();
                if (live.exchange_us() > 0) exchanges_us.push_back(live.exchange_us());
            }
        }
    } catch (...) {
        watch.detach();
        throw;
    }
    watch.detach();
    if (exchanges_us.empty() || watch.writes_us.empty()) {
        throw input_error("plc.write: no write was confirmed while times were measured");
    }
    return {spread_of(exchanges_us),
            spread_of(watch.writes_us),
            spread_of(taken_us),
            update_ms,
            live.config().period_us / 1000.0,
            cb_profile_update_us(&live.config()) / 1000.0,
            live.config().plc.interpolate_us / 1000.0};
}

}  // namespace compbox::commission
