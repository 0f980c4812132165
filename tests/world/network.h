// SPDX-License-Identifier: MIT
// TCP between the box and its peers. Bytes of one direction keep their order; how long each segment
// takes, and what becomes of it, is the fault injector's (link_faults). A peer lives in events.
#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "tests/world/computer.h"
#include "tests/world/dice.h"
#include "tests/world/scheduler.h"

namespace compbox::world {

class connection;
using connection_ptr = std::shared_ptr<connection>;

// A server. Its calls come in events.
class tcp_peer {
  public:
    virtual ~tcp_peer() = default;
    // out: false: the connection is refused by RST
    virtual bool accepted(const connection_ptr &from) = 0;
    virtual void received(const connection_ptr &from, const std::string &bytes, time_ns sent) = 0;
    // The box closed its side (reset: by RST).
    virtual void closed(const connection_ptr &from, bool reset) = 0;
};

// What happens to a segment or a connection attempt.
struct segment_fate {
    time_ns delay_ns = 0;    // beyond the usual latency
    bool lost = false;       // for ever: the connection stalls in this direction
    bool reset = false;      // the connection is reset instead
    std::size_t cut_at = 0;  // > 0: the rest comes as another segment, `rest_ns` later
    time_ns rest_ns = 0;
    int flips_bit = -1;  // ≥ 0: of its first bytes
};

class link_faults {
  public:
    virtual ~link_faults() = default;
    virtual segment_fate at_segment(bool to_box, std::size_t bytes) = 0;
    virtual segment_fate at_connect() = 0;
};

class network {
  public:
    network(computer &box, std::uint64_t seed);

    // nullptr: nobody listens there
    void listen(std::uint16_t port, tcp_peer *peer) { listeners_[port] = peer; }
    tcp_peer *listener(std::uint16_t port) const;
    time_ns latency() { return chance_.time_between(50 * us, 250 * us); }

    computer &box;
    link_faults *faults = nullptr;
    // How long bytes that were sent at this time may wait in the peer, once the box has reset their
    // connection: longer ones are dropped (docs/decisions/0003). Empty: for any time.
    std::function<time_ns(time_ns sent)> longest_wait;
    // Called when a part of a reply has come, and its rest comes so much later.
    std::function<void(time_ns rest)> torn;
    // Connections of the box that are up or on their way, and since when there is none.
    int open = 0;
    time_ns closed_ns = 0;
    std::uint64_t attempts = 0;  // to connect
    // Since then a connection is up on which the box has sent nothing yet; never: there is none.
    time_ns unasked_ns = never;
    std::uint64_t closed_unasked = 0;  // by the box, while the peer had it open
    // false: no packet passes in either direction (an unplugged cable)
    bool plugged = true;
    // How long a peer takes to accept a connection, beyond the way there and back.
    time_ns accepts_after = 0;

  private:
    dice chance_;
    std::map<std::uint16_t, tcp_peer *> listeners_;
};

// Both ends of a connection. The peer uses send, finish and reset.
class connection : public std::enable_shared_from_this<connection> {
  public:
    explicit connection(network &of) : of_(of) {}

    // ---- for the peer
    void send(const std::string &bytes, time_ns after = 0);
    void finish();  // FIN
    void reset();   // RST
    bool open_at_peer = false;
    int number = 0;  // the peer's own

    // ---- for the box's socket
    void connect(std::uint16_t port);
    long take(void *to, std::size_t count);
    long give(const void *from, std::size_t count);
    void shut_down();
    void close(bool discard);
    enum class phase { idle, connecting, up, over } state = phase::idle;
    int error = 0;  // pending
    bool readable() const { return !inbox_.empty() || fin_ || error != 0; }

  private:
    void answer_attempt(std::uint16_t port);
    void count(bool open);
    void fail(int error_number);
    void deliver(const std::string &bytes);
    bool is_dropped(time_ns sent) const;
    void put_on_wire(bool to_box, const std::string &bytes, time_ns after);
    void after_all(bool to_box, const std::function<void(connection &)> &what);

    network &of_;
    tcp_peer *peer_ = nullptr;
    std::string inbox_;
    bool given_ = false, fin_ = false, shut_ = false, gone_ = false, discards_ = false,
         counted_ = false;
    time_ns last_due_[2] = {0, 0};  // of the newest segment to the peer, to the box
    bool stalled_[2] = {false, false};
};

std::shared_ptr<open_file> make_tcp_socket(network &of);

}  // namespace compbox::world
