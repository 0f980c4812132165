// SPDX-License-Identifier: MIT
// Modbus RTU on a serial line: a pseudo-terminal (rtu:/path/to/link) or a unix socket (unix:/path),
// which QEMU's -serial connects to or listens at. Bytes take the time of a baud rate.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "host-tools/fakeplc/wire_server.h"

namespace compbox::fakeplc {

struct serial_options {
    int unit = 1;       // own unit id; a handler with units answers other ids too
    int baud = 115200;  // 11 bits a character; 0: bytes take no time
    int delay_us = 0;   // from a request to its reply, beyond 3.5 characters
};

// A unit's reply; empty PDU: unknown unit id.
struct unit_reply {
    byte_string pdu;
    int delay_ms = 0;
};

class serial_server : public wire_server {
  public:
    // A unit id and a request's PDU to the reply.
    using unit_handler = std::function<unit_reply(int unit, const byte_string &, bool torn)>;

    // Throws input_error.
    serial_server(const std::string &address, const serial_options &options);
    ~serial_server() override;
    serial_server(const serial_server &) = delete;
    serial_server &operator=(const serial_server &) = delete;

    // out: whether the address has a form of this server, "rtu:…" or "unix:…"
    static bool takes(const std::string &address);

    std::string address() const override { return address_; }
    std::size_t clients() const override { return fd_ >= 0 ? 1 : 0; }
    void append_poll_set(std::vector<pollfd> &set) const override;
    void process(const std::vector<pollfd> &set, std::int64_t now_us,
                 const handler &answer) override;
    void process_units(const std::vector<pollfd> &set, std::int64_t now_us,
                       const unit_handler &answer);
    std::int64_t next_due_us() const override;
    void close_all_clients() override { go_away(1); }
    void go_away(int duration_ms) override;
    fault_plan &faults() override { return faults_; }

  private:
    struct pending {
        std::int64_t due_us;
        byte_string bytes;
    };
    std::int64_t characters_us(std::size_t count) const;
    std::int64_t silence_us() const;
    void plug_in(std::int64_t now_us);
    void unplug();
    void open_terminal();
    void open_socket(std::int64_t now_us);
    void receive(std::int64_t now_us);
    void answer_request(std::int64_t now_us, const unit_handler &answer);
    std::int64_t queue(const byte_string &bytes, std::int64_t from_us);
    void send_due(std::int64_t now_us);

    std::string address_, path_;
    bool terminal_;
    serial_options options_;
    int fd_ = -1, listener_ = -1, held_ = -1;  // held_: keeps the terminal's other end open
    bool away_ = false;
    int away_ms_ = 0;
    std::int64_t back_us_ = 0;  // time of the next attempt while there is no line
    byte_string received_;
    std::int64_t received_us_ = 0;  // time of the last byte
    std::int64_t end_us_ = 0;       // time of the last queued byte
    std::deque<pending> to_send_;
    fault_plan faults_;
};

}  // namespace compbox::fakeplc
