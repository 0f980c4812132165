// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/nc_handshake.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace compbox::fakeplc {

namespace {

// beyond every NC's alarm limit; differences do not overflow
constexpr double most_units = 1e9;

enum handshake_bit : unsigned { bit_estb = 1u << 8, bit_erend = 1u << 9, bit_alarm = 1u << 15 };

}  // namespace

nc_handshake::nc_handshake(const nc_interface &nc, const std::vector<taken_channel> &channels,
                           bool axes_at_once, std::uint64_t seed)
    : nc_(nc),
      axes_at_once_(axes_at_once),
      held_(channels.size()),
      units_(channels.size(), 0),
      data_(channels.size(), 0),
      written_(channels.size(), false),
      random_(seed, "EREND") {
    for (const auto &channel : channels) {
        increment_um_.push_back(std::fabs(channel.scale_um));
        names_.push_back(channel.name);
    }
}

// [changed] out: the next channels to write: the first from next_ on whose value differs from the
// NC's, or all channels together
void nc_handshake::choose(const std::vector<correction> &wanted) {
    const std::size_t count = held_.size();
    for (std::size_t c = 0; c < count; ++c) {
        const double units = wanted[c].um / increment_um_[c];
        data_[c] = std::lround(std::clamp(units, -most_units, most_units));
    }
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t c = (next_ + i) % count;
        if (written_[c] && data_[c] == units_[c]) continue;
        first_ = axes_at_once_ ? 0 : c;
        last_ = axes_at_once_ ? count : c + 1;
        next_ = last_ % count;
        step_ = step::address;
        return;
    }
}

// [handshake] One step of the ladder. ED and EA do not change between `address` and the end of the
// handshake.
void nc_handshake::scan(const std::vector<correction> &wanted,
                        const std::vector<std::optional<double>> &, std::int64_t) {
    switch (step_) {
        case step::idle:
            if (alarm_.empty()) choose(wanted);
            return;
        case step::address:
            estb_ = true;
            step_ = step::strobe;
            return;
        case step::strobe:
            if (!erend_) return;
            estb_ = false;
            step_ = step::release;
            return;
        case step::release:
            if (!erend_) step_ = step::idle;
            return;
    }
}

// The NC applies a value at once. A value out of range raises an alarm and changes nothing.
void nc_handshake::take(std::size_t c) {
    const bool too_large = std::labs(data_[c]) > nc_.alarm_units;
    const bool too_far = std::labs(data_[c] - units_[c]) >= nc_.alarm_units;
    if (too_large || too_far) {
        alarm_ = fmt::format(
            "external data input of {}: {}{}", names_[c], data_[c],
            too_large ? fmt::format(" is beyond {}", nc_.alarm_units)
                      : fmt::format(" is {} or more from {}", nc_.alarm_units, units_[c]));
        return;
    }
    units_[c] = data_[c];
    held_[c].um = static_cast<double>(data_[c]) * increment_um_[c];
    written_[c] = true;
}

// The NC's part: reads ESTB in its own cycles and answers some cycles later.
void nc_handshake::cycle(std::int64_t) {
    if (!estb_) {
        erend_ = false;
        const int spread = nc_.answer_longest_cycles - nc_.answer_shortest_cycles + 1;
        if (cycles_left_ == 0)
            cycles_left_ = nc_.answer_shortest_cycles +
                           static_cast<int>(random_.next() % static_cast<unsigned>(spread));
        return;
    }
    if (erend_ || --cycles_left_ > 0) return;
    for (std::size_t c = first_; c < last_ && alarm_.empty(); ++c) take(c);
    erend_ = true;
}

std::uint16_t nc_handshake::handshake() const {
    unsigned word = step_ == step::idle ? 0u : static_cast<unsigned>(first_ + 1);
    if (estb_) word |= bit_estb;
    if (erend_) word |= bit_erend;
    if (!alarm_.empty()) word |= bit_alarm;
    return static_cast<std::uint16_t>(word);
}

void nc_handshake::restart_plc() {
    step_ = step::idle;
    estb_ = false;
    next_ = 0;
    written_.assign(written_.size(), false);
}

}  // namespace compbox::fakeplc
