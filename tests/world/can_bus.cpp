// SPDX-License-Identifier: MIT
#include "tests/world/can_bus.h"

#include <fmt/core.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace compbox::world {

namespace {

constexpr std::size_t queue_frames = 500;
constexpr canid_t source_bits = 0xFF;

}  // namespace

canid_t can_node::value_id(bool other) const {
    const auto first = static_cast<canid_t>(0x180 + number);
    const canid_t id = other ? first ^ 0x300 : first;
    switch (format) {
        case id_format::bits_11:
            return id;
        case id_format::bits_29:
            return CAN_EFF_FLAG | id;
        default:
            return CAN_EFF_FLAG | 0x18F00000 | id << 8;
    }
}

std::string can_node::id_text(bool other) const {
    const canid_t id = value_id(other) & CAN_EFF_MASK;
    switch (format) {
        case id_format::bits_11:
            return fmt::format("{:#x}", id);
        case id_format::bits_29:
            return fmt::format("{:#010x}", id);
        default:
            return fmt::format("{:#x}xx", id >> 8);
    }
}

bool can_node::has_sent(canid_t id) const {
    const canid_t known = format == id_format::any_source ? id & ~source_bits : id;
    return known == value_id(false) || known == value_id(true);
}

class can_socket : public open_file {
  public:
    explicit can_socket(can_bus &of) : of_(of) { path = "can"; }

    int bind(const sockaddr *, socklen_t) override {
        if (of_.state_ == can_bus::interface_state::gone) return -ENODEV;
        bound_ = true;
        if (of_.bound) of_.bound(filters_);
        if (of_.state_ == can_bus::interface_state::down) fail(ENETDOWN);
        return 0;
    }
    int set_option(int level, int option, const void *value, socklen_t size) override {
        if (level != SOL_CAN_RAW) return 0;
        if (option == CAN_RAW_ERR_FILTER) errors_ = *static_cast<const can_err_mask_t *>(value);
        if (option != CAN_RAW_FILTER) return 0;
        const auto *filters = static_cast<const can_filter *>(value);
        filters_.assign(filters, filters + size / sizeof *filters);
        return 0;
    }
    short ready() const override {
        return static_cast<short>(queue_.empty() && error_ == 0 ? POLLOUT : POLLIN | POLLOUT);
    }
    long receive_message(msghdr *to) override {
        if (error_ != 0) return -std::exchange(error_, 0);
        if (queue_.empty()) return -EAGAIN;
        const entry next = queue_.front();
        queue_.pop_front();
        const std::uint32_t unheard = next.lost - std::exchange(told_, next.lost);
        of_.lost_told += unheard;
        if (unheard > 0) of_.lost_told_ns = of_.of_.time.now();
        std::memcpy(to->msg_iov[0].iov_base, &next.frame, sizeof next.frame);
        put_control(to, next);
        return sizeof next.frame;
    }
    long send(const void *from, std::size_t count) override {
        if (of_.state_ != can_bus::interface_state::up) return -ENETDOWN;
        if (of_.of_.time.now() < of_.full_until_ns) return -ENOBUFS;
        can_frame frame;
        if (count != sizeof frame) return -EINVAL;
        std::memcpy(&frame, from, sizeof frame);
        of_.sent_by_box(frame);
        return sizeof frame;
    }

    // out: whether the box will get it
    bool take(const can_frame &frame, time_ns wall) {
        if (!bound_ || !wants(frame)) return false;
        if (queue_.size() >= queue_frames) {
            ++lost_;
            ++of_.lost;
            return false;
        }
        queue_.push_back({frame, wall, lost_});
        return true;
    }
    // out: its filters keep away what the node sends
    bool ignores(const can_node &node) const {
        can_frame one = {}, other = {};
        one.can_id = node.value_id(false);
        other.can_id = node.value_id(true);
        return bound_ && !wants(one) && !wants(other);
    }
    void fail(int error) { error_ = error; }

  private:
    struct entry {
        can_frame frame;
        time_ns wall;
        std::uint32_t lost;
    };
    bool wants(const can_frame &frame) const {
        if (frame.can_id & CAN_ERR_FLAG) return (frame.can_id & errors_) != 0;
        return std::any_of(filters_.begin(), filters_.end(), [&frame](const can_filter &filter) {
            return (frame.can_id & filter.can_mask) == (filter.can_id & filter.can_mask);
        });
    }
    static void put_control(msghdr *to, const entry &next) {
        const timespec stamp = {next.wall / second, next.wall % second};
        cmsghdr *at = CMSG_FIRSTHDR(to);
        at->cmsg_level = SOL_SOCKET;
        at->cmsg_type = SCM_TIMESTAMPNS;
        at->cmsg_len = CMSG_LEN(sizeof stamp);
        std::memcpy(CMSG_DATA(at), &stamp, sizeof stamp);
        std::size_t used = CMSG_SPACE(sizeof stamp);
        if (next.lost > 0) {
            at = reinterpret_cast<cmsghdr *>(static_cast<char *>(to->msg_control) + used);
            at->cmsg_level = SOL_SOCKET;
            at->cmsg_type = SO_RXQ_OVFL;
            at->cmsg_len = CMSG_LEN(sizeof next.lost);
            std::memcpy(CMSG_DATA(at), &next.lost, sizeof next.lost);
            used += CMSG_SPACE(sizeof next.lost);
        }
        to->msg_controllen = used;
    }

    can_bus &of_;
    std::vector<can_filter> filters_;
    can_err_mask_t errors_ = 0;
    std::deque<entry> queue_;
    std::uint32_t lost_ = 0, told_ = 0;  // frames; told_: with a frame that was read
    int error_ = 0;
    bool bound_ = false;
};

