// SPDX-License-Identifier: MIT
#include "host-tools/simulation/replay.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <memory>
#include <sstream>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/text.h"

extern "C" {
#include "firmware/box/box.h"
#include "firmware/box/ceiling.h"
#include "firmware/box/state.h"
}

namespace compbox::simulation {

namespace {

constexpr const char *header =
    "number,generation,now_us,read_us,exchange_us,read_ok,last_write,held,stop,missed_ticks,"
    "samples,"
    "registers,held_registers,mode,channels,written";
constexpr std::int64_t longest_time_us = INT64_MAX / 4;  // differences and sums of times then fit

enum column {
    cycle_number,
    generation,
    now_us,
    read_us,
    exchange_us,
    read_ok,
    last_write,
    held,
    stop,
    missed_ticks,
    samples,
    registers,
    held_registers,
    mode,
    channels,
    written,
    columns
};

// One line of the recording, taken apart.
class recorded_line {
  public:
    recorded_line(const std::string &file, long line, const std::string &text,
                  std::vector<std::size_t> fields = {columns})
        : file_(file), line_(line), fields_(formats::split(text, ',')) {
        if (std::count(fields.begin(), fields.end(), fields_.size()) == 0)
            fail("has " + std::to_string(fields_.size()) + " columns");
    }

    [[noreturn]] void fail(const std::string &why) const {
        throw input_error(file_, line_, 0,
                          why + "; it is not what compboxd --record-inputs writes");
    }

    // out: from 0 to most
    template <typename kind>
    kind whole(column which, kind most) const {
        return parsed<kind>(fields_[which], 10, most);
    }

    // out: the text behind its name
    const std::string &named(std::size_t which, const std::string &name) const {
        if (fields_[which] != name) fail("has no " + name);
        return fields_[which + 1];
    }

    // out: the number behind its name; from least to most
    template <typename kind>
    kind named(std::size_t which, const std::string &name, kind most, kind least = 0) const {
        return parsed<kind>(named(which, name), 10, most, least);
    }

    // Hexadecimal numbers of `digits` each; exactly `count`, or none where none_too.
    std::vector<std::uint32_t> words(column which, std::size_t digits, std::size_t count,
                                     bool none_too) const {
        const std::string &text = fields_[which];
        if (text.size() != digits * count && !(none_too && text.empty())) {
            fail("has " + std::to_string(text.size() / digits) + " values where the file has " +
                 std::to_string(count) + " (is it the coefficient file of this recording?)");
        }
        std::vector<std::uint32_t> values;
        for (std::size_t i = 0; i < text.size(); i += digits) {
            values.push_back(parsed<std::uint32_t>(text.substr(i, digits), 16, 0xFFFFFFFFu));
        }
        return values;
    }

    // in : number of signals of the file. out: samples of the line; throws input_error for others
    std::vector<cb_sample> sensor_samples(unsigned signals) const {
        std::vector<cb_sample> list;
        std::istringstream text(fields_[samples]);
        for (std::string one; text >> one;) {
            const std::vector<std::string> parts = formats::split(one, ':');
            if (parts.size() != 3 || list.size() == CB_MAX_SAMPLES) fail("a sample is broken");
            list.push_back({parsed<std::uint8_t>(parts[0], 10, 255), real(parts[1]),
                            parsed<std::int64_t>(parts[2], 10, longest_time_us)});
            if (list.back().signal >= signals) fail("a sample is broken");
        }
        return list;
    }

    // in : the file. out: the state of the line; throws input_error for that of another file
    cb_state state(const cb_config &config) const {
        const unsigned signals = config.signals_count;
        cb_state state = {};
        state.stopped = named(0, "stopped", 1) == 1;
        state.beat = named(2, "beat", 1) == 1;
        state.plc_heartbeat = named<std::uint16_t>(4, "plc_heartbeat", UINT16_MAX);
        state.beat_us = named(6, "beat_us", longest_time_us, -longest_time_us);
        std::istringstream text(named(8, "lags"));
        for (std::string one; text >> one;) {
            const std::vector<std::string> parts = formats::split(one, ':');
            if (parts.size() != 5) fail("a lag is broken");
            const auto signal = parsed<std::uint32_t>(parts[0], 10, UINT8_MAX);
            if (signal >= signals) fail("a lag is broken");
            state.lags[signal] = {{real(parts[1]), real(parts[2]), real(parts[3])},
                                  parsed(parts[4], 10, longest_time_us, -longest_time_us),
                                  true};
        }
        const std::size_t size = fields_.size();
        if (size == 14 || size == 16) take_bank(config, state.bank);
        if (size == 12 || size == 16) take_probes(config, size - 2, state.probes);
        return state;
    }

