// SPDX-License-Identifier: MIT
// The CAN interfaces of the box's computer, each a can_bus without nodes: the test is the nodes.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "tests/world/can_bus.h"
#include "tests/world/computer.h"

namespace compbox::world {

class can_interfaces {
  public:
    explicit can_interfaces(computer &of);

    // The box bound a socket with these filters, or sent a frame.
    std::function<void(const std::string &name, const std::vector<can_filter> &)> bound;
    std::function<void(const std::string &name, const can_frame &)> sent;

    void set(const std::string &name, can_bus::interface_state state);
    bool is_up(const std::string &name) const;
    void put(const std::string &name, const can_frame &frame);

    // A socket that belongs to no interface until it is bound.
    std::shared_ptr<open_file> make_socket();
    can_bus *with_index(int index);                    // nullptr: none
    unsigned index_of(const std::string &name) const;  // 0: none

  private:
    computer &of_;
    std::map<std::string, std::unique_ptr<can_bus>> buses_;  // an index is the place here, from 1
};

}  // namespace compbox::world