can_bus::can_bus(computer &of, const std::vector<can_node> &all, std::uint64_t seed)
    : nodes(all), of_(of), chance_(seed, "CAN nodes") {
    for (std::size_t node = 0; node < nodes.size(); ++node) {
        nodes[node].operational = nodes[node].starts_itself;
        send_values(node);
        send_heartbeats(node);
    }
}

std::shared_ptr<open_file> can_bus::make_socket() {
    auto made = std::make_shared<can_socket>(*this);
    sockets_.erase(std::remove_if(sockets_.begin(), sockets_.end(),
                                  [](const auto &one) { return one.expired(); }),
                   sockets_.end());
    sockets_.push_back(made);
    return made;
}

void can_bus::put(const can_frame &frame) {
    const bool is_error = (frame.can_id & CAN_ERR_FLAG) != 0;  // of the controller itself
    const bool hears = is_error || of_.time.now() >= on_the_bus_ns;
    if (state_ != interface_state::up || !hears) return;
    of_.hash.add(&frame, sizeof frame);
    bool taken = false;
    if (is_error)
        for (can_node &node : nodes) node.waits = node.again = 0;
    for (const auto &one : sockets_) {
        if (const auto open = one.lock()) taken = open->take(frame, of_.wall()) || taken;
    }
    of_.changed();
    if (!heard) return;
    for (const can_node &node : nodes)
        if (node.has_sent(frame.can_id) && (taken || is_ignored(node)))
            heard(node.number, 0.1 * static_cast<std::int16_t>(frame.data[1] << 8 | frame.data[0]));
}

// out: the box listens to neither frame of the node
bool can_bus::is_ignored(const can_node &node) const {
    return std::any_of(sockets_.begin(), sockets_.end(), [&node](const auto &one) {
        const auto open = one.lock();
        return open && open->ignores(node);
    });
}

void can_bus::set_interface(interface_state state) {
    if (state == state_) return;
    state_ = state;
    changed_ns = of_.time.now();
    on_the_bus_ns = std::min(on_the_bus_ns, changed_ns);  // it begins anew
    for (can_node &node : nodes) node.waits = node.again = 0;
    const int error = state == interface_state::down   ? ENETDOWN
                      : state == interface_state::gone ? ENODEV
                                                       : 0;
    for (const auto &one : sockets_) {
        const auto open = one.lock();
        if (open && error != 0) open->fail(error);
    }
    of_.changed();
}

void can_bus::reboot(std::size_t node) {
    can_node &of = nodes[node];
    of.operational = of.starts_itself;
    of.again = 0;
    of.boots++;
    of.booted_ns = of_.time.now();
    can_frame boot_up = {};
    boot_up.can_id = static_cast<canid_t>(0x700 + of.number);
    boot_up.can_dlc = 1;
    put(boot_up);
}

void can_bus::reboot_all() {
    for (std::size_t node = 0; node < nodes.size(); ++node) reboot(node);
}

void can_bus::send_values(std::size_t node) {
    can_node &of = nodes[node];
    of_.time.at(of_.time.now() + of.every + chance_.time_between(0, ms),
                [this, node] { send_values(node); });
    of.temperature_degC = std::clamp(of.temperature_degC + chance_.between(-0.02, 0.02), 5.0, 45.0);
    if (!of.operational || of.silent) return;
    can_frame frame = {};
    const bool any_source = of.format == can_node::id_format::any_source;
    const auto source = static_cast<canid_t>(any_source ? chance_.below(256) : 0);
    frame.can_dlc = 2;
    const auto raw = static_cast<std::int16_t>(std::lround(of.temperature_degC * 10));
    frame.data[0] = static_cast<std::uint8_t>(raw & 0xFF);
    frame.data[1] = static_cast<std::uint8_t>(raw >> 8 & 0xFF);
    for (const bool other : {false, true}) {
        frame.can_id = of.value_id(other) | source;
        put(frame);
    }
    frame.data[0] ^= 0x40;  // 6.4 K beside it
    for (const bool other : {false, true})
        for (const canid_t flag : {CAN_EFF_FLAG, CAN_RTR_FLAG}) {
            frame.can_id = of.value_id(other) ^ flag;
            if (of.has_double) put(frame);
        }
}

void can_bus::send_heartbeats(std::size_t node) {
    can_node &of = nodes[node];
    if (of.heartbeat == 0) return;
    of_.time.at(of_.time.now() + of.heartbeat, [this, node] { send_heartbeats(node); });
    if (of.silent || of.operational || of_.time.now() < full_until_ns) of.waits = 0;
    if (of.silent) return;
    of.waits += !of.operational;
    can_frame frame = {};
    frame.can_id = static_cast<canid_t>(0x700 + of.number);
    frame.can_dlc = 1;
    frame.data[0] = of.operational ? 5 : 127;
    put(frame);
}

// NMT: start, of one node or of all.
void can_bus::sent_by_box(const can_frame &frame) {
    of_.hash.add(&frame, sizeof frame);
    if (sent) sent(frame);
    if (frame.can_id != 0 || frame.can_dlc != 2 || frame.data[0] != 1) return;
    for (can_node &node : nodes) {
        if (frame.data[1] != 0 && frame.data[1] != node.number) continue;
        node.starts++;
        if (of_.time.now() < on_the_bus_ns) continue;
        node.started_ns = of_.time.now();
        node.waits = 0;
        node.again += node.operational;
        node.operational = node.operational || !node.deaf;
    }
}

}  // namespace compbox::world
