// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/rtu.h"

namespace compbox::fakeplc::rtu {

namespace {

constexpr std::size_t shortest_frame = 4;

// A reading's reply with one register more or fewer.
byte_string resized(byte_string pdu, int registers) {
    const bool reading = pdu.size() >= 2 && modbus::reads(pdu[0]) && pdu[0] < 0x80;
    if (!reading || pdu[1] + 2 * registers < 0) return pdu;
    pdu.resize(static_cast<std::size_t>(static_cast<int>(pdu.size()) + 2 * registers), 0);
    pdu[1] = static_cast<std::uint8_t>(pdu[1] + 2 * registers);
    return pdu;
}

// Noise of an open line; it never equals the beginning of a request or reply.
byte_string noise(int count) {
    byte_string bytes;
    for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(0xF8 | i % 7));
    return bytes;
}

}  // namespace

std::uint16_t crc(const byte_string &bytes) {
    unsigned sum = 0xFFFF;
    for (const std::uint8_t byte : bytes) {
        sum ^= byte;
        for (int bit = 0; bit < 8; ++bit) sum = (sum & 1) != 0 ? (sum >> 1) ^ 0xA001 : sum >> 1;
    }
    return static_cast<std::uint16_t>(sum);
}

byte_string frame(std::uint8_t unit, const byte_string &pdu) {
    byte_string bytes(1, unit);
    bytes.reserve(pdu.size() + 3);
    for (const std::uint8_t byte : pdu) bytes.push_back(byte);
    const std::uint16_t sum = crc(bytes);
    bytes.push_back(static_cast<std::uint8_t>(sum & 0xFF));
    bytes.push_back(static_cast<std::uint8_t>(sum >> 8));
    return bytes;
}

bool is_frame(const byte_string &bytes) {
    if (bytes.size() < shortest_frame) return false;
    const byte_string body(bytes.begin(), bytes.end() - 2);
    return crc(body) == (bytes[bytes.size() - 2] | bytes[bytes.size() - 1] << 8);
}

std::size_t request_size(const byte_string &received) {
    if (received.size() < 2) return 0;
    switch (received[1]) {
        case 15:
        case 16:
            return received.size() < 7 ? 0 : 9 + std::size_t{received[6]};
        case 23:
            return received.size() < 11 ? 0 : 13 + std::size_t{received[10]};
        default:
            return 8;
    }
}

std::vector<timed_bytes> spoil(std::uint8_t unit, byte_string pdu,
                               const std::optional<fault> &what) {
    if (what && what->kind == fault_kind::too_short) pdu = resized(pdu, -1);
    if (what && what->kind == fault_kind::too_long) pdu = resized(pdu, 1);
    byte_string whole = frame(unit, pdu);
    if (!what) return {{0, whole}};
    switch (what->kind) {
        case fault_kind::late:
            return {{what->value, whole}};
        case fault_kind::drop:
            return {};
        case fault_kind::wrong_id:
            return {{0, frame(static_cast<std::uint8_t>(unit % 247 + 1), pdu)}};
        case fault_kind::truncate:
            whole.resize(whole.size() / 2);
            return {{0, whole}};
        case fault_kind::crc:
            whole.back() ^= 0x55;
            return {{0, whole}};
        case fault_kind::noise: {
            byte_string bytes = noise(what->value);
            bytes.insert(bytes.end(), whole.begin(), whole.end());
            return {{0, bytes}};
        }
        case fault_kind::dribble: {
            std::vector<timed_bytes> parts;
            for (const std::uint8_t byte : whole)
                parts.push_back({what->value * static_cast<int>(parts.size()), {byte}});
            return parts;
        }
        case fault_kind::exception:
        case fault_kind::torn:
        case fault_kind::too_short:
        case fault_kind::too_long:
            break;
    }
    return {{0, whole}};
}

}  // namespace compbox::fakeplc::rtu
