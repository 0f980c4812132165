// SPDX-License-Identifier: MIT
// Devices that tell the test what the daemon writes to them.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "tests/world/open_file.h"

namespace compbox::world {

using listener = std::function<void(const std::string &bytes)>;

// A hardware watchdog; it takes timeouts up to most_s, and has that one at first.
std::shared_ptr<open_file> make_watchdog(int most_s, const listener &written);

// systemd's end of NOTIFY_SOCKET; any such socket answers whether a network interface is up.
std::shared_ptr<open_file> make_supervisor(const listener &notified,
                                           const std::function<bool(const std::string &)> &is_up);

}  // namespace compbox::world
