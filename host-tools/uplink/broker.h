// SPDX-License-Identifier: MIT
// An MQTT broker by libmosquitto. A thread of its own connects, sends and waits for confirmations.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/uplink/outbox.h"

namespace compbox::uplink {

struct broker_settings {
    std::string host;
    int port = 1883;
    std::string user, password;  // user "": none
    std::string ca_file;         // "": without TLS
    message will;                // the broker publishes it, retained, when the connection is lost
};

class broker {
  public:
    // Connects in the background, again and again. Throws input_error for a CA file that cannot be
    // read, and for a topic or user that MQTT does not allow.
    explicit broker(const broker_settings &settings);
    ~broker();
    broker(const broker &) = delete;
    broker &operator=(const broker &) = delete;

    // out: number of the connection, from 1; 0: there is none
    unsigned connection() const;

    // out: how many connections there were so far
    unsigned connections() const;

    // At least once. out: the number under which it will be confirmed; nothing: try it again
    std::optional<int> publish(const message &one, bool retained);

    // out: numbers that were confirmed since the last call
    std::vector<int> confirmed();

    // out: why there is no connection, as a sentence; "": there is one, or none was tried
    std::string why_not() const;

  private:
    struct inside;
    std::unique_ptr<inside> is_;
};

}  // namespace compbox::uplink
