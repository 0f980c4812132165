// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/fault.h"

namespace compbox::fakeplc {

namespace {

bool meets(const fault &what, std::uint8_t function) {
    const bool reads = modbus::reads(function);
    if (what.kind == fault_kind::torn || what.kind == fault_kind::too_short ||
        what.kind == fault_kind::too_long) {
        if (!reads) return false;
    }
    return (what.on_reads && what.on_writes) || (what.on_reads && reads) ||
           (what.on_writes && modbus::writes(function));
}

// out: the reply of a reading with one register more or fewer and matching lengths
byte_string resized(byte_string frame, int registers) {
    constexpr std::size_t byte_count_at = modbus::header_size + 1;
    const bool reading = frame.size() > byte_count_at + 2 && modbus::reads(frame[7]);
    if (!reading || frame[byte_count_at] + 2 * registers < 0) return frame;
    const int bytes = 2 * registers;
    frame.resize(frame.size() + static_cast<std::size_t>(bytes), 0);
    frame[byte_count_at] = static_cast<std::uint8_t>(frame[byte_count_at] + bytes);
    frame[5] = static_cast<std::uint8_t>(frame[5] + bytes);
    return frame;
}

std::vector<timed_bytes> byte_by_byte(const byte_string &frame, int every_ms) {
    std::vector<timed_bytes> parts;
    for (std::size_t i = 0; i < frame.size(); ++i) {
        parts.push_back({every_ms * static_cast<int>(i), {frame[i]}});
    }
    return parts;
}

}  // namespace

std::optional<fault> fault_plan::take(std::uint8_t function) {
    for (auto it = waiting_.begin(); it != waiting_.end(); ++it) {
        if (!meets(it->what, function)) continue;
        const fault taken = it->what;
        if (--it->count <= 0) waiting_.erase(it);
        return taken;
    }
    return std::nullopt;
}

std::vector<timed_bytes> spoil(const byte_string &frame, const std::optional<fault> &what) {
    if (!what) return {{0, frame}};
    switch (what->kind) {
        case fault_kind::late:
            return {{what->value, frame}};
        case fault_kind::drop:
            return {};
        case fault_kind::dribble:
            return byte_by_byte(frame, what->value);
        case fault_kind::truncate:
            return {{0, byte_string(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(
                                                                       frame.size() / 2))}};
        case fault_kind::too_short:
            return {{0, resized(frame, -1)}};
        case fault_kind::too_long:
            return {{0, resized(frame, 1)}};
        case fault_kind::wrong_id: {
            byte_string other = frame;
            other[1] = static_cast<std::uint8_t>(other[1] + 1);
            return {{0, other}};
        }
        case fault_kind::exception:
        case fault_kind::torn:
        case fault_kind::crc:  // TCP has neither
        case fault_kind::noise:
            break;
    }
    return {{0, frame}};
}

}  // namespace compbox::fakeplc
