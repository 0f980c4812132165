// SPDX-License-Identifier: MIT
// All that compbox-view serves: its files, what it remembers of them, and its routes.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "host-tools/box_files/event_log.h"
#include "host-tools/box_files/snapshot.h"
#include "host-tools/uplink/uplink.h"
#include "host-tools/view/access.h"
#include "host-tools/view/answer.h"
#include "host-tools/view/feed.h"
#include "host-tools/view/guess_limit.h"
#include "host-tools/view/recent.h"
#include "host-tools/view/record.h"

namespace compbox::view {

struct site_files {
    std::string snapshot;
    std::string events, record;  // "": none
};

class site {
  public:
    site(const site_files &files, access_rule rule);

    // Looks at the files; call it ten times a second. in : wall clock, s
    // out: whether the feed has something new
    bool poll(double unix_s);

    // in : of GET or HEAD; wall clock, s
    answer reply(const request &to, double unix_s);

    feed &news() { return feed_; }
    const box_files::snapshot_file &box() const { return snapshot_; }
    std::function<void(const std::string &)> on_event;  // a line of JSON, as it comes
    std::function<uplink::figures()> plant;             // of --mqtt; empty: without

  private:
    bool poll_snapshot(double unix_s);
    bool poll_events();
    unsigned refusal(const request &to);
    answer route(const request &to, double unix_s);
    answer json_answer(std::string text);
    answer recent();
    answer events(const request &to);
    answer history(const request &to, double unix_s);
    answer metrics(const request &to, double unix_s);

    access_rule rule_;
    guess_limit guesses_;
    box_files::snapshot_file snapshot_;
    box_files::event_log events_;
    record record_;
    recent_values recent_;
    feed feed_;
    body_store bodies_;
    struct made_text {
        double unix_s;
        body text;
    };
    std::map<long, made_text> history_texts_;  // by hours
    body recent_text_;                         // null: make it again
    std::string last_why_ = "-";               // of the newest text in the feed
};

}  // namespace compbox::view
