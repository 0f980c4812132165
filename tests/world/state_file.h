// SPDX-License-Identifier: MIT
// The daemon's state file, read by its description alone (docs/compboxd.md), with a check sum by
// its definition.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace compbox::world {

// Header, records, probes, ending, CRC-32; numbers of the machine. Format 4 has probes, 3 has none.
struct state_file {
    struct header {
        char magic[8];
        std::uint32_t format, count;
        char machine_name[40], boot_id[40];
        std::uint32_t synchronised, probes;
    };
    struct record {
        char name[24], lag_of[24];
        std::int64_t unix_us, boottime_us;
        float hi, lo, input, tau_s;
        std::uint32_t power, range;  // of a bank: differs with the range in which its input acts
    };
    struct probe {
        char name[24], of[24];
        std::int64_t unix_us, boottime_us;
        float filter[18];
        std::uint8_t pending, waits;
        std::uint32_t taken, asked, refused, skipped, count;
    };
    struct ending {
        std::int64_t unix_us, boottime_us;
        std::uint32_t heartbeat, beat, stopped, unused;
    };
    bool synchronised = false;  // by what it says itself
    std::vector<record> records;
    struct ending end = {};
};

// out: nothing if it is not whole
std::optional<state_file> decoded(const std::string &bytes);

}  // namespace compbox::world