    // Of a state, with lags alone, with probes, with a bank, with both.
    static std::vector<std::size_t> state_columns() { return {10, 12, 14, 16}; }

  private:
    // in : the file. out: lags and inputs of its banks
    void take_bank(const cb_config &config, cb_bank_state &bank) const {
        std::istringstream lags(named(10, "bank")), inputs(named(12, "inputs"));
        for (std::string one; lags >> one;) {
            const std::vector<std::string> parts = formats::split(one, ':');
            if (parts.size() != 3) fail("a lag of a bank is broken");
            const auto lag = parsed<std::uint32_t>(parts[0], 10, UINT16_MAX);
            if (lag >= config.bank_lags_count) fail("a lag of a bank is broken");
            cb_bank_settle(&bank, lag, {real(parts[1]), real(parts[2])});
        }
        for (std::string one; inputs >> one;) {
            const std::vector<std::string> parts = formats::split(one, ':');
            if (parts.size() != 3) fail("an input of a bank is broken");
            const auto signal = parsed<std::uint32_t>(parts[0], 10, CB_MAX_SIGNALS - 1);
            bank.value[signal] = real(parts[1]);
            bank.time_us[signal] = parsed(parts[2], 10, longest_time_us, -longest_time_us);
        }
    }

    // in : the file; place of the list. out: the adapted terms that go on
    void take_probes(const cb_config &config, std::size_t where, cb_probe_state *probes) const {
        std::istringstream text(named(where, "probes"));
        for (std::string one; text >> one;) {
            const std::vector<std::string> parts = formats::split(one, ':');
            std::uint32_t words[sizeof(cb_adapt) / 4];
            if (parts.size() != 3 || parts[1].size() != 8 * std::size(words))
                fail("a probe is broken");
            const auto index = parsed<std::uint32_t>(parts[0], 10, UINT8_MAX);
            if (index >= config.adapts_count) fail("a probe is broken");
            for (std::size_t k = 0; k < std::size(words); ++k)
                words[k] = parsed<std::uint32_t>(parts[1].substr(8 * k, 8), 16, 0xFFFFFFFFu);
            std::memcpy(&probes[index].filter, words, sizeof words);
            probes[index].grown_us = parsed(parts[2], 10, longest_time_us, -longest_time_us);
            probes[index].timed = true;
        }
    }

    // in : bits in hexadecimal
    float real(const std::string &text) const {
        const auto bits = parsed<std::uint32_t>(text, 16, 0xFFFFFFFFu);
        float value = 0.0f;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }

    template <typename kind>
    kind parsed(const std::string &text, int base, kind most, kind least = 0) const {
        kind value = 0;
        const char *end = text.data() + text.size();
        std::from_chars_result result;
        if constexpr (std::is_floating_point_v<kind>) {
            result = std::from_chars(text.data(), end, value);
        } else {
            result = std::from_chars(text.data(), end, value, base);
        }
        if (result.ec != std::errc() || result.ptr != end || !(value >= least && value <= most)) {
            fail("'" + text + "' is not a number that can stand here");
        }
        return value;
    }

