// SPDX-License-Identifier: MIT
#include "tests/world/stage/devices.h"

#include <linux/watchdog.h>

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

class notify_socket : public open_file {
  public:
    explicit notify_socket(listener notified) : notified_(std::move(notified)) {}
    long send(const void *from, std::size_t count) override {
        notified_({static_cast<const char *>(from), count});
        return static_cast<long>(count);
    }

  private:
    listener notified_;
};

}  // namespace

std::shared_ptr<open_file> make_watchdog(int most_s, const listener &written) {
    return std::make_shared<watchdog>(most_s, written);
}

std::shared_ptr<open_file> make_notify_socket(const listener &notified) {
    return std::make_shared<notify_socket>(notified);
}

}  // namespace compbox::world
