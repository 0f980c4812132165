// SPDX-License-Identifier: MIT
// The server side of Modbus RTU as pure functions of bytes, with code of its own.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host-tools/fakeplc/fault.h"
#include "host-tools/fakeplc/modbus.h"

namespace compbox::fakeplc::rtu {

// CRC-16 of Modbus, bit by bit.
std::uint16_t crc(const byte_string &bytes);

// Unit id, PDU and check sum as a frame.
byte_string frame(std::uint8_t unit, const byte_string &pdu);

// out: whether the bytes are a frame with the right check sum
bool is_frame(const byte_string &bytes);

// out: length of the request in bytes by its function and counts; 0: not known yet
std::size_t request_size(const byte_string &received);

// out: the bytes to send in place of the reply to a unit
std::vector<timed_bytes> spoil(std::uint8_t unit, byte_string pdu,
                               const std::optional<fault> &what);

}  // namespace compbox::fakeplc::rtu
