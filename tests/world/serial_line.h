// SPDX-License-Identifier: MIT
// A serial line of the box: a device file, and slaves that hear each byte when it ends on the wire.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "host-tools/fakeplc/modbus.h"
#include "host-tools/fakeplc/serial_server.h"
#include "tests/world/computer.h"
#include "tests/world/dice.h"

namespace compbox::world {

// What happens to the bytes of one frame.
struct line_fate {
    bool lost = false;
    bool flipped = false;  // one bit of them
    time_ns delay_ns = 0;  // before the first, or in the middle if `torn`
    bool torn = false;
};

class line_faults {
  public:
    virtual ~line_faults() = default;
    virtual line_fate at_line(bool to_box) = 0;
};

class serial_line {
  public:
    // A request of the box, and what came for it until the next one.
    struct question {
        fakeplc::byte_string frame;  // empty: none since the adapter was plugged in
        time_ns sent = 0;
        bool on_time = true;  // no fault delayed it
        // Its own reply came whole, or with a wrong check sum behind a right beginning; an
        // exception.
        bool settled = false, refused = false;
        bool prompt = false;   // it came whole, and on time by any deadline …
        bool damaged = false;  // … or with a wrong check sum alone
        bool heard = false;    // something came since, its own or of before
    };
    // Called when the box sends the next one. quiet: since the last byte that came to it, or that
    // it sent; never: it has not read all.
    std::function<void(const question &before, const fakeplc::byte_string &now, time_ns quiet)>
        asks;

    // Makes the device.
    serial_line(computer &of, const std::string &device, std::uint64_t seed);

    // in : the time at which the box sent it. Called in an event when its last byte ended.
    std::function<void(const fakeplc::byte_string &bytes, time_ns sent)> heard;
    // A slave replies to a request; the first byte leaves after `after`.
    // in : request: what it answers, and when that was sent; empty: nothing
    void send(const fakeplc::byte_string &bytes, time_ns after,
              const fakeplc::byte_string &request = {}, time_ns sent = 0);
    // Without an adapter the device is missing, and its descriptors fail.
    void plug(bool in);
    bool is_plugged() const { return plugged_; }
    time_ns taken_until_ns = 0;       // by another program
    int refused = 0;                  // attempts to open it while it was unplugged or taken
    time_ns plugged_ns = -never / 2;  // the newest time at which it was, or was unplugged
    // out: since then the box may have it, or not
    time_ns changed_ns() const { return std::max(plugged_ns, taken_until_ns); }
    // out: of one character at the line's speed
    time_ns character() const { return 11 * second / baud_; }
    // out: what ends a frame (Modbus over serial line 1.02, 2.5.1.1): 3.5 characters, without
    // parity of 10 bits
    time_ns silence() const { return baud_ > 19200 ? 1750 * us : 35 * second / baud_; }

    line_faults *faults = nullptr;

  private:
    friend class line_file;
    void transmit(const fakeplc::byte_string &bytes);
    void deliver(const fakeplc::byte_string &bytes, time_ns from);
    // flipped: the byte with a bit that flips; npos: none
    fakeplc::byte_string spoilt(fakeplc::byte_string bytes, const line_fate &fate,
                                std::size_t *flipped);
    void settle(const fakeplc::byte_string &reply, std::size_t flipped, bool on_time);

    computer &of_;
    dice chance_;
    std::string inbox_;
    question newest_;
    time_ns alike_since_ns_ = 0;  // since then the box has sent nothing else than that
    long baud_ = 19200;
    bool plugged_ = true;
    std::uint64_t plugs_ = 0;      // descriptors of an earlier adapter are dead
    time_ns free_ns_[2] = {0, 0};  // end of the last byte, from and to the box
    time_ns busy_ns_ = 0;          // the last time when the box knew of a byte
};

// Slaves of a line: whole requests of a unit to replies.
class rtu_slaves {
  public:
    struct reply {
        fakeplc::byte_string pdu;  // empty: no unit of this number, or no reply
        time_ns delay_ns = 0;
        bool is_wrong = false;  // one to another request, of whoever else is on the line …
        int units_off = 0;      // … which may have another unit
    };
    using handler = std::function<reply(int unit, const fakeplc::byte_string &pdu, time_ns sent)>;
    rtu_slaves(serial_line &line, scheduler &time, handler answer);

  private:
    void hear(const fakeplc::byte_string &bytes, time_ns sent);

    serial_line &line_;
    scheduler &time_;
    handler answer_;
    fakeplc::byte_string received_;
    time_ns received_ns_ = 0;
};

}  // namespace compbox::world
