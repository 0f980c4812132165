// SPDX-License-Identifier: MIT
// What the PLC is reached through, whatever the wire: TCP (server.h) or a serial line
// (serial_server.h).
#pragma once

#include <poll.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/fault.h"

namespace compbox {

class wire_server {
  public:
    // A request's PDU, and the fault that it meets, to the reply's PDU.
    using handler = std::function<byte_string(const byte_string &, bool torn)>;

    virtual ~wire_server() = default;

    // Where it is reached, as for --listen.
    virtual std::string address() const = 0;
    virtual std::size_t clients() const = 0;
    // What to poll for, appended to `set`; process() takes the same entries back.
    virtual void append_poll_set(std::vector<pollfd> &set) const = 0;
    // Reads, answers and sends what is due. Entries of other files are ignored.
    virtual void process(const std::vector<pollfd> &set, std::int64_t now_us,
                         const handler &answer) = 0;
    // When something is to be done without anything coming; INT64_MAX: nothing is.
    virtual std::int64_t next_due_us() const = 0;

    virtual void close_all_clients() = 0;
    // Not to be reached for so long: nobody listens, or the line is unplugged.
    virtual void go_away(int duration_ms) = 0;
    virtual fault_plan &faults() = 0;
};

}  // namespace compbox
