// SPDX-License-Identifier: MIT
// Topics and payloads of the messages (docs/uplink.md), from a snapshot of the box.
#pragma once

#include <string>

#include "host-tools/formats/json_type.h"

namespace compbox::uplink {

// out: one level of a topic: '_' for '/', '+', '#' and control characters; "box" for ""
std::string topic_level(const std::string &name);

// in : box: an object of version 1 whose lists hold objects with names (box_files/snapshot.h), or
// null out: the state: what runs, mode, reason and cause; why no box runs. The same text means the
// same
//      state.
std::string state_text(const json &box, const std::string &why_not);

// out: the object with the member unix_s
std::string with_time(const std::string &object, double unix_s);

// out: values of signals, terms and channels by name, with the wall clock of the snapshot and the
//      revision that they belong to: they may wait for days, and the state be another one then
std::string values_text(const json &box);

}  // namespace compbox::uplink
