// SPDX-License-Identifier: MIT
// Modbus/TCP connections over poll(): never blocks, tolerates any client.
#pragma once

#include <poll.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/wire_server.h"

namespace compbox::fakeplc {

class modbus_server : public wire_server {
  public:
    // Listens on "HOST:PORT" or "[IPv6]:PORT"; port 0: any free one. Rejects clients beyond
    // max_clients. Throws input_error.
    modbus_server(const std::string &address, int max_clients);
    ~modbus_server() override;
    modbus_server(const modbus_server &) = delete;
    modbus_server &operator=(const modbus_server &) = delete;

    // out: what is wrong with the form of the address; "": nothing
    static std::string fault_in(const std::string &address);

    // out: the address in use, such as "127.0.0.1:1502"
    std::string address() const override;
    std::size_t clients() const override { return clients_.size(); }

    // Appends its descriptors to `set`; process() takes the same entries.
    void append_poll_set(std::vector<pollfd> &set) const override;
    // Accepts, reads, answers and sends due replies. Ignores entries of other files.
    void process(const std::vector<pollfd> &set, std::int64_t now_us,
                 const handler &answer) override;
    // out: time of the next delayed part; INT64_MAX: none
    std::int64_t next_due_us() const override;

    void close_all_clients() override;
    // Closes all connections and, for this time, every new one.
    void go_away(int duration_ms) override;
    fault_plan &faults() override { return faults_; }

  private:
    struct pending {
        std::int64_t due_us;
        byte_string bytes;
    };
    struct client {
        int fd;
        byte_string received;
        std::deque<pending> to_send;
        std::size_t waiting_bytes = 0;
        bool open = true;
    };

    void accept_waiting(bool turn_away);
    void receive(client &who);
    void answer_all(client &who, std::int64_t now_us, const handler &answer);
    void answer_one(client &who, const byte_string &frame, std::int64_t now_us,
                    const handler &answer);
    void send_due(client &who, std::int64_t now_us);
    void drop_closed();

    int listener_ = -1;
    int max_clients_;
    int away_ms_ = 0;  // requested, not begun
    std::int64_t away_until_us_ = 0;
    std::vector<client> clients_;
    fault_plan faults_;
};

}  // namespace compbox::fakeplc
