// SPDX-License-Identifier: MIT
#include "host-tools/commission/judge.h"

#include <algorithm>
#include <cmath>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

namespace compbox::commission {

namespace {

constexpr double still = 0.04;  // share of the offset; less is noise, not motion
constexpr double off = 0.3;     // tolerance for indicator, backlash and drift

[[noreturn]] void refuse(const std::string &axis, double offset_um, double measured_um,
                         const std::string &reason) {
    throw input_error(fmt::format("axis {}: commanded {:.4g} µm, measured {:.4g} µm: {}", axis,
                                  offset_um, measured_um, reason));
}

}  // namespace

bool is_reversed(const std::string &axis, double offset_um, double measured_um) {
    const double ratio = measured_um / offset_um;
    const double size = std::abs(ratio);
    if (!(size >= still)) {
        refuse(axis, offset_um, measured_um,
               "the axis did not move; is another one moved by its register (plc of the channel), "
               "or is compensation off in the control?");
    }
    const double power = std::round(std::log10(size));
    if (std::abs(size / std::pow(10.0, power) - 1.0) > off) {
        refuse(axis, offset_um, measured_um,
               "neither the one nor a power of ten of it; measure again, or look at the scale of "
               "the channel and at what the PLC program multiplies by");
    }
    if (power != 0.0) {
        refuse(
            axis, offset_um, measured_um,
            fmt::format(
                "wrong by a factor of {:g}; the scale of the channel is {} what the control takes",
                std::pow(10.0, std::abs(power)), power > 0 ? "too small for" : "too large for"));
    }
    return ratio < 0.0;
}

spread spread_of(std::vector<std::int64_t> times_us) {
    std::sort(times_us.begin(), times_us.end());
    const auto at = [&](double part) {
        const auto last = static_cast<double>(times_us.size() - 1);
        return static_cast<double>(times_us[static_cast<std::size_t>(std::ceil(part * last))]) /
               1000.0;
    };
    return {times_us.size(), at(0.5), at(0.99)};
}

json json_of(const spread &times) {
    const auto rounded = [](double ms) { return std::round(ms * 1000.0) / 1000.0; };
    return {{"count", times.count}, {"p50", rounded(times.p50_ms)}, {"p99", rounded(times.p99_ms)}};
}

double lead_of(const loop_times &times) {
    const double to_write_ms = std::max(0.0, times.exchange.p50_ms - times.write.p50_ms);
    const double line_ms = times.line_ms > 0.0 ? times.line_ms - times.update_ms : 0.0;
    return times.update_ms / 2.0 + to_write_ms + times.taken_over.p50_ms + times.round_ms / 2.0 +
           (times.period_ms + line_ms) / 2.0;
}

double shortest_period_ms(const loop_times &times) {
    return std::max(1.0, std::ceil(times.exchange.p99_ms / 0.8));
}

}  // namespace compbox::commission
