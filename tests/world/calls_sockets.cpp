// SPDX-License-Identifier: MIT
// Sockets: TCP to the PLC, CAN, systemd's datagrams.
#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include <cstdlib>
#include <cstring>

#include "tests/world/calls.h"

namespace {

using namespace compbox::world;

struct found_address {
    addrinfo info;
    sockaddr_storage address;
};

// Keeps what a call on a TCP socket says of its connection.
ssize_t told(int fd, ssize_t result) {
    const auto file = here().descriptor(fd);
    if (file == nullptr || file->path != "tcp") return result;
    const bool again = result < 0 && (error_number() == EAGAIN || error_number() == EINTR);
    here().tcp_ended += result <= 0 && !again;
    return result;
}

}  // namespace

extern "C" {

int world_socket(int domain, int type, int) {
    if (here().begin("socket").error != 0) return -1;
    auto made = here().make_socket(domain, type);
    if (made == nullptr) return returned(-EAFNOSUPPORT);
    made->waits = (type & SOCK_NONBLOCK) == 0;
    return returned(here().add_descriptor(std::move(made)));
}

int world_bind(int fd, const sockaddr *address, socklen_t size) {
    call_fate fate;
    open_file *const file = begin_on(fd, "bind", &fate);
    return file == nullptr ? -1 : returned(file->bind(address, size));
}

int world_connect(int fd, const sockaddr *address, socklen_t size) {
    call_fate fate;
    open_file *const file = begin_on(fd, "connect", &fate);
    return file == nullptr ? -1 : returned(file->connect(address, size));
}

ssize_t world_recv(int fd, void *to, size_t count, int) {
    call_fate fate;
    open_file *const file = begin_on(fd, "recv", &fate);
    return told(fd, file == nullptr ? -1 : returned(file->receive(to, count)));
}

ssize_t world_recvmsg(int fd, msghdr *to, int) {
    call_fate fate;
    open_file *const file = begin_on(fd, "recvmsg", &fate);
    return file == nullptr ? -1 : returned(file->receive_message(to));
}

ssize_t world_send(int fd, const void *from, size_t count, int) {
    call_fate fate;
    open_file *const file = begin_on(fd, "send", &fate);
    const std::size_t wanted = count;
    if (fate.half && count > 1) count /= 2;
    const ssize_t sent = file == nullptr ? -1 : returned(file->send(from, count));
    const bool whole = sent == static_cast<ssize_t>(wanted);
    here().tcp_sent += whole && file->path == "tcp";
    // Without room for all of it, now or later, the box gives the connection up.
    return whole ? sent : (told(fd, 0), sent);
}

ssize_t world_sendto(int fd, const void *from, size_t count, int flags, const sockaddr *,
                     socklen_t) {
    return world_send(fd, from, count, flags);
}

int world_shutdown(int fd, int how) {
    call_fate fate;
    open_file *const file = begin_on(fd, "shutdown", &fate);
    return file == nullptr ? -1 : returned(file->shut_down(how));
}

int world_setsockopt(int fd, int level, int option, const void *value, socklen_t size) {
    call_fate fate;
    open_file *const file = begin_on(fd, "setsockopt", &fate);
    return file == nullptr ? -1 : returned(file->set_option(level, option, value, size));
}

int world_getsockopt(int fd, int level, int option, void *value, socklen_t *size) {
    call_fate fate;
    open_file *const file = begin_on(fd, "getsockopt", &fate);
    return file == nullptr ? -1 : returned(file->get_option(level, option, value, size));
}

// Numeric addresses alone, as the daemon asks for.
int world_getaddrinfo(const char *host, const char *service, const addrinfo *, addrinfo **found) {
    if (here().begin("getaddrinfo").error != 0) return EAI_MEMORY;
    auto *const made = static_cast<found_address *>(std::calloc(1, sizeof(found_address)));
    const auto port = htons(static_cast<std::uint16_t>(std::atoi(service)));
    auto &v4 = reinterpret_cast<sockaddr_in &>(made->address);
    auto &v6 = reinterpret_cast<sockaddr_in6 &>(made->address);
    if (inet_pton(AF_INET, host, &v4.sin_addr) == 1) {
        v4.sin_family = AF_INET;
        v4.sin_port = port;
        made->info.ai_addrlen = sizeof v4;
    } else if (inet_pton(AF_INET6, host, &v6.sin6_addr) == 1) {
        v6.sin6_family = AF_INET6;
        v6.sin6_port = port;
        made->info.ai_addrlen = sizeof v6;
    } else {
        std::free(made);
        return EAI_NONAME;
    }
    made->info.ai_family = made->address.ss_family;
    made->info.ai_addr = reinterpret_cast<sockaddr *>(&made->address);
    here().current_process().heap.insert(made);
    *found = &made->info;
    return 0;
}

void world_freeaddrinfo(addrinfo *found) {
    if (here().current_process().heap.erase(found) > 0) std::free(found);
}

unsigned world_if_nametoindex(const char *name) {
    if (here().begin("if_nametoindex", nullptr, name).error != 0) return 0;
    const unsigned index = here().interface_index(name);
    if (index == 0) error_number() = ENODEV;
    return index;
}
}
