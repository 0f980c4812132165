// SPDX-License-Identifier: MIT
#include "tests/world/stage/devices.h"

#include <linux/watchdog.h>
#include <net/if.h>
#include <sys/ioctl.h>

namespace compbox::world {

namespace {

class watchdog : public open_file {
  public:
    watchdog(int most_s, listener written)
        : most_s_(most_s), timeout_s_(most_s), written_(std::move(written)) {}
    long write(const void *from, std::size_t count) override {
        written_({static_cast<const char *>(from), count});
        return static_cast<long>(count);
    }
    int control(unsigned long request, void *argument) override {
        if (request != WDIOC_SETTIMEOUT && request != WDIOC_GETTIMEOUT) return -ENOTTY;
        int &seconds = *static_cast<int *>(argument);
        if (request == WDIOC_SETTIMEOUT && seconds > most_s_) return -EINVAL;
        if (request == WDIOC_SETTIMEOUT) timeout_s_ = seconds;
        seconds = timeout_s_;
        return 0;
    }

  private:
    int most_s_, timeout_s_;
    listener written_;
};

class supervisor : public open_file {
  public:
    supervisor(listener notified, std::function<bool(const std::string &)> is_up)
        : notified_(std::move(notified)), is_up_(std::move(is_up)) {
        path = "systemd";
    }
    int control(unsigned long request, void *argument) override {
        if (request != SIOCGIFFLAGS) return -ENOTTY;
        ifreq &query = *static_cast<ifreq *>(argument);
        query.ifr_flags = is_up_(query.ifr_name) ? IFF_UP : 0;
        return 0;
    }
    long send(const void *from, std::size_t count) override {
        notified_({static_cast<const char *>(from), count});
        return static_cast<long>(count);
    }

  private:
    listener notified_;
    std::function<bool(const std::string &)> is_up_;
};

}  // namespace

std::shared_ptr<open_file> make_watchdog(int most_s, const listener &written) {
    return std::make_shared<watchdog>(most_s, written);
}

std::shared_ptr<open_file> make_supervisor(const listener &notified,
                                           const std::function<bool(const std::string &)> &is_up) {
    return std::make_shared<supervisor>(notified, is_up);
}

}  // namespace compbox::world
