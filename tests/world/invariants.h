// SPDX-License-Identifier: MIT
// What must hold at every moment, by what the outside sees: requests and replies, the PLC's
// registers, files, log, exit codes. Each invariant is a class with some of these calls and a line
// in all_invariants(). It shares no code with the box.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "host-tools/fakeplc/plc.h"
#include "tests/world/blocks.h"
#include "tests/world/computer.h"
#include "tests/world/files.h"
#include "tests/world/machine.h"
#include "tests/world/scheduler.h"

namespace compbox::world {

class run;

// A request of the box as the PLC saw it.
struct exchange {
    time_ns now, sent;                   // by the PLC's end of the wire, and by the box's
    time_ns duration;                    // of the PLC, until it sends the reply; never: it is lost
    int function;                        // 3, 16, 23
    int exception;                       // of the reply; 0: none
    std::vector<std::uint16_t> read;     // the read block or, by FC3, the write block read back
    int read_start;                      // or, of FC16, the start of what is written
    std::vector<std::uint16_t> written;  // the write block; empty: nothing was written

    // What block_of() made of `written` for this machine: many invariants ask for it.
    mutable const machine *decoded_for = nullptr;
    mutable written_block decoded = {};
};

// A request of the box at the moment at which it is sent, and the one before it on this connection
// or line.
struct question {
    bool on_line;    // a serial one
    bool first;      // of this connection, or since the adapter was plugged in
    bool settled;    // the reply to the one before it has been sent, or on a line has come
    bool was_probe;  // by docs/rtu.md; one that was refused proves nothing
    bool is_probe;
    bool was_damaged_reading;  // its reply came on time with a wrong check sum
    bool is_the_same;          // as the one before
    bool is_reading;           // of the whole read block, on a line
};

// Registers that the box reads of a module at a time: its unit, and the first one.
struct module_turn {
    int unit;
    unsigned start;
    bool operator<(const module_turn &other) const {
        return std::tie(unit, start) < std::tie(other.unit, other.start);
    }
};

// What came of the request before.
struct module_reply {
    bool none;    // no request was sent before, since the adapter was plugged in
    bool prompt;  // whole, and on time by any deadline
    bool heard;   // something came, which may also be late
};

class invariant {
  public:
    invariant(run &of, const char *of_name) : name(of_name), of_(of) {}
    virtual ~invariant() = default;

    // Each comes in an event, in the order of time.
    virtual void exchanged(const exchange &) {}
    virtual void asked(const question &) {}
    // The box asks a module on its bus. prompt: the one asked before has replied; first: since the
    // adapter was plugged in.
    virtual void module_asked(const module_turn &, const module_reply & /* before */) {}
    // It sends on a serial line, so long behind the last byte there; `silence` ends a frame.
    virtual void line_asked(time_ns /* quiet */, time_ns /* silence */) {}
    virtual void reply_torn(time_ns) {}  // a part has come, and this long before the rest
    virtual void scanned(const fakeplc::plc_state &) {}   // a scan of the PLC program
    virtual void sampled(const std::string &, double) {}  // a signal on a wire of its own was sent
    virtual void logged(const std::string &) {}           // a line of stderr
    virtual void file_written(const std::string &, const node &) {}
    virtual void shown(const nlohmann::json &) {}            // a snapshot that is whole
    virtual void reported(const nlohmann::json &) {}         // statistics that are
    virtual void rename_failed(const std::string &) {}       // to this path
    virtual void supervised(const std::string &) {}          // see computer
    virtual void started() {}                                // the daemon
    virtual void taken(const machine &, const machine &) {}  // the daemon took the second file
    virtual void ticked() {}                                 // the daemon waits for its next tick
    virtual void ended(const ending &) {}
    virtual void faults_ended() {}  // no fault comes any more
    virtual void finished() {}      // the run is over

    const char *const name;

  protected:
    // Reports a violation at this time. A run ends at its first one.
    void violated(const std::string &words);
    // What the daemon left at its end; null: it has not finished it.
    nlohmann::json finished_statistics() const;
    nlohmann::json finished_snapshot() const;
    // in : of: with a revision. out: the file that it names; nullptr: not known
    const machine *file_named_in(const nlohmann::json &of) const;
    run &of_;
};

using invariants = std::vector<std::unique_ptr<invariant>>;

void add_bounds(run &of, invariants &all);      // invariants_bounds.cpp
void add_modes(run &of, invariants &all);       // invariants_modes.cpp
void add_process(run &of, invariants &all);     // invariants_process.cpp
void add_files(run &of, invariants &all);       // invariants_files.cpp
void add_foreign(run &of, invariants &all);     // invariants_foreign.cpp
void add_reloads(run &of, invariants &all);     // invariants_reloads.cpp
void add_models(run &of, invariants &all);      // invariants_models.cpp
void add_adapted(run &of, invariants &all);     // invariants_adapted.cpp
void add_reference(run &of, invariants &all);   // invariants_reference.cpp
void add_causes(run &of, invariants &all);      // invariants_causes.cpp
void add_doubts(run &of, invariants &all);      // invariants_doubts.cpp
void add_rows(run &of, invariants &all);        // invariants_rows.cpp
void add_shown(run &of, invariants &all);       // invariants_shown.cpp
void add_events(run &of, invariants &all);      // invariants_events.cpp
void add_supervised(run &of, invariants &all);  // invariants_supervised.cpp
void add_contents(run &of, invariants &all);    // invariants_contents.cpp
void add_wire(run &of, invariants &all);        // invariants_wire.cpp
void add_counters(run &of, invariants &all);    // invariants_counters.cpp
void add_lags(run &of, invariants &all);        // invariants_lags.cpp
void add_loading(run &of, invariants &all);     // invariants_loading.cpp

invariants all_invariants(run &of);

}  // namespace compbox::world
