// SPDX-License-Identifier: MIT
#include "host-tools/commission/table.h"

#include <fmt/core.h>

#include <array>

#include "host-tools/command_line/screen.h"

extern "C" {
#include "firmware/box/box.h"
#include "firmware/wire/number.h"
}

namespace compbox::commission {

namespace {

using cli::padded;

constexpr std::size_t value_width = 18, seen_width = 26;

const char *mode_word(int mode) {
    switch (mode) {
#define CB_X(name, value, text) \
    case value:                 \
        return text;
        CB_MODES(CB_X)
#undef CB_X
        default:
            return "?";
    }
}

std::string bits_text(unsigned word) {
    constexpr std::array<const char *, 4> names = {"enable", "referenced", "reset", "permit"};
    std::string text;
    for (std::size_t bit = 0; bit < names.size(); ++bit) {
        if ((word >> bit & 1u) == 0) continue;
        text += (text.empty() ? "" : " ") + std::string(names[bit]);
    }
    return text.empty() ? "none set" : text;
}

int decimals_of(const map_row &row) {
    return is_position(row) ? 4 : row.unit == "um" ? 2 : row.unit.empty() ? 0 : 2;
}

std::string number_text(const map_row &row, double value) {
    return fmt::format("{:.{}f}", value, decimals_of(row));
}

std::string raw_text(const map_row &row) {
    std::string text;
    for (const std::uint16_t word : row.raw) text += fmt::format("{:04x} ", word);
    return text;
}

std::string seen_text(const map_row &row) {
    if (row.unit.empty() || row.written || !row.seen) return "";
    return number_text(row, row.low) + " … " + number_text(row, row.high);
}

// in : the row of the question, or null. out: its state in a word or two
std::string state_of(const map_row &row, const map_row *current) {
    if (!row.seen) return "no reading";
    if (!row.in_range) return "RANGE";
    if (!row.signal || current == nullptr) return "";
    if (row.signal == current->signal) return "compare";
    return *row.signal < *current->signal ? "agrees" : "";
}

std::string register_text(const map_row &row) {
    const bool two = cb_number_registers(row.type) == 2;
    return two ? fmt::format("{}-{}", row.address, row.address + 1) : std::to_string(row.address);
}

std::string headline(const live_box &live) {
    const double age_s = live.age_s();
    const std::string reply = age_s < 1.0 ? fmt::format("last reply {:.0f} ms ago", 1000.0 * age_s)
                                          : fmt::format("no reply for {:.0f} s", age_s);
    return fmt::format("{}, {}; box {}: {}", live.peer(), reply, mode_word(live.mode()),
                       cb_reason_text(static_cast<std::uint8_t>(live.reason())));
}

}  // namespace

std::string table_line(const live_box &live, const map_row &row, const map_row *current) {
    const bool pointed = current == &row;
    const std::string age = row.written ? "" : fmt::format("{:.0f} ms", 1000.0 * live.age_s());
    const std::string value = padded(value_text(row), value_width) + seen_text(row);
    return fmt::format("{} {}{}{}{}{}{}{}{}", pointed ? ">" : " ", padded(register_text(row), 9),
                       padded(type_word(row.type), 12), padded(row.name, 16),
                       padded(raw_text(row), 11), padded(value, value_width + seen_width),
                       padded(age, 8), padded(state_of(row, current), 11),
                       display_of(live.config(), row));
}

std::string value_text(const map_row &row) {
    if (!row.seen) return "-";
    const auto word = static_cast<unsigned>(row.raw.front());
    if (row.name == "control word") return bits_text(word);
    if (row.name == "status") return mode_word(static_cast<int>(word & 0xFFu));
    return number_text(row, row.value) + (row.unit.empty()   ? ""
                                          : row.unit == "um" ? " µm"
                                                             : " " + row.unit);
}

std::string display_of(const cb_config &config, const map_row &row) {
    struct displays {
        const char *position, *applied;
    };
    static constexpr std::array<displays, 3> known = {{
        {"machine position (MCS)", "offset that the PLC applies"},
        {"Machine > Act. values MCS", "Diagnosis > Axis > Service axis"},
        {"POS > ALL, MACHINE", "offset that the PMC applies"},
    }};
    static_assert(CB_PROFILE_GENERIC == 0 && CB_PROFILE_SINUMERIK_840D == 1 &&
                  CB_PROFILE_FANUC == 2);
    const displays &own = known.at(config.plc.profile);
    if (is_position(row)) return own.position;
    if (row.signal) return "its page, or an instrument";
    return row.unit.empty() || row.written ? "" : own.applied;
}

std::vector<std::string> table_lines(const live_box &live, const register_map &map,
                                     const map_row *current) {
    std::vector<std::string> lines = {
        headline(live),
        fmt::format("  {}{}{}{}{}{}{}{}{}", padded("register", 9), padded("type", 12),
                    padded("name", 16), padded("raw", 11), padded("value", value_width),
                    padded("seen", seen_width), padded("age", 8), padded("state", 11),
                    "the control shows it at")};
    bool written = false;
    for (const auto &row : map.rows()) {
        if (row.written && !written) lines.push_back("  from the box:");
        written = row.written;
        lines.push_back(table_line(live, row, current));
    }
    return lines;
}

}  // namespace compbox::commission
