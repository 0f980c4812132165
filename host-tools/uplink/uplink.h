// SPDX-License-Identifier: MIT
// The box in the plant: its state, values and events to an MQTT broker, across the broker's absence
// (docs/uplink.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "host-tools/formats/json_type.h"
#include "host-tools/uplink/broker.h"
#include "host-tools/uplink/outbox.h"

namespace compbox::uplink {

struct settings {
    broker_settings broker;  // its will is set here
    std::string topic;       // begin of all topics, such as "compbox/lathe-3"
    double values_every_s = 10.0;
    std::size_t buffer_bytes = 32u << 20;
};

// Of values and events, since the start.
struct figures {
    bool connected = false;
    unsigned connections = 0;  // made so far
    std::size_t waiting = 0, waiting_bytes = 0;
    std::uint64_t delivered = 0, lost = 0;  // confirmed by the broker; dropped, the buffer was full
};

class uplink {
  public:
    // Throws input_error as broker does.
    explicit uplink(const settings &chosen);
    // Publishes that nobody tells about the box any more.
    ~uplink();

    // The newest snapshot, also an unchanged one; call it about ten times a second.
    // in : box, why_not: as of state_text(); wall clock, and a clock that nobody sets, s
    void take(const json &box, const std::string &why_not, double unix_s, double steady_s);

    // in : a line of the daemon's events, JSON
    void add_event(const std::string &line);

    // out: a sentence when the connection comes or goes, or has not come for some seconds; else ""
    std::string news(double steady_s);

    figures so_far() const;

  private:
    void greet();
    void send();

    settings settings_;
    broker broker_;
    outbox outbox_;
    unsigned connection_ = 0;  // which was greeted
    std::string why_not_;      // as it began; later ones have another age
    std::string state_, sent_state_;
    double state_unix_s_ = 0.0;
    std::optional<double> values_due_s_;
    std::optional<double> alone_since_s_;  // without a connection; nothing: there is one
    bool is_reported_ = false;             // that it is alone
    bool connected_before_ = false;
};

}  // namespace compbox::uplink
