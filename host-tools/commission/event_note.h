// SPDX-License-Identifier: MIT
// A commissioning as an event of the box (docs/events.md), beside those of compboxd.
#pragma once

#include <string>

extern "C" {
#include "hal/linux/files/events.h"
}

namespace compbox::commission {

class event_note {
  public:
    // in : the file of compboxd --events; "": none. Throws input_error if it cannot be written.
    explicit event_note(const std::string &path);
    ~event_note();
    event_note(const event_note &) = delete;
    event_note &operator=(const event_note &) = delete;

    // Appends an event of the kind "commission" about a file that this user has written.
    // in : its text and revision. Throws input_error.
    void add(const std::string &sentence, const std::string &file, unsigned revision);

  private:
    std::string path_;
    cb_events events_ = {};
};

}  // namespace compbox::commission
