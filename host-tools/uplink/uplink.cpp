// SPDX-License-Identifier: MIT
#include "host-tools/uplink/uplink.h"

#include <fmt/core.h>

#include <utility>

#include "host-tools/uplink/texts.h"

namespace compbox::uplink {

namespace {

constexpr double patience_s = 5.0;  // before the absence of the broker is reported

broker_settings with_will(const settings &chosen) {
    broker_settings made = chosen.broker;
    made.will = {chosen.topic + "/online", "0"};
    return made;
}

}  // namespace

uplink::uplink(const settings &chosen)
    : settings_(chosen), broker_(with_will(chosen)), outbox_(chosen.buffer_bytes) {}

uplink::~uplink() {
    broker_.publish({settings_.topic + "/online", "0"}, true);
}

// Retained messages, which a broker without a disk has forgotten.
void uplink::greet() {
    const unsigned connection = broker_.connection();
    if (connection == 0 || (connection == connection_ && sent_state_ == state_)) return;
    if (connection != connection_ && !broker_.publish({settings_.topic + "/online", "1"}, true))
        return;
    const std::string text = with_time(state_, state_unix_s_);
    if (!broker_.publish({settings_.topic + "/state", text}, true)) return;
    connection_ = connection;
    sent_state_ = state_;
}

// What waits, in order. A message leaves the outbox when the broker has confirmed it.
void uplink::send() {
    for (const int id : broker_.confirmed()) outbox_.confirmed(id);
    while (broker_.connection() != 0) {
        const message *one = outbox_.next();
        if (one == nullptr) return;
        const auto id = broker_.publish(*one, false);
        if (!id) return;
        outbox_.sent(*id);
    }
}

void uplink::take(const json &box, const std::string &why_not, double unix_s, double steady_s) {
    if (why_not.empty() != why_not_.empty()) why_not_ = why_not;
    const std::string state = state_text(box, why_not_);
    if (state != state_) {
        state_ = state;
        state_unix_s_ = unix_s;
    }
    if (why_not.empty() && steady_s >= values_due_s_.value_or(steady_s)) {
        values_due_s_ = steady_s + settings_.values_every_s;
        outbox_.add({settings_.topic + "/values", values_text(box)});
    }
    greet();
    send();
}

void uplink::add_event(const std::string &line) {
    outbox_.add({settings_.topic + "/events", line});
}

figures uplink::so_far() const {
    return {broker_.connection() != 0, broker_.connections(), outbox_.waiting(),
            outbox_.bytes(),           outbox_.delivered(),   outbox_.lost()};
}

std::string uplink::news(double steady_s) {
    const std::string at =
        fmt::format("the MQTT broker {}:{}", settings_.broker.host, settings_.broker.port);
    if (broker_.connection() != 0) {
        const bool first = !connected_before_;
        const bool was_alone = std::exchange(is_reported_, false);
        connected_before_ = true;
        alone_since_s_.reset();
        return first || was_alone ? fmt::format("connected to {}", at) : "";
    }
    if (!alone_since_s_) alone_since_s_ = steady_s;
    if (is_reported_ || steady_s - *alone_since_s_ < patience_s) return "";
    is_reported_ = true;
    const std::string why = broker_.why_not();
    return fmt::format("no connection to {}{}; messages wait, within --mqtt-buffer", at,
                       why.empty() ? "" : ": " + why);
}

}  // namespace compbox::uplink
