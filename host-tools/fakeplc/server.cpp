// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/server.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <limits>

#include "host-tools/formats/error.h"

namespace compbox::fakeplc {

namespace {

constexpr std::size_t most_waiting_bytes = 65536;  // of a client that sends and never reads
constexpr std::size_t most_received_bytes = 8192;

struct endpoint {
    std::string host, port;
};

// out: host and port of "HOST:PORT"; both empty for another form
endpoint split(const std::string &address) {
    const auto colon = address.rfind(':');
    if (colon == std::string::npos || colon == 0) return {};
    std::string host = address.substr(0, colon);
    if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
    const std::string port = address.substr(colon + 1);
    const bool digits =
        std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
    if (!digits || port.empty() || port.size() > 5 || std::stoi(port) > 65535) return {};
    return {host, port};
}

// A listening socket, or -1 with errno set.
int listen_at(const addrinfo &info) {
    const int fd = ::socket(info.ai_family, info.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0) return -1;
    const int on = 1;
    ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (::bind(fd, info.ai_addr, info.ai_addrlen) == 0 && ::listen(fd, 16) == 0) return fd;
    const int reason = errno;
    ::close(fd);
    errno = reason;
    return -1;
}

// in : HOST:PORT; port 0: any free one
// out: a listening socket; throws input_error if the address is wrong or in use
int open_listener(const std::string &address) {
    const endpoint at = split(address);
    if (at.port.empty()) throw input_error(modbus_server::fault_in(address));
    addrinfo hints = {};
    hints.ai_socktype = SOCK_STREAM;
    hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
    addrinfo *list = nullptr;
    const int failed = ::getaddrinfo(at.host.c_str(), at.port.c_str(), &hints, &list);
    if (failed != 0) {
        throw input_error("cannot listen on '" + at.host + "' (" + ::gai_strerror(failed) + ")");
    }
    const int fd = listen_at(*list);
    const int reason = errno;
    ::freeaddrinfo(list);
    if (fd >= 0) return fd;
    if (reason == EADDRINUSE) {
        throw input_error(fmt::format(
            "port {} is in use: stop the other program or listen on another port", at.port));
    }
    throw input_error(fmt::format("cannot listen on {} ({})", address, std::strerror(reason)));
}

}  // namespace

std::string modbus_server::fault_in(const std::string &address) {
    return split(address).port.empty() ? "'" + address + "' is not HOST:PORT, as in 127.0.0.1:1502"
                                       : "";
}

modbus_server::modbus_server(const std::string &address, int max_clients)
    : listener_(open_listener(address)), max_clients_(max_clients) {}

modbus_server::~modbus_server() {
    close_all_clients();
    if (listener_ >= 0) ::close(listener_);
}

std::string modbus_server::address() const {
    sockaddr_storage bound = {};
    socklen_t size = sizeof bound;
    char host[NI_MAXHOST] = "", port[NI_MAXSERV] = "";
    ::getsockname(listener_, reinterpret_cast<sockaddr *>(&bound), &size);
    ::getnameinfo(reinterpret_cast<sockaddr *>(&bound), size, host, sizeof host, port, sizeof port,
                  NI_NUMERICHOST | NI_NUMERICSERV);
    const bool v6 = bound.ss_family == AF_INET6;
    return fmt::format("{}{}{}:{}", v6 ? "[" : "", host, v6 ? "]" : "", port);
}

void modbus_server::append_poll_set(std::vector<pollfd> &set) const {
    set.push_back({listener_, POLLIN, 0});
    for (const auto &who : clients_) set.push_back({who.fd, POLLIN, 0});
}

void modbus_server::process(const std::vector<pollfd> &set, std::int64_t now_us,
                            const handler &answer) {
    const auto ready = [&set](int fd) {
        return std::any_of(set.begin(), set.end(), [fd](const pollfd &entry) {
            return entry.fd == fd && entry.revents != 0;
        });
    };
    for (auto &who : clients_) {
        if (ready(who.fd)) {
            receive(who);
            answer_all(who, now_us, answer);
        }
        if (who.open) send_due(who, now_us);
    }
    drop_closed();  // before accepting: a client that reconnects finds its place free
    if (away_ms_ > 0) away_until_us_ = now_us + std::int64_t{away_ms_} * 1000;
    away_ms_ = 0;
    if (ready(listener_)) accept_waiting(now_us < away_until_us_);
}

std::int64_t modbus_server::next_due_us() const {
    std::int64_t due_us = std::numeric_limits<std::int64_t>::max();
    for (const auto &who : clients_) {
        if (!who.to_send.empty()) due_us = std::min(due_us, who.to_send.front().due_us);
    }
    return due_us;
}

void modbus_server::accept_waiting(bool turn_away) {
    for (;;) {
        const int fd = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
        if (fd < 0) return;
        if (turn_away || clients_.size() >= static_cast<std::size_t>(max_clients_)) {
            ::close(fd);
            continue;
        }
        const int on = 1;
        ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        client who;
        who.fd = fd;
        clients_.push_back(std::move(who));
    }
}

void modbus_server::receive(client &who) {
    std::uint8_t block[2048];
    while (who.received.size() < most_received_bytes) {
        const ssize_t n = ::recv(who.fd, block, sizeof block, 0);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
        if (n <= 0) {
            who.open = false;
            return;
        }
        who.received.insert(who.received.end(), block, block + n);
    }
}

void modbus_server::answer_all(client &who, std::int64_t now_us, const handler &answer) {
    while (who.open) {
        const auto frame = modbus::frame_at_start(who.received);
        if (frame.what == modbus::frame_state::incomplete) return;
        if (frame.what == modbus::frame_state::broken || who.waiting_bytes > most_waiting_bytes) {
            who.open = false;  // the beginning of the next frame is unknown
            return;
        }
        const auto end = who.received.begin() + static_cast<std::ptrdiff_t>(frame.size);
        answer_one(who, byte_string(who.received.begin(), end), now_us, answer);
        who.received.erase(who.received.begin(), end);
    }
}

void modbus_server::answer_one(client &who, const byte_string &frame, std::int64_t now_us,
                               const handler &answer) {
    const byte_string request(frame.begin() + modbus::header_size, frame.end());
    const auto fault = faults_.take(request[0]);
    const bool refuse = fault && fault->kind == fault_kind::exception;
    const bool torn = fault && fault->kind == fault_kind::torn;
    const byte_string reply =
        refuse ? modbus::exception_reply(request[0], static_cast<std::uint8_t>(fault->value))
               : answer(request, torn);
    for (auto &part : spoil(modbus::frame(frame, reply), fault)) {
        // Replies keep their order.
        const std::int64_t after_us = who.to_send.empty() ? now_us : who.to_send.back().due_us;
        const std::int64_t due_us = now_us + std::int64_t{part.delay_ms} * 1000;
        who.waiting_bytes += part.bytes.size();
        who.to_send.push_back({std::max(due_us, after_us), std::move(part.bytes)});
    }
}

void modbus_server::send_due(client &who, std::int64_t now_us) {
    while (!who.to_send.empty() && who.to_send.front().due_us <= now_us) {
        byte_string &bytes = who.to_send.front().bytes;
        const ssize_t n = ::send(who.fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            who.open = who.open && (errno == EAGAIN || errno == EWOULDBLOCK);
            return;
        }
        who.waiting_bytes -= static_cast<std::size_t>(n);
        bytes.erase(bytes.begin(), bytes.begin() + n);
        if (!bytes.empty()) return;
        who.to_send.pop_front();
    }
}

void modbus_server::drop_closed() {
    for (auto &who : clients_) {
        if (!who.open) ::close(who.fd);
    }
    clients_.erase(std::remove_if(clients_.begin(), clients_.end(),
                                  [](const client &who) { return !who.open; }),
                   clients_.end());
}

void modbus_server::go_away(int duration_ms) {
    close_all_clients();
    away_ms_ = duration_ms;
}

void modbus_server::close_all_clients() {
    for (auto &who : clients_) who.open = false;
    drop_closed();
}

}  // namespace compbox::fakeplc
