// SPDX-License-Identifier: MIT
#include "host-tools/commission/positions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/config/config.h"
#include "firmware/wire/number.h"
}

namespace compbox::commission {

namespace {

constexpr double standing = 0.05;       // mm or deg; a standing axis moves less
constexpr double resting = 0.01;        // mm or deg in rest_cycles
constexpr int rest_cycles = 8;          // without motion: the axis is at rest
constexpr int patience_cycles = 100;    // for an axis that goes on moving
constexpr double largest_margin = 0.1;  // mm or deg, however few digits are typed
constexpr double open_range = 1e5;      // a range beyond it is none

double unit_of(const map_row &row) {
    return cb_number_is_integer(row.type) ? std::abs(row.scale) : 1e-4;
}

double margin_of(const map_row &row, const shown_value &shown) {
    if (is_position(row))
        return std::min(largest_margin, std::max(shown.tolerance, 2.0 * unit_of(row)));
    return std::max({shown.tolerance, 2.0 * unit_of(row), 0.02 * std::abs(shown.value)});
}

struct factor {
    double value;
    const char *remedy;
};
constexpr std::array<factor, 9> factors = {{{-1.0, "its sign is inverted: look at scale"},
                                            {0.1, "10 times too large: look at scale"},
                                            {10.0, "10 times too small: look at scale"},
                                            {0.01, "100 times too large: look at scale"},
                                            {100.0, "100 times too small: look at scale"},
                                            {0.001, "1000 times too large: look at scale"},
                                            {1000.0, "1000 times too small: look at scale"},
                                            {25.4, "it is in inches: look at scale and unit"},
                                            {1 / 25.4, "the display is in inches: show mm"}}};

// All types that a register can have, the usual ones first.
constexpr std::array<cb_number_type, 13> types = {
    CB_NUMBER_INT32,    CB_NUMBER_INT32_CDAB,  CB_NUMBER_FLOAT32,   CB_NUMBER_FLOAT32_CDAB,
    CB_NUMBER_UINT32,   CB_NUMBER_UINT32_CDAB, CB_NUMBER_INT16,     CB_NUMBER_UINT16,
    CB_NUMBER_INT32_LE, CB_NUMBER_FLOAT32_LE,  CB_NUMBER_UINT32_LE, CB_NUMBER_INT16_LE,
    CB_NUMBER_UINT16_LE};

// out: the type with which the registers at `index` show the value, the row's own first
std::optional<cb_number_type> fitting_type(const map_row &row, const shown_value &shown,
                                           const std::vector<std::uint16_t> &block,
                                           std::size_t index) {
    const auto fits = [&](cb_number_type type) {
        if (index + cb_number_registers(type) > block.size()) return false;
        const double value = decoded(row, type, block.data() + index);
        return std::abs(value - shown.value) <= margin_of(row, shown);
    };
    if (fits(row.type)) return row.type;
    const auto *found = std::find_if(types.begin(), types.end(), fits);
    return found == types.end() ? std::nullopt : std::optional(*found);
}

// out: the probable cause of a difference and the key to change
std::string cause_of(const map_row &row, const shown_value &shown,
                     const std::vector<std::uint16_t> &block, unsigned block_start) {
    const double margin = margin_of(row, shown);
    if (std::abs(shown.value) > 20.0 * margin) {
        for (const auto &one : factors) {
            const double as = (row.value - row.zero) * one.value + row.zero;
            if (std::abs(as - shown.value) <= margin) return one.remedy;
        }
        if (const auto type = fitting_type(row, shown, block, row.index)) {
            return fmt::format("as {} it shows the value: look at type", type_word(*type));
        }
        for (std::size_t i = 0; i < block.size(); ++i) {
            const auto type = fitting_type(row, shown, block, i);
            if (!type) continue;
            return fmt::format("register {} as {} has the value: look at plc", block_start + i,
                               type_word(*type));
        }
    }
    return "look at plc, type, scale and zero, and at the PLC program";
}

bool are_together(const std::string &one, const std::string &other, const stages &together) {
    return std::any_of(together.begin(), together.end(), [&](const auto &names) {
        return std::count(names.begin(), names.end(), one) > 0 &&
               std::count(names.begin(), names.end(), other) > 0;
    });
}

std::string moved_text(const map_row &row, double way) {
    return fmt::format("{} by {:.4f} {}", row.name, way, row.unit);
}

std::vector<const map_row *> positions_of(const register_map &map) {
    auto rows = map.signals();
    rows.erase(
        std::remove_if(rows.begin(), rows.end(), [](auto *row) { return !is_position(*row); }),
        rows.end());
    return rows;
}

places places_of(const std::vector<const map_row *> &rows) {
    places all;
    for (const auto *row : rows) all.push_back(row->value);
    return all;
}

double five_decimals(double value) {
    return std::round(value * 1e5) / 1e5;
}

json record_of(const map_row &row) {
    return {{"plc", row.address},
            {"type", type_word(row.type)},
            {"scale", row.scale},
            {"zero", row.zero}};
}

// out: the record of an earlier run with the same registers; null: none
json earlier(const json &seen, const map_row &row) {
    if (!seen.is_object() || !seen.contains(row.name) || !seen[row.name].is_object()) return {};
    const json &known = seen[row.name];
    const json own = record_of(row);
    for (const auto &[key, value] : own.items()) {
        if (!known.contains(key) || known[key] != value) return {};
    }
    return known;
}

// The comparison of one signal after the other.
class walk {
  public:
    walk(const live_box &live, const register_map &map, const dialog &person,
         const position_options &options)
        : live_(live),
          person_(person),
          options_(options),
          signals_(map.signals()),
          positions_(positions_of(map)) {}

