// SPDX-License-Identifier: MIT
#include "tests/world/network.h"

#include <netinet/tcp.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace compbox::world {

namespace {

class tcp_socket : public open_file {
  public:
    explicit tcp_socket(network &of) : link_(std::make_shared<connection>(of)) { path = "tcp"; }

    int connect(const sockaddr *address, socklen_t) override {
        const in_port_t port = address->sa_family == AF_INET6
                                   ? reinterpret_cast<const sockaddr_in6 *>(address)->sin6_port
                                   : reinterpret_cast<const sockaddr_in *>(address)->sin_port;
        link_->connect(ntohs(port));
        return -EINPROGRESS;
    }
    short ready() const override {
        using phase = connection::phase;
        int events = 0;
        if (link_->state == phase::idle) return POLLOUT | POLLHUP;
        if (link_->readable()) events |= POLLIN;
        if (link_->state != phase::connecting) events |= POLLOUT;
        if (link_->error != 0) events |= POLLERR | POLLHUP;
        return static_cast<short>(events);
    }
    long receive(void *to, std::size_t count) override { return link_->take(to, count); }
    long read(void *to, std::size_t count) override { return link_->take(to, count); }
    long send(const void *from, std::size_t count) override { return link_->give(from, count); }
    int shut_down(int) override {
        if (link_->state != connection::phase::up) return -ENOTCONN;
        link_->shut_down();
        return 0;
    }
    int set_option(int level, int option, const void *value, socklen_t) override {
        if (level == SOL_SOCKET && option == SO_LINGER)
            discards_ = static_cast<const linger *>(value)->l_onoff != 0;
        return 0;
    }
    int get_option(int level, int option, void *value, socklen_t *) override {
        if (level != SOL_SOCKET || option != SO_ERROR) return -ENOPROTOOPT;
        *static_cast<int *>(value) = std::exchange(link_->error, 0);
        return 0;
    }
    void closed(bool) override { link_->close(discards_); }

  private:
    connection_ptr link_;
    bool discards_ = false;
};

}  // namespace

std::shared_ptr<open_file> make_tcp_socket(network &of) {
    return std::make_shared<tcp_socket>(of);
}

network::network(computer &of_box, std::uint64_t seed) : box(of_box), chance_(seed, "network") {}

tcp_peer *network::listener(std::uint16_t port) const {
    const auto found = listeners_.find(port);
    return found == listeners_.end() ? nullptr : found->second;
}

// ---- the wire

void connection::put_on_wire(bool to_box, const std::string &bytes, time_ns after) {
    scheduler &time = of_.box.time;
    const segment_fate fate =
        of_.faults == nullptr ? segment_fate{} : of_.faults->at_segment(to_box, bytes.size());
    if (fate.reset) {
        time.at(time.now(), [self = shared_from_this()] { self->reset(); });
        return;
    }
    if (fate.lost || !of_.plugged) stalled_[to_box] = true;
    if (stalled_[to_box]) return;
    time_ns &last = last_due_[to_box];
    last = std::max(last, time.now() + after + of_.latency() + fate.delay_ns);
    const auto arrive = [this, to_box, &time](time_ns when, const std::string &part) {
        time.at(when, [self = shared_from_this(), to_box, part, sent = time.now()] {
            if (to_box)
                self->deliver(part);
            else if (self->open_at_peer && !self->is_dropped(sent))
                self->peer_->received(self, part, sent);
        });
    };
    std::string flipped = bytes;
    if (fate.flips_bit >= 0) {
        char &byte = flipped[static_cast<std::size_t>(fate.flips_bit) / 8 % flipped.size()];
        byte = static_cast<char>(byte ^ (1 << fate.flips_bit % 8));
    }
    if (fate.cut_at == 0 || fate.cut_at >= bytes.size()) {
        arrive(last, flipped);
        return;
    }
    arrive(last, flipped.substr(0, fate.cut_at));
    if (to_box)
        time.at(last, [self = shared_from_this(), rest = fate.rest_ns] {
            if (self->counted_ && self->of_.torn) self->of_.torn(rest);
        });
    last += fate.rest_ns;
    arrive(last, flipped.substr(fate.cut_at));
}

// The kernel sends nothing again of a connection that the box has reset.
bool connection::is_dropped(time_ns sent) const {
    return discards_ && of_.longest_wait && of_.box.time.now() - sent > of_.longest_wait(sent);
}

