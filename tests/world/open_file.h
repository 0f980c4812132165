// SPDX-License-Identifier: MIT
// What a descriptor of the box refers to: a file, a device, a socket or a line. Results are ≥ 0, or
// -errno. None of these calls waits: the calls of calls_*.cpp do, by ready() and
// computer::changed().
#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/types.h>

#include <cerrno>
#include <cstddef>
#include <string>

namespace compbox::world {

struct node;

class open_file {
  public:
    virtual ~open_file() = default;

    virtual long read(void *, std::size_t) { return -EINVAL; }
    virtual long write(const void *, std::size_t) { return -EINVAL; }
    // out: of POLLIN, POLLOUT, POLLERR, POLLHUP what is true now
    virtual short ready() const { return POLLIN | POLLOUT; }
    virtual int control(unsigned long /* request */, void * /* argument */) { return -ENOTTY; }
    virtual long seek(long, int) { return -ESPIPE; }
    virtual int truncate(long) { return -EINVAL; }
    virtual int sync() { return -EINVAL; }
    virtual int lock() { return 0; }
    // The last descriptor was closed; ended: by the end of the process.
    virtual void closed(bool /* ended */) {}

    // ---- sockets
    virtual int bind(const sockaddr *, socklen_t) { return -ENOTSOCK; }
    virtual int connect(const sockaddr *, socklen_t) { return -ENOTSOCK; }
    virtual long receive(void *, std::size_t) { return -ENOTSOCK; }
    virtual long receive_message(msghdr *) { return -ENOTSOCK; }
    virtual long send(const void *, std::size_t) { return -ENOTSOCK; }
    virtual int set_option(int, int, const void *, socklen_t) { return -ENOTSOCK; }
    virtual int get_option(int, int, void *, socklen_t *) { return -ENOTSOCK; }
    virtual int shut_down(int) { return -ENOTSOCK; }

    virtual const node *file() const { return nullptr; }  // for fstat
    std::string path;   // where it was opened; of a socket a name for messages
    bool waits = true;  // without O_NONBLOCK and SOCK_NONBLOCK
};

}  // namespace compbox::world
