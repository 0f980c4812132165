// SPDX-License-Identifier: MIT
// The server side of Modbus as pure functions of bytes, without I/O.
#pragma once

#include <cstdint>
#include <vector>

#include "host-tools/fakeplc/profile.h"

namespace compbox::fakeplc {

using byte_string = std::vector<std::uint8_t>;

namespace modbus {

enum exception : std::uint8_t { illegal_function = 1, illegal_address = 2, illegal_value = 3 };

constexpr std::size_t header_size = 7;  // MBAP: transaction, protocol, length, unit

// Holding registers, address 0 first.
struct bank {
    std::vector<std::uint16_t> now;
    // The registers before the PLC's last update, for the second half of a torn reading.
    std::vector<std::uint16_t> before;
};

// out: the register in two bytes from `at` on, which have to be there
std::uint16_t word(const byte_string &bytes, std::size_t at);

// The frame at the start of received bytes.
struct frame_state {
    enum { incomplete, complete, broken } what;
    std::size_t size;  // of the frame, when complete
};
frame_state frame_at_start(const byte_string &received);

// in : a request's PDU, any bytes; torn: a reading takes its second half from bank.before
// out: the reply's PDU. Checks function (01), counts and lengths (03) and addresses (02) in this
// order, as in the protocol's state diagrams; writes only if all are valid.
byte_string answer(const byte_string &request, const plc_profile &profile, bank &registers,
                   bool torn = false);

byte_string exception_reply(std::uint8_t function, std::uint8_t code);

// out: whether the request reads, writes (both for 23)
bool reads(std::uint8_t function);
bool writes(std::uint8_t function);

// A whole frame from the header of its request and a reply PDU.
byte_string frame(const byte_string &request_frame, const byte_string &reply);

}  // namespace modbus
}  // namespace compbox::fakeplc
