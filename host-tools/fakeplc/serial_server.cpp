// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/serial_server.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>

#include "host-tools/fakeplc/rtu.h"
#include "host-tools/formats/error.h"

namespace compbox::fakeplc {

namespace {

constexpr int bits_a_character = 11;
constexpr std::size_t lump = 8;            // characters per chunk of a driver
constexpr std::int64_t lost_us = 20000;    // silence that discards an incomplete request
constexpr std::int64_t again_us = 200000;  // between two attempts to connect
constexpr std::size_t longest_frame = 256;

std::string reason() {
    return std::strerror(errno);
}

sockaddr_un socket_address(const std::string &path) {
    sockaddr_un at = {};
    at.sun_family = AF_UNIX;
    path.copy(at.sun_path, sizeof at.sun_path - 1);
    return at;
}

int new_socket() {
    return ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
}

}  // namespace

bool serial_server::takes(const std::string &address) {
    return address.rfind("rtu:/", 0) == 0 || address.rfind("unix:/", 0) == 0;
}

serial_server::serial_server(const std::string &address, const serial_options &options)
    : address_(address), terminal_(address[0] == 'r'), options_(options) {
    path_ = address.substr(address.find(':') + 1);
    if (!terminal_ && path_.size() >= sizeof sockaddr_un{}.sun_path) {
        throw input_error("cannot listen on " + address + ": the path is too long for a socket");
    }
    plug_in(0);
    if (fd_ < 0 && listener_ < 0)
        throw input_error(fmt::format("cannot listen on {}: {}", address, reason()));
}

serial_server::~serial_server() {
    const bool listened = listener_ >= 0;
    unplug();
    if (listened) ::unlink(path_.c_str());
}

std::int64_t serial_server::characters_us(std::size_t count) const {
    if (options_.baud == 0) return 0;
    return static_cast<std::int64_t>(count) * bits_a_character * 1000000 / options_.baud;
}

std::int64_t serial_server::silence_us() const {
    if (options_.baud == 0) return 0;
    return options_.baud > 19200 ? 1750 : characters_us(7) / 2;
}

// Opens a pseudo-terminal; the box opens its other end through the link. Replaces a link, but no
// other file.
void serial_server::open_terminal() {
    struct stat there;
    if (::lstat(path_.c_str(), &there) == 0) {
        if (!S_ISLNK(there.st_mode)) {
            throw input_error(
                fmt::format("cannot listen on {}: {} exists and is not a link; use another path",
                            address_, path_));
        }
        ::unlink(path_.c_str());
    }
    fd_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0 || ::grantpt(fd_) != 0 || ::unlockpt(fd_) != 0) return;
    char name[64];
    if (::ptsname_r(fd_, name, sizeof name) != 0 || ::symlink(name, path_.c_str()) != 0) {
        ::close(fd_);
        fd_ = -1;
        return;
    }
    // Kept open, so that the line does not hang up while the box closes and reopens it.
    held_ = ::open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios raw = {};
    if (held_ < 0 || ::tcgetattr(held_, &raw) != 0) return;
    ::cfmakeraw(&raw);
    ::tcsetattr(held_, TCSANOW, &raw);
}

// Connects if a program (QEMU) listens there; else listens.
void serial_server::open_socket(std::int64_t now_us) {
    const sockaddr_un at = socket_address(path_);
    const auto *address = reinterpret_cast<const sockaddr *>(&at);
    const int fd = new_socket();
    if (::connect(fd, address, sizeof at) == 0) {
        fd_ = fd;
        return;
    }
    const bool left_over = errno == ECONNREFUSED;  // left over from an ended listener
    if (left_over) ::unlink(path_.c_str());
    if (::bind(fd, address, sizeof at) == 0 && ::listen(fd, 1) == 0) {
        listener_ = fd;
        return;
    }
    const int why = errno;
    ::close(fd);
    errno = why;
    back_us_ = now_us + again_us;
}

void serial_server::plug_in(std::int64_t now_us) {
    away_ = false;
    if (terminal_)
        open_terminal();
    else
        open_socket(now_us);
}

void serial_server::unplug() {
    if (terminal_ && fd_ >= 0) ::unlink(path_.c_str());
    for (int *fd : {&fd_, &held_, &listener_}) {
        if (*fd >= 0) ::close(*fd);
        *fd = -1;
    }
    received_.clear();
    to_send_.clear();
}

void serial_server::go_away(int duration_ms) {
    unplug();
    away_ = true;
    away_ms_ = duration_ms;
    back_us_ = 0;  // the next process() starts the time
}

void serial_server::append_poll_set(std::vector<pollfd> &set) const {
    if (fd_ >= 0) set.push_back({fd_, POLLIN, 0});
    if (fd_ < 0 && listener_ >= 0) set.push_back({listener_, POLLIN, 0});
}

