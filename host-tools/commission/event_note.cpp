// SPDX-License-Identifier: MIT
#include "host-tools/commission/event_note.h"

#include <unistd.h>

#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/base/crc32.h"
#include "hal/linux/clock.h"
#include "hal/linux/files/events.h"
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

// in : 0, or errno
void throw_if(int error, const std::string &path) {
    if (error != 0)
        throw input_error(path, 0, 0, "cannot be written ({})", ::cb_output_error(error));
}

}  // namespace

void check_events_file(const std::string &path) {
    cb_events events = {};
    throw_if(::cb_events_start(&events, path.c_str()), path);
    ::cb_events_finish(&events);
}

void note_event(const std::string &path, const std::string &sentence, const std::string &file,
                unsigned revision) {
    const cb_file_facts facts = facts_of(file, revision);
    cb_events events = {};
    throw_if(::cb_events_start(&events, path.c_str()), path);
    events.revision = facts.revision;
    events.crc32 = facts.crc32;
    events.file = &facts;
    ::cb_events_add(&events, "commission", sentence.c_str(), nullptr);
    throw_if(::cb_events_finish(&events), path);
}

}  // namespace compbox::commission
