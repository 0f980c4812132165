// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/modbus.h"

namespace compbox::fakeplc {
namespace modbus {

namespace {

constexpr std::size_t max_read = 125, max_write = 123, max_write_of_both = 121;
constexpr std::size_t max_pdu = 253;

void append_word(byte_string &bytes, std::size_t value) {
    bytes.push_back(static_cast<std::uint8_t>(value >> 8));
    bytes.push_back(static_cast<std::uint8_t>(value));
}

struct range {
    std::size_t start, count;
    bool inside(const bank &registers) const { return start + count <= registers.now.size(); }
};

// Function code, byte count, values.
byte_string read_reply(std::uint8_t function, const range &what, const bank &registers, bool torn) {
    byte_string reply = {function, static_cast<std::uint8_t>(2 * what.count)};
    for (std::size_t i = 0; i < what.count; ++i) {
        const bool old = torn && i >= what.count / 2 && what.start + i < registers.before.size();
        append_word(reply, (old ? registers.before : registers.now)[what.start + i]);
    }
    return reply;
}

void store(const byte_string &request, std::size_t values_at, const range &where, bank &registers) {
    for (std::size_t i = 0; i < where.count; ++i) {
        registers.now[where.start + i] = word(request, values_at + 2 * i);
    }
}

// 3 and 4: function, start, count.
byte_string read_registers(const byte_string &request, bank &registers, bool torn) {
    if (request.size() != 5) return exception_reply(request[0], illegal_value);
    const range what = {word(request, 1), word(request, 3)};
    if (what.count < 1 || what.count > max_read) return exception_reply(request[0], illegal_value);
    if (!what.inside(registers)) return exception_reply(request[0], illegal_address);
    return read_reply(request[0], what, registers, torn);
}

// 6: function, address, value; the reply repeats it.
byte_string write_one(const byte_string &request, bank &registers) {
    if (request.size() != 5) return exception_reply(request[0], illegal_value);
    const range where = {word(request, 1), 1};
    if (!where.inside(registers)) return exception_reply(request[0], illegal_address);
    store(request, 3, where, registers);
    return request;
}

// 16: function, start, count, byte count, values; the reply is the first five bytes.
byte_string write_registers(const byte_string &request, bank &registers) {
    if (request.size() < 6) return exception_reply(request[0], illegal_value);
    const range where = {word(request, 1), word(request, 3)};
    if (where.count < 1 || where.count > max_write || request[5] != 2 * where.count ||
        request.size() != 6 + 2 * where.count) {
        return exception_reply(request[0], illegal_value);
    }
    if (!where.inside(registers)) return exception_reply(request[0], illegal_address);
    store(request, 6, where, registers);
    return byte_string(request.begin(), request.begin() + 5);
}

// 23: function, read start and count, write start and count, byte count, values. Writes first.
byte_string write_and_read(const byte_string &request, bank &registers, bool torn) {
    if (request.size() < 10) return exception_reply(request[0], illegal_value);
    const range what = {word(request, 1), word(request, 3)};
    const range where = {word(request, 5), word(request, 7)};
    if (what.count < 1 || what.count > max_read || where.count < 1 ||
        where.count > max_write_of_both || request[9] != 2 * where.count ||
        request.size() != 10 + 2 * where.count) {
        return exception_reply(request[0], illegal_value);
    }
    if (!what.inside(registers) || !where.inside(registers)) {
        return exception_reply(request[0], illegal_address);
    }
    store(request, 10, where, registers);
    return read_reply(request[0], what, registers, torn);
}

}  // namespace

std::uint16_t word(const byte_string &bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

frame_state frame_at_start(const byte_string &received) {
    if (received.size() < header_size - 1) return {frame_state::incomplete, 0};
    const std::size_t length = word(received, 4);  // unit and PDU
    if (word(received, 2) != 0 || length < 2 || length > max_pdu + 1) {
        return {frame_state::broken, 0};
    }
    const std::size_t size = header_size - 1 + length;
    if (received.size() < size) return {frame_state::incomplete, 0};
    return {frame_state::complete, size};
}

byte_string exception_reply(std::uint8_t function, std::uint8_t code) {
    return {static_cast<std::uint8_t>(function | 0x80u), code};
}

bool reads(std::uint8_t function) {
    return function == 3 || function == 4 || function == 23;
}

bool writes(std::uint8_t function) {
    return function == 6 || function == 16 || function == 23;
}

byte_string answer(const byte_string &request, const plc_profile &profile, bank &registers,
                   bool torn) {
    if (request.empty()) return exception_reply(0, illegal_function);
    const std::uint8_t function = request[0];
    if (!profile.serves(function)) {
        return exception_reply(function,
                               profile.knows(function) ? illegal_address : illegal_function);
    }
    switch (function) {
        case 3:
        case 4:
            return read_registers(request, registers, torn);
        case 6:
            return write_one(request, registers);
        case 16:
            return write_registers(request, registers);
        case 23:
            return write_and_read(request, registers, torn);
        default:
            return exception_reply(function, illegal_function);
    }
}

byte_string frame(const byte_string &request_frame, const byte_string &reply) {
    byte_string bytes(request_frame.begin(), request_frame.begin() + 4);
    append_word(bytes, reply.size() + 1);
    bytes.push_back(request_frame[6]);
    bytes.insert(bytes.end(), reply.begin(), reply.end());
    return bytes;
}

}  // namespace modbus
}  // namespace compbox::fakeplc
