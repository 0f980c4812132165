// SPDX-License-Identifier: MIT
// What the programs of all controls need to know of a file.
#pragma once

#include <fmt/core.h>

#include <optional>

#include "host-tools/export/plc_layout.h"
#include "host-tools/export/text.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

namespace compbox::exports {

struct program_channel {
    fakeplc::taken_channel own;
    double size_um;                       // the largest offset that the program takes over
    std::optional<std::size_t> position;  // the signal of its axis' position
};

// A touch probe whose cycle the program hands over.
struct program_probe {
    std::string axis, stem;              // X; probe_x, the name of its variables
    fakeplc::shown_signal value, count;  // signed integer; uint16 with scale 1
};

struct program_parts {
    const fakeplc::register_map &map;
    const json &file;
    std::string source;                          // the file's name, for comments
    std::vector<program_channel> channels;       // at least one, of one type of value and one scale
    std::vector<fakeplc::shown_signal> signals;  // each register once
    std::vector<laid_register> registers;
    std::vector<program_probe> probes;
    double watchdog_ms, slope_um_per_s, ramp_um_per_s;

    // The name of the register at an address that the file uses.
    const std::string &name_at(int address) const;
    // The probe whose value or count a signal is; null: of none.
    const program_probe *probe_of(const fakeplc::shown_signal &signal) const;
    // Throws input_error that names the file.
    template <typename... Values>
    [[noreturn]] void refuse(fmt::format_string<Values...> sentence, Values &&...values) const {
        throw input_error(map.file, 0, 0, fmt::format(sentence, std::forward<Values>(values)...));
    }
};

// A number as people and controls read it: 0.0001, 1e-09.
inline std::string plain_number(double value) {
    return fmt::format("{:.9g}", value);
}

// Throws input_error where the file has no number that the program needs.
program_parts parts_of(const fakeplc::register_map &map, const json &file,
                       const std::string &source);

std::string program_840d(const program_parts &parts);
std::string program_fanuc(const program_parts &parts, int pmc_base);
std::vector<output_file> program_linuxcnc(const program_parts &parts);

}  // namespace compbox::exports
