// SPDX-License-Identifier: MIT
// A TCP server of raw sockets whose handler misbehaves on purpose; frames are written by hand.
#pragma once

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/still_clock.h"

namespace raw_server {

using bytes = std::vector<uint8_t>;
using still_clock::sleep_ms;

// One accepted connection, as the handler of a test sees it.
struct peer {
    int fd;
    int number;  // 0 for the first connection
    std::atomic<int> &requests;

    // The next request, or empty when the client is gone.
    bytes request() const {
        bytes frame(6);
        still_clock::wait_readable(fd);
        if (recv(fd, frame.data(), 6, MSG_WAITALL) != 6) return {};
        const size_t rest = static_cast<size_t>(frame[4]) << 8 | frame[5];
        frame.resize(6 + rest);
        if (recv(fd, frame.data() + 6, rest, MSG_WAITALL) != static_cast<ssize_t>(rest)) return {};
        requests++;
        return frame;
    }
    void reply(const bytes &frame) const { send(fd, frame.data(), frame.size(), MSG_NOSIGNAL); }
    // Waits for one byte. out: 0 behind the end of the stream; negative: the connection is reset
    ssize_t byte() const {
        char byte;
        still_clock::wait_readable(fd);
        return recv(fd, &byte, 1, 0);
    }
    bool gone() const { return byte() <= 0; }
};

// A server whose every connection is handled by the test's function, one after the other.
class server {
  public:
    // in : handler: runs in the server's thread, until its connection is to be closed
    // Listens at once. Throws runtime_error where it cannot.
    explicit server(std::function<void(peer &)> handler, uint16_t port = 0)
        : handler_(std::move(handler)) {
        listening_ = socket(AF_INET, SOCK_STREAM, 0);
        const int on = 1;
        setsockopt(listening_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        address.sin_port = htons(port);
        socklen_t size = sizeof address;
        if (bind(listening_, reinterpret_cast<sockaddr *>(&address), size) != 0 ||
            listen(listening_, 8) != 0)
            throw std::runtime_error("cannot listen");
        getsockname(listening_, reinterpret_cast<sockaddr *>(&address), &size);
        port_ = ntohs(address.sin_port);
        still_clock::join();
        thread_ = std::thread([this] { serve(); });
    }
    ~server() {
        shutdown(listening_, SHUT_RDWR);
        {
            const std::lock_guard<std::mutex> guard(mutex_);
            closing_ = true;
            if (connection_ >= 0) shutdown(connection_, SHUT_RDWR);
        }
        still_clock::leave();  // time goes on for the handler
        thread_.join();
        still_clock::join();
        close(listening_);
    }
    uint16_t port() const { return port_; }
    int connections() const { return connections_; }
    int requests() const { return requests_; }

  private:
    // Accepts one connection after the other until the listener is shut down.
    void serve() {
        for (;;) {
            still_clock::wait_readable(listening_);
            const int fd = accept(listening_, nullptr, nullptr);
            if (fd < 0) return still_clock::leave();
            const int on = 1;
            setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
            still_clock::watch(fd);
            {
                const std::lock_guard<std::mutex> guard(mutex_);
                connection_ = fd;
                if (closing_) shutdown(fd, SHUT_RDWR);
            }
            peer p{fd, connections_++, requests_};
            handler_(p);
            const std::lock_guard<std::mutex> guard(mutex_);
            connection_ = -1;
            shutdown(fd, SHUT_WR);
            while (still_clock::is_on && still_clock::is_under_way(fd)) still_clock::real_pause();
            still_clock::unwatch(fd);
            close(fd);
        }
    }
    std::function<void(peer &)> handler_;
    int listening_ = -1, connection_ = -1;
    bool closing_ = false;
    uint16_t port_ = 0;
    std::atomic<int> connections_{0}, requests_{0};
    std::mutex mutex_;
    std::thread thread_;
};

// The reply to a read of two registers: id of the request, values v and v + 1.
inline bytes two_registers(const bytes &request, uint8_t v) {
    return {request[0], request[1], 0, 0, 0, 7, request[6], 3, 4, 0, v, 0, uint8_t(v + 1)};
}

inline bytes two_written(const bytes &request) {
    return {request[0], request[1], 0, 0, 0, 6, request[6], 16, 0, 100, 0, 2};
}

// Answers well, with the number of the request as value, until the client is gone.
inline void behave(peer &p) {
    for (bytes r = p.request(); !r.empty(); r = p.request())
        p.reply(two_registers(r, static_cast<uint8_t>(p.requests)));
}

}  // namespace raw_server
