// SPDX-License-Identifier: MIT
// The server side of Modbus as pure functions of bytes; whoever owns the wire calls them.
#pragma once

#include <cstdint>
#include <vector>

#include "host-tools/fakeplc/profile.h"

namespace compbox {

using byte_string = std::vector<std::uint8_t>;

namespace modbus {

enum exception : std::uint8_t { illegal_function = 1, illegal_address = 2, illegal_value = 3 };

constexpr std::size_t header_size = 7;  // MBAP: transaction, protocol, length, unit

// Holding registers, address 0 first.
struct bank {
    std::vector<std::uint16_t> now;
    // The registers before the PLC's last update: what a torn reading shows behind its middle.
    std::vector<std::uint16_t> before;
};

// What stands at the start of received bytes.
struct frame_state {
    enum { incomplete, complete, broken } what;
    std::size_t size;  // of the frame, when complete
};
frame_state frame_at_start(const byte_string &received);

// A request's PDU to the reply's PDU. Any bytes are allowed; lengths are checked before use.
// Checked in this order, as in the protocol's state diagrams: function (01), counts and lengths
// (03), addresses (02); nothing is written unless all are good. torn: a reading takes the half
// behind its middle from bank.before.
byte_string answer(const byte_string &request, const plc_profile &profile, bank &registers,
                   bool torn = false);

byte_string exception_reply(std::uint8_t function, std::uint8_t code);

// Does this request read, write (both for 23)?
bool reads(std::uint8_t function);
bool writes(std::uint8_t function);

// A whole frame from the header of its request and a reply PDU.
byte_string frame(const byte_string &request_frame, const byte_string &reply);

}  // namespace modbus
}  // namespace compbox