    json run() {
        json found = json::object();
        for (const auto *row : signals_) {
            if (!is_position(*row)) {
                confirm(*row);
                continue;
            }
            const json known = earlier(options_.seen_before, *row);
            found[row->name] = known.is_null() ? jogged(*row) : known;
        }
        return found;
    }

  private:
    // A position before its jog.
    struct jog {
        std::size_t which;
        places from;
        double least;
    };

    // in : the jog that precedes, or null. out: "" where register and display agree, else a
    // sentence
    std::string fault_of(const map_row &row, const std::optional<shown_value> &shown,
                         const jog *after) {
        std::string wrong = come_to_rest(row);
        const places now = places_of(positions_);
        if (wrong.empty() && after != nullptr) {
            wrong = others_fault(positions_, after->which, after->from, now, options_.together);
        }
        if (wrong.empty() && shown) wrong = display_fault(row, *shown, block(), start());
        if (wrong.empty() && after != nullptr) {
            wrong = way_fault(row, now[after->which] - after->from[after->which], after->least);
        }
        if (wrong.empty() && !row.in_range) {
            wrong = fmt::format("signals.{}: {:.7g} {} is outside of min and max", row.name,
                                row.value, row.unit);
        }
        return wrong;
    }

    // Returns when register and display agree. in: with a jog: what the person has to do
    void confirm(const map_row &row, const std::string &task = "", const jog *after = nullptr) {
        const auto stated = options_.shows.find(row.name);
        const std::size_t at = after == nullptr ? 0 : 1;
        const bool by_script = stated != options_.shows.end();
        for (;;) {
            std::optional<shown_value> shown;
            if (by_script)
                wait_for(row, *(shown = stated->second.at(at)));
            else
                shown = person_.ask(row, task);
            const std::string wrong = fault_of(row, shown, after);
            if (wrong.empty()) return;
            if (by_script) throw input_error(wrong + standstill(row, after));
            person_.again(wrong);
        }
    }

    // out: the end of a sentence about a script whose axis did not move; else ""
    std::string standstill(const map_row &row, const jog *after) const {
        if (after == nullptr || std::abs(row.value - after->from[after->which]) > standing)
            return "";
        return fmt::format("; or was it not jogged within {:.4g} s (--wait-s)?", options_.wait_s);
    }

    // Steps until the register agrees with the statement or the time for it is over.
    void wait_for(const map_row &row, const shown_value &shown) {
        const auto most = std::llround(options_.wait_s * 1e6 / live_.config().period_us);
        for (long long i = 0; i < most; ++i) {
            if (std::abs(row.value - shown.value) <= margin_of(row, shown)) return;
            person_.step();
        }
    }

    // out: "": the position is at rest; else a sentence
    std::string come_to_rest(const map_row &row) {
        if (!is_position(row)) return "";
        double was = row.value;
        for (int i = 0, calm = 0; i < patience_cycles; ++i) {
            person_.step();
            calm = std::abs(row.value - was) <= resting ? calm + 1 : 0;
            if (calm == 0) was = row.value;
            if (calm >= rest_cycles) return "";
        }
        return fmt::format("{} is moving; stop the axis before you compare", row.name);
    }

