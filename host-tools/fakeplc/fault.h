// SPDX-License-Identifier: MIT
// Faults of replies on command, as they occur between a box and its PLC.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/modbus.h"

namespace compbox::fakeplc {

enum class fault_kind {
    late,       // the reply is `value` ms late; later replies wait for it
    drop,       // the request is executed without a reply
    exception,  // the request is not executed; exception code `value`
    wrong_id,   // the reply has another transaction id; serial: another unit id
    truncate,   // only the first half of the reply's bytes
    dribble,    // one byte of the reply every `value` ms
    torn,       // a reading shows two updates of the PLC's block
    too_short,  // a valid frame with one register fewer than requested
    too_long,   // … with one register more
    crc,        // serial: a wrong check sum
    noise,      // serial: `value` bytes of noise before the reply
};

struct fault {
    fault_kind kind = fault_kind::drop;
    int value = 0;
    bool on_reads = true, on_writes = true;  // which requests it affects; 23 is both
};

// Queue of faults; each request takes the first one that applies to it.
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

// in : frame: a complete reply. out: the bytes to send in its place
std::vector<timed_bytes> spoil(const byte_string &frame, const std::optional<fault> &what);

}  // namespace compbox::fakeplc
