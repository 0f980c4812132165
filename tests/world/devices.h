// SPDX-License-Identifier: MIT
// Devices and pseudo-files of the box's computer: the terminal, the watchdog, the latency of
// wake-ups, the boot id, systemd's socket.
#pragma once

#include <functional>
#include <memory>

#include "tests/world/open_file.h"

namespace compbox::world {

class computer;

std::shared_ptr<open_file> make_terminal(computer &of, int fd);
// A datagram socket: to systemd, or to ask whether the CAN interface is up.
std::shared_ptr<open_file> make_notify_socket(computer &of, std::function<bool()> can_is_up);

// Makes /dev/watchdog, /dev/cpu_dma_latency, /proc/sys/kernel/random/boot_id and /dev/null.
void add_system_devices(computer &of);

}  // namespace compbox::world
