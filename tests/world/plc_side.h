// SPDX-License-Identifier: MIT
// The PLC, its NC and the axes (host-tools/fakeplc) behind a TCP socket of the world, and the
// operator who moves the axes.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "host-tools/fakeplc/plc.h"
#include "tests/world/dice.h"
#include "tests/world/machine.h"
#include "tests/world/network.h"

namespace compbox::world {

// A gateway or a faulty server answers in the place of the PLC, or before it.
enum class stray_reply {
    none,
    other_unit,
    other_function,
    shorter,
    longer,
    other_registers,
    fewer_registers,
    miscounted
};

// What happens to a request at the PLC's server.
struct reply_fate {
    time_ns delay_ns = 0;                   // beyond the usual time to answer
    bool ignored = false;                   // not executed, without a reply
    bool lost = false;                      // executed, without a reply
    bool twice = false;                     // another copy comes later
    int exception = 0;                      // not executed; exception code
    bool resets = false;                    // executed, then the connection is reset
    bool torn = false;                      // a reading with two updates of the PLC's block
    stray_reply stray = stray_reply::none;  // comes before the true one, or in its place
};
class plc_faults {
  public:
    virtual ~plc_faults() = default;
    virtual reply_fate at_request(const fakeplc::byte_string &request) = 0;
};

class plc_side : public tcp_peer {
  public:
    plc_side(const machine &of, network &net, std::uint64_t seed);

    fakeplc::fake_plc control;
    plc_faults *faults = nullptr;
    bool serves = true;  // answers requests
    // Its program stands still.
    void stop_program(bool stopped);
    // Switches it off and on after a pause; the box's registers are kept or zero.
    void restart(bool keeps_registers, time_ns pause);
    void close_all();  // resets all connections
    // Otherwise the operator switches enable off and on where the box waits for permission.
    const bool permits_resume;
    // The operator presses reset, and a key that jams keeps the bit until then.
    void hold_reset(time_ns until);
    // Signals and references true, permit on, enable off; it stays off until someone else sets it.
    void put_right();
    int connections_made() const { return connections_made_; }
    int foreign_clients = 0;             // that hold connections
    std::uint16_t heartbeat_offset = 0;  // to the counter of fakeplc
    std::uint16_t unreferenced = 0;      // bits of the control register that readings show as 0
    // Sensors that check each other: how far each is off. They show it from show_redundant() on.
    std::map<std::string, double> sensor_off;
    void show_redundant();
    // Some PLCs apply what was sent so long ago: readings show `applied` of then.
    const time_ns applies_late_ns;
    // out: `applied` is not any more what the PLC did by itself while the box was idle, so long ago
    bool has_followed(time_ns since_idle) const {
        return applies_late_ns == 0 || since_idle > 3 * second;
    }
    bool nc_alarm = false;  // readings show an alarm of the NC, with enable on
    // Readings show these words from an address on; none: the true ones again.
    void show(int address, const std::vector<std::uint16_t> &words);
    time_ns foreign_write_ns = -never;  // when another client wrote last

    // For invariants, each in virtual time.
    std::function<void(time_ns sent, const fakeplc::byte_string &request,
                       const fakeplc::byte_string &reply, time_ns duration)>
        answered;
    std::function<void(const fakeplc::plc_state &)> scanned;
    // By TCP a request came: whether it is the first of its connection, and whether it was sent
    // behind the reply to the one before.
    std::function<void(bool first, bool settled)> asked;

    // Runs NC and PLC program to now.
    void catch_up();
    // out: a register of the PLC; reading it changes nothing
    std::vector<std::uint16_t> registers(int start, int count);
    // A write by another client than the box.
    void write_foreign(int start, const std::vector<std::uint16_t> &values);

    // What one request leads to, on any wire.
    struct served {
        fakeplc::byte_string reply;  // PDU; empty: none
        time_ns duration = 0;        // from the request to the reply
        bool twice = false;
        stray_reply stray = stray_reply::none;
        bool alone = false;  // the stray reply comes, and no other
        bool resets = false;
    };
    served serve(const fakeplc::byte_string &request, time_ns sent);
    // out: a reply that differs from the true one in one place of its form, and mostly in its
    // values
    static fakeplc::byte_string stray_pdu(fakeplc::byte_string reply, stray_reply way);

    bool accepted(const connection_ptr &from) override;
    void received(const connection_ptr &from, const std::string &bytes, time_ns sent) override;
    void closed(const connection_ptr &from, bool reset) override;

  private:
    static std::string stray_frame(fakeplc::byte_string request_frame,
                                   const fakeplc::byte_string &reply, stray_reply way);
    // out: when the first reply is sent
    time_ns answer_frame(const connection_ptr &from, const fakeplc::byte_string &frame,
                         time_ns sent);
    void move_axes();
    void probe();
    void count_others();  // of another probe, from other counts on
    void permit_by_enable();
    void acknowledge_fault();
    void remember_applied(const fakeplc::plc_state &state);
    void pass_65535();
    void disguise(const fakeplc::byte_string &request, fakeplc::byte_string &reply) const;
    void drop_idle_clients(time_ns longest);

    const machine &machine_;
    network &net_;
    dice chance_;
    struct client {
        connection_ptr link;
        fakeplc::byte_string received;
        time_ns heard_ns;
        bool asked = false;
        time_ns settled_ns = 0;  // the reply to the newest request is sent then
        // Of a reply, by function: they come when the next one is awaited.
        std::map<int, std::string> copies = {};
    };
    std::map<int, client> clients_;
    int connections_made_ = 0;
    bool stopped_ = false, put_right_ = false;
    int waits_ = 0;        // looks of the operator at a box that waits for permission …
    int fault_looks_ = 0;  // … and at one in FAULT
    const bool acknowledges_, tries_enable_, jams_;
    bool is_off_ = false;    // enable, by the operator who tries
    time_ns jammed_ns_ = 0;  // the key of reset, until then
    std::map<int, std::vector<std::uint16_t>> shown_;
    struct applied_values {
        double time_s;
        std::vector<double> um;
    };
    std::deque<applied_values> applied_;  // of the scans since then; empty: not late
    std::map<std::string, double> temperatures_;
    dice warmth_;
    double warm_ = 0, warms_by_ = 0;  // what sensors that check each other have in common
    dice prober_, scatter_, late_copies_, passing_, tarrying_;
    const bool tarries_;         // … to close its side
    time_ns served_ns_ = 0;      // the newest request that the PLC answers
    std::uint64_t probing_ = 0;  // what the prober does now
    double probed_um_ = 0;
    double place_um_ = 0;
    std::uint16_t probes_ = 0;
};

}  // namespace compbox::world
