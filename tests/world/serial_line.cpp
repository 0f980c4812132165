// SPDX-License-Identifier: MIT
#include "tests/world/serial_line.h"

#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "host-tools/fakeplc/rtu.h"

namespace compbox::world {

namespace {

constexpr time_ns lump = 3 * ms;        // the driver hands bytes over at least this often
constexpr time_ns forgotten = 20 * ms;  // silence after which a slave drops half a request

long baud_of(speed_t speed) {
    switch (speed) {
        case B9600:
            return 9600;
        case B38400:
            return 38400;
        case B57600:
            return 57600;
        case B115200:
            return 115200;
        case B230400:
            return 230400;
        case B460800:
            return 460800;
        case B921600:
            return 921600;
        default:
            return 19200;
    }
}

}  // namespace

// An open device.
class line_file : public open_file {
  public:
    explicit line_file(serial_line &of) : of_(of), plug_(of.plugs_) {}

    long read(void *to, std::size_t count) override {
        if (dead()) return 0;
        if (of_.inbox_.empty()) return -EAGAIN;
        count = std::min(count, of_.inbox_.size());
        std::memcpy(to, of_.inbox_.data(), count);
        of_.inbox_.erase(0, count);
        return static_cast<long>(count);
    }
    long write(const void *from, std::size_t count) override {
        if (dead()) return -EIO;
        const auto *bytes = static_cast<const std::uint8_t *>(from);
        of_.transmit(fakeplc::byte_string(bytes, bytes + count));
        return static_cast<long>(count);
    }
    short ready() const override {
        if (dead()) return POLLIN | POLLERR | POLLHUP;
        return static_cast<short>(of_.inbox_.empty() ? POLLOUT : POLLIN | POLLOUT);
    }
    int control(unsigned long request, void *argument) override {
        if (dead()) return -EIO;
        if (request == TCGETS) *static_cast<termios *>(argument) = settings_;
        if (request == TCSETS) {
            settings_ = *static_cast<const termios *>(argument);
            of_.baud_ = baud_of(cfgetospeed(&settings_));
        }
        if (request == TCFLSH) of_.inbox_.clear();
        const bool known = request == TCGETS || request == TCSETS || request == TCFLSH ||
                           request == static_cast<unsigned long>(TIOCEXCL);
        return known ? 0 : -ENOTTY;
    }

    int lock() override {
        const bool taken = of_.of_.time.now() < of_.taken_until_ns;
        of_.refused += taken;
        return taken ? -EWOULDBLOCK : 0;
    }

