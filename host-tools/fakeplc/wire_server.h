// SPDX-License-Identifier: MIT
// Interface of the PLC's servers: TCP (server.h) or a serial line (serial_server.h).
#pragma once

#include <poll.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/fault.h"

namespace compbox::fakeplc {

class wire_server {
  public:
    // in : a request's PDU and its fault. out: the reply's PDU
    using handler = std::function<byte_string(const byte_string &, bool torn)>;

    virtual ~wire_server() = default;

    // out: the address, as for --listen
    virtual std::string address() const = 0;
    virtual std::size_t clients() const = 0;
    // Appends its descriptors to `set`; process() takes the same entries.
    virtual void append_poll_set(std::vector<pollfd> &set) const = 0;
    // Reads, answers and sends due replies. Ignores entries of other files.
    virtual void process(const std::vector<pollfd> &set, std::int64_t now_us,
                         const handler &answer) = 0;
    // out: time of the next work without input; INT64_MAX: none
    virtual std::int64_t next_due_us() const = 0;

    virtual void close_all_clients() = 0;
    // Unreachable for this time: no listener, or an unplugged line.
    virtual void go_away(int duration_ms) = 0;
    virtual fault_plan &faults() = 0;
};

}  // namespace compbox::fakeplc