std::int64_t serial_server::next_due_us() const {
    if (fd_ < 0 && listener_ < 0) return back_us_;
    if (!to_send_.empty()) return to_send_.front().due_us;
    return std::numeric_limits<std::int64_t>::max();
}

void serial_server::process(const std::vector<pollfd> &set, std::int64_t now_us,
                            const handler &answer) {
    process_units(set, now_us, [&](int unit, const byte_string &request, bool torn) {
        return unit_reply{unit == options_.unit ? answer(request, torn) : byte_string{}, 0};
    });
}

void serial_server::process_units(const std::vector<pollfd> &, std::int64_t now_us,
                                  const unit_handler &answer) {
    if (away_ && back_us_ == 0) back_us_ = now_us + std::int64_t{away_ms_} * 1000;
    if (fd_ < 0 && listener_ < 0 && now_us >= back_us_) plug_in(now_us);
    if (fd_ < 0 && listener_ >= 0) {
        fd_ = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    }
    if (fd_ < 0) return;
    receive(now_us);
    if (fd_ >= 0) answer_request(now_us, answer);
    if (fd_ >= 0) send_due(now_us);
}

// Reads all bytes that have arrived. A pause of lost_us discards an incomplete request; a closed
// socket is opened again after again_us.
void serial_server::receive(std::int64_t now_us) {
    std::uint8_t block[512];
    for (;;) {
        const ssize_t n = ::read(fd_, block, sizeof block);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0 && (errno == EAGAIN || errno == EIO)) return;
        if (n <= 0) {  // the peer of a socket is gone; a listener waits for the next
            ::close(fd_);
            fd_ = -1;
            received_.clear();
            to_send_.clear();
            back_us_ = now_us + again_us;
            return;
        }
        if (now_us - received_us_ > lost_us) received_.clear();
        received_.insert(received_.end(), block, block + n);
        received_us_ = now_us;
    }
}

// The counts of a request give its length. If the check sum is wrong, all received bytes are
// discarded, as by a slave that waits for the next silence.
void serial_server::answer_request(std::int64_t now_us, const unit_handler &answer) {
    const std::size_t size = rtu::request_size(received_);
    if (size == 0 || received_.size() < size) {
        if (received_.size() > longest_frame) received_.clear();
        return;
    }
    const byte_string frame(received_.begin(),
                            received_.begin() + static_cast<std::ptrdiff_t>(size));
    received_.clear();
    if (!rtu::is_frame(frame)) return;
    const byte_string request(frame.begin() + 1, frame.end() - 2);
    const int unit = frame[0];
    const auto fault = faults_.take(request[0]);
    const bool refuse = fault && fault->kind == fault_kind::exception;
    const bool torn = fault && fault->kind == fault_kind::torn;
    const unit_reply reply =
        refuse ? unit_reply{modbus::exception_reply(request[0],
                                                    static_cast<std::uint8_t>(fault->value)),
                            0}
               : answer(unit, request, torn);
    if (reply.pdu.empty()) return;
    const std::int64_t begin_us = now_us + characters_us(size) + silence_us() + options_.delay_us;
    for (auto &part : rtu::spoil(frame[0], reply.pdu, fault)) {
        const std::int64_t from_us = begin_us + std::int64_t{part.delay_ms} * 1000;
        // replies of one slave keep their order; a late reply of another module does not delay them
        if (reply.delay_ms > 0) {
            queue(part.bytes, from_us + std::int64_t{reply.delay_ms} * 1000);
        } else {
            end_us_ = queue(part.bytes, std::max(end_us_, from_us));
        }
    }
}

// Sends in chunks, each at the time of its last character. out: time of the last character
std::int64_t serial_server::queue(const byte_string &bytes, std::int64_t from_us) {
    for (std::size_t at = 0; at < bytes.size(); at += lump) {
        const std::size_t count = std::min(lump, bytes.size() - at);
        const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(at);
        from_us += characters_us(count);
        const pending one{from_us, {first, first + static_cast<std::ptrdiff_t>(count)}};
        const auto behind = std::upper_bound(
            to_send_.begin(), to_send_.end(), one.due_us,
            [](std::int64_t due_us, const pending &other) { return due_us < other.due_us; });
        to_send_.insert(behind, one);
    }
    return from_us;
}

void serial_server::send_due(std::int64_t now_us) {
    while (!to_send_.empty() && to_send_.front().due_us <= now_us) {
        const byte_string &bytes = to_send_.front().bytes;
        // bytes that the line does not accept are lost
        if (::write(fd_, bytes.data(), bytes.size()) < 0 && errno == EINTR) continue;
        to_send_.pop_front();
    }
}

}  // namespace compbox::fakeplc