    // in : a position. out: its record, once the register agreed with the display before and after
    // a jog of its axis alone
    json jogged(const map_row &row) {
        const double least = least_jog(live_.config().signals[*row.signal]);
        const auto which = static_cast<std::size_t>(
            std::find(positions_.begin(), positions_.end(), &row) - positions_.begin());
        confirm(row);
        const jog after = {which, places_of(positions_), least};
        const std::string task =
            fmt::format("jog this axis alone by {:.4g} {} or more and stop", least, row.unit);
        if (options_.shows.count(row.name) > 0) person_.say("   " + row.name + ": " + task);
        confirm(row, task, &after);
        const double from = after.from[which];
        person_.say(fmt::format("   {}: {:.4f} to {:.4f} {}, as the control shows", row.name, from,
                                row.value, row.unit));
        json record = record_of(row);
        record["from"] = five_decimals(from);
        record["to"] = five_decimals(row.value);
        return record;
    }

    std::vector<std::uint16_t> block() const {
        const std::uint16_t *first = live_.registers();
        return {first, first + live_.config().plc.read.count};
    }
    unsigned start() const { return live_.config().plc.read.start; }

    const live_box &live_;
    const dialog &person_;
    const position_options &options_;
    std::vector<const map_row *> signals_, positions_;
};

}  // namespace

shown_value shown_as(double value, int decimals) {
    return {value, std::pow(10.0, -decimals)};
}

std::string display_fault(const map_row &row, const shown_value &shown,
                          const std::vector<std::uint16_t> &block, unsigned block_start) {
    if (std::abs(row.value - shown.value) <= margin_of(row, shown)) return "";
    return fmt::format(
        "signals.{}: the control shows {:.7g} {}, {} ({}) {:.7g}; {}", row.name, shown.value,
        row.unit, registers_of(row) + (cb_number_registers(row.type) == 1 ? " gives" : " give"),
        type_word(row.type), row.value, cause_of(row, shown, block, block_start));
}

double least_jog(const cb_signal_config &signal) {
    return std::min(10.0, 0.25 * (static_cast<double>(signal.max) - signal.min));
}

std::string others_fault(const std::vector<const map_row *> &positions, std::size_t which,
                         const places &from, const places &to, const stages &together) {
    const map_row &own = *positions[which];
    const double way = to[which] - from[which];
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const double other_way = to[i] - from[i];
        const bool paired = are_together(own.name, positions[i]->name, together);
        if (i == which || paired || std::abs(other_way) <= standing) continue;
        if (std::abs(way) <= standing) {
            return fmt::format(
                "signals.{0}: the jog moved {1} and {0} not at all; are their registers (plc) "
                "exchanged, or was the wrong axis jogged?",
                own.name, moved_text(*positions[i], other_way));
        }
        return fmt::format(
            "signals.{0}: the jog moved {1}, but also {2}; either both read one register (plc), or "
            "two "
            "axes were jogged. Two motors of one stage need --together {0}+{3}",
            own.name, moved_text(own, way), moved_text(*positions[i], other_way),
            positions[i]->name);
    }
    return "";
}

std::string way_fault(const map_row &row, double way, double least) {
    if (std::abs(way) >= least) return "";
    return fmt::format(
        "signals.{0}: {0} moved by {1:.4f} {2} where {3:.4g} or more are needed; if the control's "
        "display moved further, look at plc, type and scale",
        row.name, way, row.unit, least);
}

void check_ranges(const box_setup &setup, const std::vector<const map_row *> &signals) {
    const cb_config &config = *setup.config;
    for (const auto *row : signals) {
        const bool of_axis = std::any_of(
            config.channels, config.channels + config.channels_count,
            [&](const cb_channel_config &channel) { return row->name == channel.name; });
        if (of_axis && !is_position(*row)) {
            throw input_error(
                fmt::format("signals.{}.unit: the position of an axis is in mm or deg, not {}",
                            row->name, row->unit));
        }
        if (!is_position(*row)) continue;
        const cb_signal_config &signal = config.signals[*row->signal];
        const cb_range range = cb_number_range(row->type);
        const auto ends =
            std::minmax({range.min * row->scale + row->zero, range.max * row->scale + row->zero});
        const bool open = signal.max >= open_range && signal.min <= -open_range;
        const bool narrow = cb_number_registers(row->type) == 1;
        const double margin = 0.05 * (static_cast<double>(signal.max) - signal.min) + 10.0;
        if ((open && narrow) ||
            (!open && (ends.second < signal.max - margin || ends.first > signal.min + margin))) {
            throw input_error(
                fmt::format("signals.{}.type: {} with this scale reaches from {:.7g} to {:.7g} {} "
                            "only; min and "
                            "max of the signal {}",
                            row->name, type_word(row->type), ends.first, ends.second, row->unit,
                            open ? "must state the travel to compare it with" : "are beyond that"));
        }
    }
}

json check_positions(const live_box &live, const register_map &map, const dialog &person,
                     const position_options &options) {
    return walk(live, map, person, options).run();
}

}  // namespace compbox::commission
