// SPDX-License-Identifier: MIT
// The box on this computer with a live PLC: cycle, client and last stage as in the cabinet, with an
// offset for each channel in place of models.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/commission/config.h"

namespace compbox::commission {

// One reading of the PLC's read block.
struct plc_reading {
    std::int64_t requested_us = 0, received_us = 0;  // one clock for all times
    std::vector<std::uint16_t> registers;
};

// Reply of the PLC to the read-back of the write block.
enum class read_back { unanswered, answered, refused };

// One write of the box.
struct box_write {
    std::int64_t sent_us = 0, done_us = 0;
    bool confirmed = false;
    std::vector<float> output_um;  // of each channel of the file
};

class live_box {
  public:
    // Sends nothing before the first cycle. Throws input_error for an invalid address.
    explicit live_box(const box_setup &setup);
    ~live_box();
    live_box(const live_box &) = delete;

    // One period of the box. Throws input_error after SIGINT or SIGTERM.
    void cycle();
    // Cycles until the condition is true or the time is over. out: the condition
    bool cycle_until(double timeout_s, const std::function<bool()> &done);

    // Sets the target of the channel, which moves at its slew rate while the box is ACTIVE.
    void set_offset_um(std::size_t channel, double um);
    // Ramps to zero, writes STOPPED, closes the connection. out: whether the PLC confirmed it or no
    // offset was ever written. Called at the end in every case; no signal interrupts it.
    bool stop();

    // Between two cycles, reads the PLC as often as it answers; each reading goes to on_reading.
    void read_between_cycles(bool on) { reading_between_ = on; }
    std::function<void(const plc_reading &)> on_reading;
    std::function<void(const box_write &)> on_write;

    const cb_config &config() const;
    int mode() const;
    int reason() const;
    double inactive_s() const;               // since the box was ACTIVE, or started
    bool read_ok() const;                    // in this cycle
    const std::uint16_t *registers() const;  // of the read block, as last read
    const std::uint16_t *written() const;    // of the write block
    double age_s() const;                    // of the last good reading; without one, since start
    double output_um(std::size_t channel) const;
    // out: applied value that the PLC reports; nothing: no register for it
    std::optional<double> applied_um(std::size_t channel) const;
    std::optional<double> applied_um(std::size_t channel, const plc_reading &reading) const;
    // The exchange of the last cycle: from asking for the reading to the confirmed write, µs.
    std::uint32_t exchange_us() const;
    std::int64_t read_us() const;  // request time of the last reading
    std::uint32_t writes_refused() const;
    std::uint32_t reads_torn() const;
    std::uint32_t handshakes() const;
    // The lowest exception code that the PLC answered with, other than to the read-back; 0: none
    // yet.
    int last_exception() const;
    read_back found_read_back() const;  // the last one that was answered or refused
    int read_back_exception() const;    // its code; 0: it was not refused
    std::string write_remedy() const;   // remedy if the PLC lacks the write function
    std::string peer() const;           // the PLC's address and port, or the device
    std::string no_reply() const;       // sentence with place, cause and remedy

  private:
    std::string connection() const;  // text of the cause of a lost connection
    struct inside;
    std::unique_ptr<inside> inside_;
    bool reading_between_ = false;
};

// Makes cycle() throw on SIGINT and SIGTERM; if permitted, sets the real-time priority of the box's
// loop.
void prepare_process();

}  // namespace compbox::commission