    std::string file_;
    long line_;
    std::vector<std::string> fields_;
};

// out: inputs of the recorded cycle; throws input_error for a value out of range
cb_inputs inputs_of(const recorded_line &line, const cb_config &config) {
    cb_inputs in = {};
    in.read_us = line.whole<std::int64_t>(read_us, longest_time_us);
    in.exchange_us = line.whole<std::uint32_t>(exchange_us, UINT32_MAX);
    in.read_ok = line.whole<int>(read_ok, 1) == 1;
    in.last_write = line.whole<std::uint8_t>(last_write, CB_TRANSFER_UNKNOWN);
    in.held = line.whole<std::uint8_t>(held, CB_TRANSFER_UNKNOWN);
    in.stop = line.whole<int>(stop, 1) == 1;
    in.missed_ticks = line.whole<std::uint32_t>(missed_ticks, UINT32_MAX);
    const auto list = line.sensor_samples(config.signals_count);
    std::copy(list.begin(), list.end(), in.samples);
    in.sample_count = static_cast<std::uint8_t>(list.size());
    const auto read = line.words(registers, 4, config.plc.read.count, false);
    std::copy(read.begin(), read.end(), in.registers);
    const auto back = line.words(held_registers, 4, config.plc.write.count, true);
    std::copy(back.begin(), back.end(), in.held_registers);
    return in;
}

// What differs between a step and the recording; "": nothing.
std::string difference(const recorded_line &line, const cb_box &box, const cb_outputs &out) {
    const auto um = line.words(channels, 8, box.config.channels_count, false);
    for (unsigned c = 0; c < box.config.channels_count; ++c) {
        std::uint32_t bits = 0;
        std::memcpy(&bits, &out.channel_um[c], sizeof bits);
        if (bits == um[c]) continue;
        float recorded = 0.0f;
        std::memcpy(&recorded, &um[c], sizeof recorded);
        return std::string("channel ") + box.config.channels[c].name + " is " +
               fmt::format("{}", out.channel_um[c]) + " um where the box had " +
               fmt::format("{}", recorded);
    }
    const auto words = line.words(written, 4, box.config.plc.write.count, false);
    for (unsigned r = 0; r < box.config.plc.write.count; ++r) {
        if (out.registers[r] == words[r]) continue;
        return "register " + std::to_string(box.config.plc.write.start + r) + " is " +
               std::to_string(out.registers[r]) + " where the box had " + std::to_string(words[r]);
    }
    return line.whole<int>(mode, 255) == static_cast<int>(box.mode.mode) ? "" : "the mode differs";
}

// Takes the lines before the first cycle: site's ceiling, state of the box, names of the columns.
// in : box.config loaded. out: the box has started as the recorded one did
void start_as_recorded(cb_box &box, const std::string &recording, std::istringstream &text) {
    std::string site, state, names;
    if (!std::getline(text, site) || !std::getline(text, state) || !std::getline(text, names) ||
        names != header) {
        throw input_error(recording, 1, 0, "is not what compboxd --record-inputs writes");
    }
    const recorded_line limits(recording, 1, site, {4});
    const cb_ceiling ceiling = {limits.named(0, "most_um", 1e6f),
                                limits.named(2, "most_um_per_s", 1e6f)};
    cb_ceiling_apply(&box.config, &ceiling);
    cb_box_start(&box);
    const cb_state resumed =
        recorded_line(recording, 2, state, recorded_line::state_columns()).state(box.config);
    cb_state_give(&resumed, &box);
}

}  // namespace

replay_result replay(const cb_config &config, const std::string &recording,
                     const std::string &text) {
    const auto box = std::make_unique<cb_box>();
    box->config = config;
    std::istringstream rows(text);
    replay_result result;
    start_as_recorded(*box, recording, rows);
    std::string row;
    cb_outputs out = {};
    std::int64_t first_us = 0;
    for (long at = 4; std::getline(rows, row); ++at) {
        const recorded_line line(recording, at, row);
        if (line.whole<std::uint32_t>(generation, UINT32_MAX) != 0) {
            result.remarks.push_back("another coefficient file took over at line " +
                                     std::to_string(at) + "; what follows is left out");
            break;
        }
        if (line.whole<std::int64_t>(cycle_number, INT64_MAX) != result.cycles) {
            result.remarks.push_back("a cycle before line " + std::to_string(at) +
                                     " is not in the recording; what follows is left out");
            break;
        }
        const auto when_us = line.whole<std::int64_t>(now_us, longest_time_us);
        const cb_inputs in = inputs_of(line, box->config);
        cb_box_step(box.get(), &in, when_us, &out);
        if (result.cycles == 0) first_us = when_us;
        ++result.cycles;
        result.duration_s = static_cast<double>(when_us - first_us) * 1e-6;
        const std::string what = difference(line, *box, out);
        if (what.empty()) continue;
        result.difference = "line " + std::to_string(at) + ": " + what;
        break;
    }
    return result;
}

}  // namespace compbox::simulation
