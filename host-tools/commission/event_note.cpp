// SPDX-License-Identifier: MIT
#include "host-tools/commission/event_note.h"

#include <unistd.h>

#include <cstdint>
#include <limits>

#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/base/crc32.h"
#include "hal/linux/clock.h"
#include "hal/linux/files/output_file.h"
}

namespace compbox::commission {

namespace {

cb_file_facts facts_of(const std::string &file, unsigned revision) {
    cb_file_facts facts = {};
    facts.was_read = true;
    facts.revision = revision;
    facts.crc32 = ::cb_crc32(0, file.data(), file.size());
    ::cb_sha256(file.data(), file.size(), facts.sha256);
    facts.owner = ::geteuid();
    facts.modified_unix_us = ::cb_unix_us();
    return facts;
}

}  // namespace

event_note::event_note(const std::string &path) : path_(path) {
    const int error = ::cb_events_start(&events_, path.empty() ? nullptr : path_.c_str());
    if (error != 0)
        throw input_error(path, 0, 0, "cannot be written ({})", ::cb_output_error(error));
}

event_note::~event_note() {
    ::cb_events_finish(&events_);
}

void event_note::add(const std::string &sentence, const std::string &file, unsigned revision) {
    const cb_file_facts facts = facts_of(file, revision);
    events_.revision = facts.revision;
    events_.crc32 = facts.crc32;
    events_.file = &facts;
    ::cb_events_add(&events_, "commission", sentence.c_str(), nullptr);
    events_.file = nullptr;
    ::cb_events_sync(&events_, std::numeric_limits<std::int64_t>::max());
    if (events_.error == 0) return;
    throw input_error(path_, 0, 0, "cannot be written ({})", ::cb_output_error(events_.error));
}

}  // namespace compbox::commission
