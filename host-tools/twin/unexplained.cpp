// SPDX-License-Identifier: MIT
#include "host-tools/twin/unexplained.h"

#include <algorithm>
#include <cmath>

#include "host-tools/twin/units.h"

namespace compbox::twin {

namespace {

constexpr int waves_per_direction = 24;
constexpr double most_waves_in_travel = 12.0;  // shortest wavelength: a twelfth of the travel
constexpr double shortest_s = 600.0, longest_s = 7200.0;
constexpr int samples = 2001;

struct range {
    double low = 0.0, high = 0.0;
    bool begun = false;
    void take(double value) {
        low = begun ? std::min(low, value) : value;
        high = begun ? std::max(high, value) : value;
        begun = true;
    }
    double width() const { return high - low; }
};

}  // namespace

// Draws the waves of each direction from its own stream, then scales them to config's percentage.
unexplained::unexplained(const twin_config &config, const std::vector<part_pointer> &explained) {
    for (std::size_t d = 0; d < 3; ++d) {
        random_stream stream(config.seed, std::string("unexplained ") + axis_letters[d]);
        for (int i = 0; i < waves_per_direction; ++i) {
            wave one{stream.uniform(), 0.0};
            const double period_s = shortest_s * std::pow(longest_s / shortest_s, stream.uniform());
            one.per_s = (stream.uniform() < 0.5 ? -1.0 : 1.0) / period_s;
            for (std::size_t a = 0; a < 3; ++a) {
                const twin_axis &axis = config.axes[a];
                if (!axis.present) continue;
                one.per_mm[a] =
                    stream.symmetric(most_waves_in_travel) / (axis.max_mm - axis.min_mm);
            }
            one.height_um = stream.normal();
            waves_[d].push_back(one);
        }
    }
    scale(config, explained);
}

// in : explained: the parts that set the scale; random states of a working day
// out: waves_ scaled so that their range is the configured percentage of the parts' range
void unexplained::scale(const twin_config &config, const std::vector<part_pointer> &explained) {
    random_stream stream(config.seed, "unexplained scale");
    std::array<range, 3> known, own;
    for (int i = 0; i < samples; ++i) {
        twin_state state;
        state.time_s = stream.symmetric(s_per_day);
        for (std::size_t a = 0; a < 3; ++a) {
            const twin_axis &axis = config.axes[a];
            state.position_mm[a] = axis.min_mm + stream.uniform() * (axis.max_mm - axis.min_mm);
        }
        for (const auto &part : explained) part->vary(state, stream);
        xyz sum = {};
        for (const auto &part : explained) sum = sum_of(sum, part->error_um(state));
        const xyz rough = raw(state);
        for (std::size_t d = 0; d < 3; ++d) {
            known[d].take(sum[d]);
            own[d].take(rough[d]);
        }
    }
    for (std::size_t d = 0; d < 3; ++d) {
        const double factor = 0.01 * config.unexplained_percent * known[d].width() / own[d].width();
        for (auto &one : waves_[d]) one.height_um *= factor;
    }
}

xyz unexplained::raw(const twin_state &state) const {
    xyz sum = {};
    for (std::size_t d = 0; d < 3; ++d) {
        for (const auto &one : waves_[d]) {
            double turns = one.phase + one.per_s * state.time_s;
            for (std::size_t a = 0; a < 3; ++a) turns += one.per_mm[a] * state.position_mm[a];
            sum[d] += one.height_um * std::cos(two_pi * turns);
        }
    }
    return sum;
}

xyz unexplained::error_um(const twin_state &state) const {
    return raw(state);
}

}  // namespace compbox::twin
