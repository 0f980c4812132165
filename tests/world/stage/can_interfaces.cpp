// SPDX-License-Identifier: MIT
#include "tests/world/stage/can_interfaces.h"

#include <linux/can/raw.h>

#include <cstring>

namespace compbox::world {

namespace {

// Keeps the options until it is bound; then it is a socket of that interface.
class unbound_socket : public open_file {
  public:
    explicit unbound_socket(can_interfaces &of) : of_(of) { path = "can"; }

    int set_option(int level, int option, const void *value, socklen_t size) override {
        if (level == SOL_CAN_RAW)
            options_[option] = std::string(static_cast<const char *>(value), size);
        return 0;
    }
    int bind(const sockaddr *address, socklen_t size) override {
        sockaddr_can to;
        std::memcpy(&to, address, sizeof to);
        can_bus *const bus = of_.with_index(to.can_ifindex);
        if (bus == nullptr) return -ENODEV;
        of_this_ = bus->make_socket();
        for (const auto &option : options_)
            of_this_->set_option(SOL_CAN_RAW, option.first, option.second.data(),
                                 static_cast<socklen_t>(option.second.size()));
        return of_this_->bind(address, size);
    }
    short ready() const override { return of_this_ == nullptr ? POLLOUT : of_this_->ready(); }
    long receive_message(msghdr *to) override {
        return of_this_ == nullptr ? -EAGAIN : of_this_->receive_message(to);
    }
    long send(const void *from, std::size_t count) override {
        return of_this_ == nullptr ? -ENXIO : of_this_->send(from, count);
    }

  private:
    can_interfaces &of_;
    std::map<int, std::string> options_;
    std::shared_ptr<open_file> of_this_;
};

}  // namespace

can_interfaces::can_interfaces(computer &of) : of_(of) {
    of.interface_index = [this](const std::string &name) { return index_of(name); };
}

std::shared_ptr<open_file> can_interfaces::make_socket() {
    return std::make_shared<unbound_socket>(*this);
}

void can_interfaces::set(const std::string &name, can_bus::interface_state state) {
    auto &bus = buses_[name];
    if (bus == nullptr) {
        bus = std::make_unique<can_bus>(of_, std::vector<can_node>{}, 1);
        bus->bound = [this, name](const std::vector<can_filter> &filters) { bound(name, filters); };
        bus->sent = [this, name](const can_frame &frame) { sent(name, frame); };
    }
    bus->set_interface(state);
}

bool can_interfaces::is_up(const std::string &name) const {
    const auto found = buses_.find(name);
    return found != buses_.end() && found->second->state() == can_bus::interface_state::up;
}

void can_interfaces::put(const std::string &name, const can_frame &frame) {
    buses_.at(name)->put(frame);
}

can_bus *can_interfaces::with_index(int index) {
    for (const auto &entry : buses_) {
        if (--index == 0) return entry.second.get();
    }
    return nullptr;
}

unsigned can_interfaces::index_of(const std::string &name) const {
    unsigned index = 0;
    for (const auto &entry : buses_) {
        ++index;
        const bool gone = entry.second->state() == can_bus::interface_state::gone;
        if (entry.first == name) return gone ? 0 : index;
    }
    return 0;
}

}  // namespace compbox::world
