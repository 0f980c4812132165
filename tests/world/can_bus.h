// SPDX-License-Identifier: MIT
// A CAN bus: its interface in the box's computer, and CANopen nodes with a thermometer each.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "tests/world/computer.h"
#include "tests/world/dice.h"

namespace compbox::world {

// A node sends its temperature in two frames, int16le, 0.1 °C, and heartbeats, once it is started
// by NMT or by itself.
struct can_node {
    // 0x180 + node and 0x280 + node in 11 or 29 bits, or 29 bits whose lowest 8 change (J1939).
    enum class id_format { bits_11, bits_29, any_source };

    // out: identifier of a value's frame; of any_source that of source 0
    canid_t value_id(bool other) const;
    // out: as the coefficient file names it
    std::string id_text(bool other) const;
    // out: whether a frame of this identifier is one of its values
    bool has_sent(canid_t id) const;

    int number = 1;
    id_format format = id_format::bits_11;
    // Other devices use its identifiers with the other number of bits, and request its values.
    bool has_double = false;
    bool starts_itself = true;
    time_ns every = 100 * ms;      // of its TPDO
    time_ns heartbeat = 200 * ms;  // 0: none
    double temperature_degC = 20;
    bool supervised = false;  // the box starts it, and watches whether it obeys
    bool watched = true;      // the box knows how often its heartbeats come; else it starts it
    bool operational = false, silent = false, deaf = false;  // deaf: no start reaches it
    // Heartbeats in which it waited for its start, since the box last sent one or could not.
    int waits = 0;
    int again = 0;  // starts while it ran, since it, the daemon or the bus began anew
    time_ns booted_ns = 0;
    time_ns started_ns = -never / 2;      // by the box, on the bus
    std::uint64_t starts = 0, boots = 0;  // since the daemon began
};

class can_bus {
  public:
    can_bus(computer &of, const std::vector<can_node> &nodes, std::uint64_t seed);

    enum class interface_state { up, down, gone };
    void set_interface(interface_state state);
    interface_state state() const { return state_; }
    time_ns changed_ns = 0;           // the state, last
    time_ns flooded_ns = -never / 2;  // when frames came that no queue holds
    time_ns on_the_bus_ns = 0;  // since then the controller of the box is; nobody hears it before
    time_ns full_until_ns = 0;  // nobody acknowledges what the box sends, and its queue is full
    // A frame on the bus, an error frame too: all sockets with a fitting filter get it.
    void put(const can_frame &frame);
    void reboot(std::size_t node);  // it boots and waits for its start again
    void reboot_all();
    std::vector<can_node> nodes;
    std::uint64_t lost = 0;       // frames that found a full queue of the box
    std::uint64_t lost_told = 0;  // those of them that it read of
    time_ns lost_told_ns = 0;     // the newest time
    // For tests, where given: the box bound a socket with these filters, or sent a frame.
    std::function<void(const std::vector<can_filter> &)> bound;
    std::function<void(const can_frame &)> sent;
    std::function<void(int node, double degC)> heard;  // by the box: a value of a node

    std::shared_ptr<open_file> make_socket();

  private:
    friend class can_socket;
    void send_values(std::size_t node);
    void send_heartbeats(std::size_t node);
    void sent_by_box(const can_frame &frame);
    bool is_ignored(const can_node &node) const;

    computer &of_;
    dice chance_;
    interface_state state_ = interface_state::up;
    std::vector<std::weak_ptr<class can_socket>> sockets_;
};

}  // namespace compbox::world
