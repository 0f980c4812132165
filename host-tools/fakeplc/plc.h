// SPDX-License-Identifier: MIT
// The control, its PLC and the machine, without a wire: interpolation cycles of the NC and scans of
// the PLC (docs/fakeplc.md). duties.h has the duties of the PLC program, nc_side.h the transfer to
// the NC. Time is an argument.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/alarms.h"
#include "host-tools/fakeplc/duties.h"
#include "host-tools/fakeplc/modbus.h"
#include "host-tools/fakeplc/nc_side.h"
#include "host-tools/fakeplc/probe_cycle.h"
#include "host-tools/fakeplc/register_map.h"
#include "host-tools/twin/machine.h"
#include "host-tools/twin/motion.h"
#include "host-tools/twin/process.h"
#include "host-tools/twin/random.h"

namespace compbox::fakeplc {

// State after a scan, for the log and for `status`.
struct plc_state {
    double time_s = 0.0;
    twin::xyz position_mm = {};        // as displayed by the control
    std::vector<double> commanded_um;  // of each channel, as the box wrote it
    std::vector<double> applied_um;    // of each channel, as the PLC hands it to the NC
    std::vector<correction> held;      // of each channel, as the NC has it
    twin::xyz displacement_um = {};    // of the tool, by the compensation in the axes
    twin::xyz error_before_um = {};    // true error without …
    twin::xyz error_after_um = {};     // … and with the compensation
    std::uint16_t control = 0, status = 0, plc_heartbeat = 0, box_heartbeat = 0;
    std::uint16_t handshake = 0;
    int alarms = 0;  // active
    bool box_alive = false;
    std::vector<std::string> events;  // since the previous scan
};

class fake_plc {
  public:
    // State at power-on at now_us: registers zero, axes at start_mm and not referenced. Throws
    // input_error for a channel without an axis of the twin.
    fake_plc(const twin::twin_config &config, const register_map &map, const plc_profile &profile,
             std::int64_t now_us);

    // Runs every interpolation cycle and scan that is due by now_us; on_scan(state()) and
    // on_nc_cycle(), where given, are called after each.
    void run_to(std::int64_t now_us,
                const std::function<void(const plc_state &)> &on_scan = nullptr,
                const std::function<void()> &on_nc_cycle = nullptr);
    // Call in real time before run_to: after a pause of more than a second, as of a stopped
    // process, the control continues from now instead of catching up.
    void forget_standstill(std::int64_t now_us);
    // When the next cycle or scan is due.
    std::int64_t next_due_us() const;

    // A Modbus request to its reply (modbus.h).
    byte_string answer(const byte_string &request, bool torn = false);

    // The state after the last scan.
    const plc_state &state() const { return state_; }
    const register_map &map() const { return map_; }
    const twin::twin_machine &twin() const { return twin_; }
    const twin::nc_motion &nc() const { return nc_; }
    // out: the NC's present value of each channel
    const std::vector<correction> &held() const { return side_->held(); }
    const plc_duties &duties() const { return duties_; }
    const nc_side &side() const { return *side_; }
    const alarm_list &alarms() const { return alarms_; }
    // out: the present state of the machine, for reports: twin().true_error_um(machine_state())
    twin::twin_state machine_state() const;
    bool moving() const { return nc_.moving(); }

    // Leaves the errors out of state(); computing them takes time.
    void leave_truth_out() { with_truth_ = false; }

    // Commands, effective from the next scan. enable and reference also end their part of the
    // start-up.
    void set_enable(bool on);
    void set_referenced(bool on);
    void set_permit(bool on);
    void press_reset();  // sets the bit for half a second and clears alarms that wait for it
    void restart();      // switches the PLC off and on; the NC keeps its values
    void freeze_nc(bool frozen);             // NC coupling lost: positions and heartbeat freeze
    void move(const twin::twin_step &step);  // queued; throws input_error
    // Replaces the measured value of a signal; false for an unknown name.
    bool force_signal(const std::string &name, double value);
    bool release_signal(const std::string &name);
    // Queues a touch-probe cycle towards an axis or channel, wrong by off_um; false if it has no
    // probe.
    bool probe(const std::string &axis, double off_um) { return probes_.order(axis, off_um); }
    const probe_cycle &probes() const { return probes_; }

    // Adds an event to the log.
    void note(const std::string &words) { event(words); }

  private:
    void nc_cycle();
    void enter_compensation();
    void scan();
    void start_up();
    void watch_alarms();
    void watch_sizes();
    void run_probes();
    void show();
    void show_signals();
    void note_changes();
    void start_program_once_active();
    void keep_state();
    void plan_next_scan();
    bool enabled() const { return enable_ && !alarms_.stands("nc-shift"); }
    double seconds_since_start() const { return static_cast<double>(since_start_us_) * 1e-6; }
    void keep_truth();
    double signal_value(const shown_signal &signal) const;
    void write_number(int address, const number_format &format, double raw);
    std::uint16_t control_word() const;
    void event(const std::string &words) { events_.push_back(words); }
    void tell(const std::vector<std::string> &words);

    twin::twin_config config_;
    register_map map_;
    plc_profile profile_;
    twin::twin_machine twin_;
    twin::nc_motion nc_;
    twin::machine_process process_;
    modbus::bank registers_;
    std::vector<std::optional<std::size_t>> axis_of_channel_;
    plc_duties duties_;
    std::unique_ptr<nc_side> side_;
    probe_cycle probes_;
    alarm_list alarms_;
    twin::random_stream jitter_;
    std::map<std::string, double> forced_;
    plc_state state_;
    std::vector<std::string> events_;

    std::int64_t start_us_, nc_due_us_, scan_due_us_;
    std::int64_t nc_cycle_us_, scan_us_;
    std::int64_t scans_ = 0, last_scan_us_;  // clocked scans; actual time of the last one
    std::int64_t clock_us_;                  // when scan 0 was due
    std::int64_t since_start_us_ = 0;        // time of the scan
    std::int64_t power_on_us_ = 0;           // of the PLC, since the start
    std::int64_t reset_until_us_ = -1;
    long long nc_cycles_ = 0, nc_cycles_shown_ = 0;
    bool enable_ = false, referenced_ = false, permit_ = true, frozen_ = false;
    bool with_truth_ = true;
    bool enable_by_hand_ = false, reference_by_hand_ = false;
    bool program_started_ = false;
    std::uint16_t plc_heartbeat_ = 0, read_count_ = 0;
    std::uint16_t last_noted_status_ = 0, last_noted_control_ = 0;
};

}  // namespace compbox::fakeplc
