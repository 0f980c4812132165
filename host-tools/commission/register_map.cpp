// SPDX-License-Identifier: MIT
#include "host-tools/commission/register_map.h"

#include <algorithm>
#include <tuple>

#include "host-tools/formats/error.h"

extern "C" {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"  // functions named as their struct: C only
#include "firmware/load/registers.h"
#pragma GCC diagnostic pop
#include "firmware/signals/plausible.h"

extern "C" {
#include "firmware/config/config.h"
#include "firmware/wire/number.h"
}
}

namespace compbox::commission {

namespace {

// out: the decimal number that a float32 of the file came from: 0.0001, not 0.0000999999975
double as_in_file(float number) {
    return std::stod(fmt::format("{}", number));
}

}  // namespace

const char *type_word(cb_number_type type) {
    for (const cb_word *word = cb_number_words; word->word != nullptr; ++word) {
        if (word->value == type) return word->word;
    }
    return "?";
}

std::string registers_of(const map_row &row) {
    if (cb_number_registers(row.type) == 1) return fmt::format("register {}", row.address);
    return fmt::format("registers {} and {}", row.address, row.address + 1);
}

double decoded(const map_row &row, cb_number_type type, const std::uint16_t *registers) {
    return static_cast<double>(cb_number_decode(type, registers)) * row.scale + row.zero;
}

bool is_position(const map_row &row) {
    return row.signal && (row.unit == "mm" || row.unit == "deg");
}

// in : a configuration that outlives the map
register_map::register_map(const box_setup &setup) : config_(*setup.config) {
    const cb_plc_config &plc = config_.plc;
    add("control word", plc.control, false);
    add("PLC heartbeat", plc.plc_heartbeat, false);
    if (plc.has_handshake) add("handshake", plc.handshake, false);
    for (std::size_t i = 0; i < config_.signals_count; ++i) {
        const cb_signal_config &signal = config_.signals[i];
        if (signal.source != CB_SOURCE_PLC) continue;
        add(signal.name, signal.reg, false);
        map_row &row = rows_.back();
        row.unit = signal.unit;
        row.type = static_cast<cb_number_type>(signal.type);
        row.scale = as_in_file(signal.scale);
        row.zero = as_in_file(signal.zero);
        row.signal = i;
    }
    const auto add_offset = [&](const cb_channel_config &channel, bool written) {
        add(channel.name + std::string(written ? " offset" : " applied"),
            written ? channel.reg : channel.applied_reg, written);
        rows_.back().unit = "um";
        rows_.back().type = static_cast<cb_number_type>(channel.type);
        rows_.back().scale = channel.sign * as_in_file(channel.scale);
    };
    for (std::size_t c = 0; c < config_.channels_count; ++c) {
        if (config_.channels[c].has_applied) add_offset(config_.channels[c], false);
    }
    add("status", plc.status, true);
    add("box heartbeat", plc.box_heartbeat, true);
    for (std::size_t c = 0; c < config_.channels_count; ++c) add_offset(config_.channels[c], true);
    std::stable_sort(rows_.begin(), rows_.end(), [](const map_row &a, const map_row &b) {
        return std::tie(a.written, a.address) < std::tie(b.written, b.address);
    });
}

void register_map::add(const std::string &name, unsigned index, bool written) {
    map_row row;
    row.name = name;
    row.index = index;
    row.address = index + (written ? config_.plc.write.start : config_.plc.read.start);
    row.written = written;
    rows_.push_back(row);
}

void register_map::take(map_row &row, const std::uint16_t *registers) {
    const std::uint16_t *first = registers + row.index;
    row.raw.assign(first, first + cb_number_registers(row.type));
    row.value = decoded(row, row.type, first);
    row.low = row.seen ? std::min(row.low, row.value) : row.value;
    row.high = row.seen ? std::max(row.high, row.value) : row.value;
    row.seen = true;
    row.in_range = !row.signal ||
                   cb_signal_in_range(&config_.signals[*row.signal], static_cast<float>(row.value));
}

void register_map::observe(const live_box &live) {
    for (map_row &row : rows_) {
        if (row.written)
            take(row, live.written());
        else if (live.read_ok())
            take(row, live.registers());
    }
}

std::vector<const map_row *> register_map::signals() const {
    std::vector<const map_row *> all;
    for (const map_row &row : rows_) {
        if (row.signal) all.push_back(&row);
    }
    std::sort(all.begin(), all.end(), [](auto *a, auto *b) { return *a->signal < *b->signal; });
    return all;
}

}  // namespace compbox::commission