  private:
    bool dead() const { return !of_.plugged_ || plug_ != of_.plugs_; }
    serial_line &of_;
    std::uint64_t plug_;
    termios settings_ = {};
};

serial_line::serial_line(computer &of, const std::string &device, std::uint64_t seed)
    : of_(of), chance_(seed, device) {
    of.files.make_device(device, [this]() -> std::shared_ptr<open_file> {
        refused += !plugged_;
        if (!plugged_) return nullptr;
        busy_ns_ = std::max(busy_ns_, of_.time.now());  // what came before, nobody knows
        return std::make_shared<line_file>(*this);
    });
}

void serial_line::plug(bool in) {
    plugged_ = in;
    plugged_ns = of_.time.now();
    ++plugs_;
    inbox_.clear();
    newest_ = {};
    of_.changed();
}

// Of the bits that flip one in four is of the last byte, the upper one of the check sum.
fakeplc::byte_string serial_line::spoilt(fakeplc::byte_string bytes, const line_fate &fate,
                                         std::size_t *flipped) {
    *flipped = std::string::npos;
    if (fate.lost) bytes.clear();
    if (!fate.flipped || bytes.empty()) return bytes;
    *flipped = chance_.one_in(4) ? bytes.size() - 1 : chance_.below(bytes.size());
    bytes[*flipped] ^= static_cast<std::uint8_t>(1u << chance_.below(8));
    return bytes;
}

// From the box: slaves hear it when the last byte ended. A line keeps the order of its bytes, so a
// late frame also delays those behind it.
void serial_line::transmit(const fakeplc::byte_string &bytes) {
    const line_fate fate = faults == nullptr ? line_fate{} : faults->at_line(false);
    std::size_t flipped = 0;
    const fakeplc::byte_string on_wire = spoilt(bytes, fate, &flipped);
    // A byte that the box has not read may come while it sends.
    if (asks) asks(newest_, bytes, inbox_.empty() ? of_.time.now() - busy_ns_ : never);
    busy_ns_ = of_.time.now() + static_cast<time_ns>(bytes.size()) * character() * 10 / 11;
    // One that has come, and that the box has not read, may be taken for that of a same one.
    const bool waits = newest_.settled && newest_.frame == bytes && !inbox_.empty();
    if (newest_.frame != bytes) alike_since_ns_ = of_.time.now();
    newest_ = {bytes, of_.time.now(), fate.delay_ns == 0 && free_ns_[0] <= of_.time.now(), waits};
    of_.hash.add(on_wire.data(), on_wire.size());
    of_.hash.add(of_.time.now());
    time_ns &free = free_ns_[0];
    free = std::max(free, of_.time.now()) + static_cast<time_ns>(bytes.size()) * character() +
           fate.delay_ns;
    of_.time.at(free, [this, on_wire, sent = of_.time.now(), plug = plugs_] {
        if (plugged_ && plug == plugs_ && heard) heard(on_wire, sent);
    });
}

void serial_line::send(const fakeplc::byte_string &bytes, time_ns after,
                       const fakeplc::byte_string &request, time_ns sent) {
    const line_fate fate = faults == nullptr ? line_fate{} : faults->at_line(true);
    std::size_t flipped = 0;
    const fakeplc::byte_string on_wire = spoilt(bytes, fate, &flipped);
    const time_ns begin = std::max(free_ns_[1], of_.time.now() + after);
    if (fate.torn) {
        const auto half = on_wire.begin() + static_cast<std::ptrdiff_t>(on_wire.size() / 2);
        deliver(fakeplc::byte_string(on_wire.begin(), half), begin);
        deliver(fakeplc::byte_string(half, on_wire.end()), free_ns_[1] + fate.delay_ns);
    } else {
        deliver(on_wire, begin + fate.delay_ns);
    }
    if (on_wire.empty()) return;
    const bool on_time = !fate.torn && fate.delay_ns == 0;
    of_.time.at(free_ns_[1], [this, bytes, flipped, request, sent, on_time, plug = plugs_] {
        if (!plugged_ || plug != plugs_) return;
        // A probe may be one of several of the same kind, that follow each other.
        if (newest_.frame == request && sent >= alike_since_ns_) settle(bytes, flipped, on_time);
    });
}

// The last byte of a reply has come.
void serial_line::settle(const fakeplc::byte_string &reply, std::size_t flipped, bool on_time) {
    constexpr time_ns earliest_deadline = 10 * ms;  // of the machines that are drawn
    const bool exception = (reply[1] & 0x80) != 0;
    const std::size_t head = exception ? 2 : reply[1] == 16 ? 6 : 3;
    newest_.settled = newest_.settled || flipped >= head;
    newest_.refused = newest_.refused || exception;
    const bool in_time =
        on_time && newest_.on_time && of_.time.now() - newest_.sent < earliest_deadline;
    newest_.prompt = newest_.prompt || (in_time && flipped == std::string::npos);
    newest_.damaged = in_time && flipped != std::string::npos && flipped >= head;
}

// To the box: the driver hands it over in lumps.
void serial_line::deliver(const fakeplc::byte_string &bytes, time_ns from) {
    const auto most = static_cast<std::size_t>(std::max<time_ns>(lump / character(), 1));
    for (std::size_t at = 0; at < bytes.size(); at += most) {
        const std::size_t count = std::min(most, bytes.size() - at);
        const std::string part(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                               bytes.begin() + static_cast<std::ptrdiff_t>(at + count));
        from += static_cast<time_ns>(count) * character();
        of_.time.at(from, [this, part, plug = plugs_] {
            if (!plugged_ || plug != plugs_) return;
            inbox_ += part;
            newest_.heard = true;
            busy_ns_ = std::max(busy_ns_, of_.time.now());
            of_.hash.add(part);
            of_.changed();
        });
    }
    free_ns_[1] = std::max(free_ns_[1], from);
}

// ---- slaves

rtu_slaves::rtu_slaves(serial_line &line, scheduler &time, handler answer)
    : line_(line), time_(time), answer_(std::move(answer)) {
    line.heard = [this](const fakeplc::byte_string &bytes, time_ns sent) { hear(bytes, sent); };
}

void rtu_slaves::hear(const fakeplc::byte_string &bytes, time_ns sent) {
    if (time_.now() - received_ns_ > forgotten) received_.clear();
    received_ns_ = time_.now();
    received_.insert(received_.end(), bytes.begin(), bytes.end());
    const std::size_t size = fakeplc::rtu::request_size(received_);
    if (size == 0 || received_.size() < size) return;
    const fakeplc::byte_string frame = std::exchange(received_, {});
    if (frame.size() != size || !fakeplc::rtu::is_frame(frame)) return;
    const int unit = frame[0];
    const reply answered =
        answer_(unit, fakeplc::byte_string(frame.begin() + 1, frame.end() - 2), sent);
    if (answered.pdu.empty()) return;
    line_.send(
        fakeplc::rtu::frame(static_cast<std::uint8_t>(unit + answered.units_off), answered.pdu),
        std::max(7 * line_.character() / 2, 1750 * us) + answered.delay_ns,
        answered.is_wrong ? fakeplc::byte_string{} : frame, sent);
}

}  // namespace compbox::world
