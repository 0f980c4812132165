// SPDX-License-Identifier: MIT
// A commissioning as an event of the box (docs/events.md), beside those of compboxd.
#pragma once

#include <string>

namespace compbox::commission {

// in : the file of compboxd --events, or a new one. Throws input_error if it cannot be written.
void check_events_file(const std::string &path);

// Appends an event of the kind "commission" about a file that this user has written.
// in : of the file its text and revision. Throws input_error if it cannot be written.
void note_event(const std::string &path, const std::string &sentence, const std::string &file,
                unsigned revision);

}  // namespace compbox::commission
