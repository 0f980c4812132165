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

// systemd's end of NOTIFY_SOCKET.
std::shared_ptr<open_file> make_notify_socket(const listener &notified);

}  // namespace compbox::world
