// SPDX-License-Identifier: MIT
// Ill-behaved replies, on command: what can go wrong between a box and its PLC.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/modbus.h"

namespace compbox {

enum class fault_kind {
    late,       // the reply comes `value` ms late; later ones queue behind it
    drop,       // the request is obeyed, no reply comes
    exception,  // the request is not obeyed; exception code `value`
    wrong_id,   // the reply carries another transaction id; serial: another unit id
    truncate,   // the first half of the reply's bytes, and nothing more of it
    dribble,    // one byte of the reply every `value` ms
    torn,       // a reading shows two updates of the PLC's block
    too_short,  // a well-formed frame with one register fewer than asked
    too_long,   // … with one register more
    crc,        // serial: the check sum does not fit
    noise,      // serial: `value` bytes of noise before the reply
};

struct fault {
    fault_kind kind = fault_kind::drop;
    int value = 0;
    bool on_reads = true, on_writes = true;  // which requests it meets; 23 is both
};

// The faults ordered so far; each request takes the first one that meets it.
class fault_plan {
  public:
    void add(const fault &what, int count) { waiting_.push_back({what, count}); }
    void clear() { waiting_.clear(); }
    std::optional<fault> take(std::uint8_t function);

  private:
    struct entry {
        fault what;
        int count;
    };
    std::deque<entry> waiting_;
};

// Bytes to be sent, each part after a delay from now.
struct timed_bytes {
    int delay_ms;
    byte_string bytes;
};

// What goes on the wire in place of a reply. frame: a whole reply.
std::vector<timed_bytes> spoil(const byte_string &frame, const std::optional<fault> &what);

}  // namespace compbox
