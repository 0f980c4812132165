// SPDX-License-Identifier: MIT
#include "tests/world/devices.h"

#include <linux/watchdog.h>
#include <net/if.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "tests/world/computer.h"

namespace compbox::world {

namespace {

class terminal : public open_file {
  public:
    terminal(computer &of, int fd) : of_(of), writes_(fd > 0) {
        path = fd == 2 ? "stderr" : fd == 1 ? "stdout" : "stdin";
    }
    long read(void *, std::size_t) override { return 0; }
    short ready() const override { return of_.log_is_read() ? POLLIN | POLLOUT : POLLIN; }
    long write(const void *from, std::size_t count) override {
        if (!writes_) return -EBADF;
        while (!of_.log_is_read()) of_.wait_for_change(never);
        of_.write_log(static_cast<const char *>(from), count);
        return static_cast<long>(count);
    }

  private:
    computer &of_;
    bool writes_;
};

class null_device : public open_file {
  public:
    long read(void *, std::size_t) override { return 0; }
    long write(const void *, std::size_t count) override { return static_cast<long>(count); }
    long seek(long, int) override { return 0; }
};

class watchdog : public null_device {
  public:
    explicit watchdog(computer &of) : of_(of) {}
    long write(const void *from, std::size_t count) override {
        const auto *bytes = static_cast<const char *>(from);
        if (of_.supervised) of_.supervised({bytes, *bytes == 'V' ? count : 0});
        return static_cast<long>(count);
    }
    int control(unsigned long request, void *argument) override {
        int &seconds = *static_cast<int *>(argument);
        if (request == WDIOC_SETTIMEOUT) timeout_s_ = seconds;
        if (request == WDIOC_SETTIMEOUT || request == WDIOC_GETTIMEOUT) seconds = timeout_s_;
        return request == WDIOC_SETTIMEOUT || request == WDIOC_GETTIMEOUT ? 0 : -ENOTTY;
    }

  private:
    computer &of_;
    int timeout_s_ = 10;
};

class boot_id_file : public open_file {
  public:
    explicit boot_id_file(const std::string &id) : text_(id + "\n") {}
    long read(void *to, std::size_t count) override {
        count = std::min(count, text_.size() - at_);
        std::memcpy(to, text_.data() + at_, count);
        at_ += count;
        return static_cast<long>(count);
    }

  private:
    std::string text_;
    std::size_t at_ = 0;
};

// A datagram socket to the supervisor.
class notify_socket : public null_device {
  public:
    notify_socket(computer &of, std::function<bool()> can_is_up)
        : of_(of), can_is_up_(std::move(can_is_up)) {
        path = "systemd";
    }
    int control(unsigned long request, void *argument) override {
        if (request != SIOCGIFFLAGS) return -ENOTTY;
        static_cast<ifreq *>(argument)->ifr_flags = can_is_up_() ? IFF_UP : 0;
        return 0;
    }
    long send(const void *from, std::size_t count) override {
        of_.hash.add(from, count);
        if (of_.supervised) of_.supervised({static_cast<const char *>(from), count});
        return static_cast<long>(count);
    }

  private:
    computer &of_;
    std::function<bool()> can_is_up_;
};

}  // namespace

std::shared_ptr<open_file> make_terminal(computer &of, int fd) {
    return std::make_shared<terminal>(of, fd);
}

std::shared_ptr<open_file> make_notify_socket(computer &of, std::function<bool()> can_is_up) {
    return std::make_shared<notify_socket>(of, std::move(can_is_up));
}

void add_system_devices(computer &of) {
    of.files.make_device("/dev/null", [] { return std::make_shared<null_device>(); });
    of.files.make_device("/dev/cpu_dma_latency", [] { return std::make_shared<null_device>(); });
    of.files.make_device("/dev/watchdog", [&of] { return std::make_shared<watchdog>(of); });
    of.files.make_device("/proc/sys/kernel/random/boot_id",
                         [&of] { return std::make_shared<boot_id_file>(of.boot_id()); });
}

}  // namespace compbox::world
