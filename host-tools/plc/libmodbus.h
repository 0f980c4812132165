// SPDX-License-Identifier: MIT
// Registers and bits of a Modbus server by libmodbus, over TCP or a serial line: a second opinion,
// which shares no line with the box's own client and codec. Calls block for the wire's timeout.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "host-tools/formats/error.h"

namespace compbox::plc {

// The way to a server: host and port, or a serial device.
struct wire {
    std::string host;  // address or name; "" on a serial line
    int port = 502;
    std::string device;  // "": TCP
    int baud = 19200;
    std::string parity = "even";  // even, odd, none
    int stop_bits = 1;
    bool rs485 = false;  // the driver switches the transmitter
    int unit = 1;
    int timeout_ms = 1000;  // to connect, and for each reply

    bool is_serial() const { return !device.empty(); }
    std::string name() const;  // "192.168.0.10:502", "/dev/ttyUSB0"
};

// The four tables of Modbus.
enum class table { holding, input, coil, discrete };

// The server replied with an exception: the request had no effect, and the connection is sound.
struct refusal : input_error {
    using input_error::input_error;
};

class client {
  public:
    // Connects. Throws input_error with cause and remedy.
    explicit client(const wire &to);
    ~client();
    client(const client &) = delete;

    // in : count >= 1, the end at most 65536. out: a word for each register, 0 or 1 for each bit;
    // more than one request may carry at once are read by several.
    // Throws refusal, or input_error after which this client is not usable any more.
    std::vector<std::uint16_t> read(table from, int start, int count);

    // in : a table that can be written, words as read() returns them; at most 123 registers or
    // 1968 bits, which one request writes (functions 16 and 15). Throws as read().
    void write(table to, int start, const std::vector<std::uint16_t> &words);

  private:
    struct inside;
    std::unique_ptr<inside> inside_;
};

}  // namespace compbox::plc