// Calls `what` behind everything that is on its way in this direction.
void connection::after_all(bool to_box, const std::function<void(connection &)> &what) {
    if (stalled_[to_box] || !of_.plugged) return;
    time_ns &last = last_due_[to_box];
    last = std::max(last, of_.box.time.now() + of_.latency());
    of_.box.time.at(last, [self = shared_from_this(), what] { what(*self); });
}

void connection::count(bool open) {
    if (counted_ == open) return;
    counted_ = open;
    of_.open += open ? 1 : -1;
    of_.unasked_ns = never;
    if (of_.open == 0) of_.closed_ns = of_.box.time.now();
}

// ---- the peer's side

void connection::send(const std::string &bytes, time_ns after) {
    if (open_at_peer) put_on_wire(true, bytes, after);
}

void connection::finish() {
    if (!open_at_peer) return;
    open_at_peer = false;
    after_all(true, [](connection &self) {
        self.fin_ = true;
        self.of_.box.changed();
    });
}

void connection::reset() {
    if (open_at_peer) peer_->closed(shared_from_this(), true);
    open_at_peer = false;
    fail(ECONNRESET);
}

// ---- the box's side

void connection::connect(std::uint16_t port) {
    ++of_.attempts;
    state = phase::connecting;
    count(true);
    const segment_fate fate = of_.faults == nullptr ? segment_fate{} : of_.faults->at_connect();
    if (fate.lost || !of_.plugged) return;
    scheduler &time = of_.box.time;
    time.at(time.now() + 2 * of_.latency() + of_.accepts_after + fate.delay_ns,
            [self = shared_from_this(), port] { self->answer_attempt(port); });
}

void connection::answer_attempt(std::uint16_t port) {
    if (gone_) return;
    peer_ = of_.listener(port);
    if (peer_ == nullptr) {
        fail(ECONNREFUSED);
        return;
    }
    state = phase::up;
    of_.unasked_ns = of_.box.time.now();
    open_at_peer = true;
    if (!peer_->accepted(shared_from_this())) {
        open_at_peer = false;
        after_all(true, [](connection &self) { self.fail(ECONNRESET); });
    }
    of_.box.changed();
}

void connection::fail(int error_number) {
    if (gone_ || state == phase::over) return;
    state = phase::over;
    count(false);
    error = error_number;
    inbox_.clear();
    of_.box.changed();
}

void connection::deliver(const std::string &bytes) {
    if (gone_) {  // nobody has the socket any more: RST
        if (open_at_peer) peer_->closed(shared_from_this(), true);
        open_at_peer = false;
        return;
    }
    if (state != phase::up) return;
    inbox_ += bytes;
    of_.box.hash.add(bytes);
    of_.box.changed();
}

long connection::take(void *to, std::size_t count) {
    if (error != 0) return -std::exchange(error, 0);
    if (!inbox_.empty()) {
        count = std::min(count, inbox_.size());
        std::memcpy(to, inbox_.data(), count);
        inbox_.erase(0, count);
        return static_cast<long>(count);
    }
    if (fin_ || state == phase::over) return 0;
    return state == phase::up ? -EAGAIN : -ENOTCONN;
}

long connection::give(const void *from, std::size_t count) {
    if (error != 0) return -std::exchange(error, 0);
    if (shut_ || state == phase::over) return -EPIPE;
    if (state != phase::up) return -ENOTCONN;
    given_ = true;
    of_.unasked_ns = never;
    of_.box.hash.add(from, count);
    of_.box.hash.add(of_.box.time.now());
    put_on_wire(false, std::string(static_cast<const char *>(from), count), 0);
    return static_cast<long>(count);
}

void connection::shut_down() {
    if (shut_) return;
    shut_ = true;
    after_all(false, [](connection &self) {
        if (self.open_at_peer) self.peer_->closed(self.shared_from_this(), false);
    });
}

// discard: by RST, which overtakes nothing but what is not sent yet; unread bytes make one too.
void connection::close(bool discard) {
    if (gone_) return;
    gone_ = true;
    count(false);
    discards_ = discard;
    if (state != phase::up) return;
    of_.closed_unasked += !given_ && !fin_ && error == 0;
    const bool reset = discard || !inbox_.empty();
    if (shut_ && !reset) return;
    after_all(false, [reset](connection &self) {
        if (!self.open_at_peer) return;
        self.peer_->closed(self.shared_from_this(), reset);
        if (reset) self.open_at_peer = false;
    });
}

}  // namespace compbox::world
