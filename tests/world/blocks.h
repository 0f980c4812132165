// SPDX-License-Identifier: MIT
// What invariants know of a file and of an exchange, decoded by fakeplc's numbers and by JSON: no
// code of the box.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/world/faults.h"
#include "tests/world/machine.h"
#include "tests/world/scheduler.h"

namespace compbox::world {

struct exchange;
class run;

// The low byte of the status is box_mode (host-tools/fakeplc/duties.h). Of the high byte:
namespace box_reason {
enum : unsigned {
    none = 0,
    no_plc = 1,
    not_enabled = 2,
    not_referenced = 3,
    heartbeat = 4,
    signal = 5,
    clock = 6,
    wait = 7,
    degraded = 8,
    limited = 9,
    stop = 10,
    extrapolated = 11,
    unconfirmed = 12,
    unapplied = 13,
    nc_waits = 14,
    demand = 16,
    write_refused = 18,
    overrun = 19,
    nc_alarm = 20,
    foreign = 21,
    drifted = 22
};
}

// A written block.
struct written_block {
    unsigned mode = 0, reason = 0, detail = 0;
    std::uint16_t heartbeat = 0;
    bool counters_agree = true;
    std::vector<double> um;            // of each channel, as the tool moves
    std::vector<double> slope;         // of each channel, mm/mm; 0 without a tangent
    std::vector<double> reference_mm;  // of each channel, where its slope begins; 0 without
    bool is_zero() const;
};
// in : an exchange that writes. out: kept with it, until it is asked for another machine
const written_block &block_of(const machine &of, const exchange &seen);

// The head of a reading of the read block.
struct read_head {
    bool whole = false;      // the block's counters agree
    bool nc_alarm = false;   // by the handshake register
    unsigned handshake = 0;  // its register; 0: there is none
    std::uint16_t control = 0, heartbeat = 0;
    bool enables() const { return (control & 1u) != 0; }
    bool resets() const { return (control & 4u) != 0; }
    bool permits() const { return (control & 8u) != 0; }
    bool references(const machine &of) const;
};
bool is_reading(const machine &of, const exchange &seen);
bool is_read_back(const machine &of, const exchange &seen);
bool is_refused_read_back(const machine &of, const exchange &seen);
read_head head_of(const machine &of, const exchange &seen);
// out: a signal of a reading, in its unit
double signal_in(const machine &of, const fakeplc::shown_signal &signal, const exchange &seen);
// Calls take(name, value) for each signal of a reading that has its reply.
void each_signal(const machine &of, const exchange &seen,
                 const std::function<void(const std::string &, double)> &take);
// in : entries: a list of a snapshot. out: this member of the one of that name, if it is a number
std::optional<double> number_at(const nlohmann::json &entries, const std::string &name,
                                const char *key);
// out: CRC-32 of a coefficient file, as the box prints it
std::string crc_of(const std::string &text);
// out: how far such a value may be beyond the range of its signal, and the box takes it
double at_a_limit(double value);

// out: what the PLC applies to a channel by a reading, in µm; NaN: it does not say
double applied_in(const machine &of, std::size_t channel, const exchange &seen);
std::vector<double> all_applied_in(const machine &of, const exchange &seen);  // by channel

// The longest time from a step of the box to the sending of what it made, by the faults of the run:
// 0 if no fault makes calls or threads slow, `never` if one of them has no bound.
time_ns longest_lag(const run &of);
// Whether files of rows may lack some, or get other columns.
bool may_lack_rows(const run &of);
// The longest way to zero by the file's own rates: of each channel from its limit, or from least_um
// if that is further, as an output that the file before it allowed may be.
time_ns ramp_ns(const machine &facts, double least_um);
// Whether the run draws a kind of fault.
bool draws(const run &of, fault_kind kind);
// out: the others may contradict this sensor; its lags follow what they predict then
bool may_be_doubted(const run &of, const std::string &signal);
bool draws_any(const run &of, std::initializer_list<fault_kind> kinds);
// Whether faults leave unknown which readings, files and time a box has.
bool hides_exchanges(const run &of);
// Whether a box makes each of its steps in time, with the one file that the machine began with.
bool is_steady(const run &of);
// Whether a measurement by hand comes to the box in time: the thread that looks for one waits for
// disks, and asks the wall clock.
bool hears_measurements(const run &of);

}  // namespace compbox::world
