// SPDX-License-Identifier: MIT
// The control's touch-probe cycle and its hand-over to the box (docs/fakeplc.md, "The probe"). A
// cycle measures the deviation of the tool from the workpiece towards one or more axes, with the
// compensation that the axes have at that moment. Time is an argument.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/register_map.h"
#include "host-tools/twin/random.h"
#include "host-tools/twin/twin_file.h"

namespace compbox::fakeplc {

// A probe of the map, and the axis of the twin towards which it measures.
struct placed_probe {
    std::string axis;
    std::size_t direction = 0;  // 0..2: X, Y, Z
    std::string value, count;   // names of signals
};

// What a scan of the PLC knows.
struct probe_scan {
    std::int64_t now_us = 0;
    bool standing = true;    // all axes are at rest
    bool requested = false;  // bit 0 of plc.request, of a box that is alive
};

class probe_cycle {
  public:
    // Most repetitions of a cycle on request: with the first one three measurements.
    static constexpr int most_repeats = 2;

    probe_cycle(const twin::twin_probe &kind, std::vector<placed_probe> probes, std::uint64_t seed,
                std::int64_t now_us);

    // Queues a cycle towards the named axis, whose measurement is wrong by off_um; false for an
    // axis without a probe.
    bool order(const std::string &axis, double off_um);

    // A scan of the PLC. true_error_um: the error of the tool now, with the compensation; it is
    // called when a measurement takes place. out: state: a cycle measures after duration_s at rest.
    // That scan shows the values, and the next one counts up by one. A request repeats the last
    // cycle, duration_s after its count at the earliest and most_repeats times at most; then it
    // must go off first.
    void scan(const probe_scan &now, const std::function<twin::xyz()> &true_error_um);

    // Drops every cycle that is queued or runs. Values and counts are retentive.
    void restart();

    // out: present number of the signal, in um or measurements; nothing if it is not one of a probe
    std::optional<double> shown(const std::string &signal) const;
    // out: whether the last scan measured the probe with this value; the next one counts it
    bool measured(const std::string &value) const;
    // out: number of measurements, all probes
    int measurements() const { return measurements_; }
    // out: events since the last call
    std::vector<std::string> take_events();

  private:
    struct ordered {
        std::size_t probe;
        double off_um;
    };
    void begin(const probe_scan &now);
    void measure(const twin::xyz &error_um);
    void count();

    twin::twin_probe kind_;
    std::vector<placed_probe> probes_;
    twin::random_stream noise_;
    std::vector<double> value_um_;
    std::vector<std::uint16_t> count_;
    std::vector<ordered> waiting_, running_, last_;
    bool counting_ = false;  // values are shown, counts follow
    std::int64_t standing_since_us_, counted_us_, interval_due_us_;
    int repeats_ = 0, measurements_ = 0;
    std::vector<std::string> events_;
};

}  // namespace compbox::fakeplc
