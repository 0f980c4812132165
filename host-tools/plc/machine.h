// SPDX-License-Identifier: MIT
// The wire to the PLC and the named registers of a machine or coefficient file.
#pragma once

#include <string>
#include <vector>

#include "host-tools/plc/items.h"

namespace compbox::plc {

// in : the text that names a server: HOST, HOST:PORT, [IPv6]:PORT, or a device
// out: its wire. Throws input_error for a port that is none.
wire parse_wire(const std::string &text);

// out: whether the text names a file and no server
bool is_file(const std::string &text);

// Reads the PLC's part of the file alone. Throws input_error with file and key.
class machine {
  public:
    explicit machine(const std::string &path);

    // plc.transport.
    const wire &to_plc() const { return to_plc_; }

    // By address: control, plc_heartbeat, status, box_heartbeat, detail, handshake; each signal of
    // the PLC by its name; of channel X value_X, applied_X, slope_X, reference_X.
    const std::vector<item> &items() const { return items_; }

    // Throws input_error, which lists the names, for an unknown one.
    const item &named(const std::string &name) const;

  private:
    std::string path_;
    wire to_plc_;
    std::vector<item> items_;
};

}  // namespace compbox::plc
