// SPDX-License-Identifier: MIT
// The control and its PLC program, without any wire: interpolation cycles of the NC, scans of the
// PLC, and the duties towards a box that compensates (docs/fakeplc.md). Time is passed in.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/modbus.h"
#include "host-tools/fakeplc/register_map.h"
#include "host-tools/twin/machine.h"
#include "host-tools/twin/motion.h"

namespace compbox {

// What the PLC knows after a scan; for the log and for `status`.
struct plc_state {
    double time_s = 0.0;
    xyz position_mm = {};              // as the control shows it
    std::vector<double> commanded_um;  // of each channel, as the box wrote it
    std::vector<double> applied_um;    // of each channel, as the PLC hands it to the NC
    xyz displacement_um = {};          // of the tool, by what has entered the axes
    xyz error_before_um = {};          // the twin's truth without …
    xyz error_after_um = {};           // … and with the compensation
    std::uint16_t control = 0, status = 0, plc_heartbeat = 0, box_heartbeat = 0;
    bool box_alive = false;
    std::vector<std::string> events;  // in words, since the scan before
};

class fake_plc {
  public:
    // At power-on, now_us: registers zero, axes at start_mm and not referenced. Throws input_error
    // when a channel moves no axis of the twin.
    fake_plc(const twin_config &config, const register_map &map, const plc_profile &profile,
             std::int64_t now_us);

    // Runs every interpolation cycle and scan that is due by now_us; on_scan, where given, is
    // called after each scan.
    template <typename visitor>
    void run_to(std::int64_t now_us, visitor on_scan);
    void run_to(std::int64_t now_us) {
        run_to(now_us, [](const plc_state &) {});
    }
    // In real time, before run_to: behind by more than a second (a process that was stopped), the
    // control goes on from now instead of catching up.
    void forget_standstill(std::int64_t now_us);
    // When the next cycle or scan is due.
    std::int64_t next_due_us() const;

    // A Modbus request to its reply (modbus.h).
    byte_string answer(const byte_string &request, bool torn = false);

    // The state after the last scan.
    const plc_state &state() const { return state_; }
    const register_map &map() const { return map_; }
    const twin_machine &twin() const { return twin_; }
    const nc_motion &nc() const { return nc_; }
    bool moving() const { return nc_.moving(); }

    // For runs that ask the twin themselves: state() without its errors, which cost time.
    void leave_truth_out() { with_truth_ = false; }

    // By hand, from the next scan on. enable and reference given by hand also end their part of
    // the start-up.
    void set_enable(bool on);
    void set_referenced(bool on);
    void set_permit(bool on);
    void press_reset();                // sets the bit for half a second
    void freeze_nc(bool frozen);       // NC coupling lost: positions and heartbeat stand still
    void move(const twin_step &step);  // queued; throws input_error
    // The PLC shows this instead of the true value of a signal; false when there is no such one.
    bool force_signal(const std::string &name, double value);
    bool release_signal(const std::string &name);

    // An event for the log, from outside.
    void note(const std::string &words) { event(words); }

  private:
    void nc_cycle();
    void scan();
    void start_up();
    void watch_box();
    void take_over();
    void show();
    void note_changes();
    void start_program_once_active();
    void keep_state();
    void keep_truth();
    bool may_apply() const;
    double signal_value(const shown_signal &signal) const;
    void write_number(int address, const number_format &format, double raw);
    std::uint16_t control_word() const;
    void event(const std::string &words) { events_.push_back(words); }

    twin_config config_;
    register_map map_;
    plc_profile profile_;
    twin_machine twin_;
    nc_motion nc_;
    modbus::bank registers_;
    std::vector<std::optional<std::size_t>> axis_of_channel_;
    // What a channel writes, and what the PLC makes of it: K0, and of a tangent slope and P0.
    struct taken {
        double um = 0.0, slope = 0.0, reference_mm = 0.0;
    };
    taken read_value(const taken_channel &channel) const;
    void take_channel(std::size_t c, bool torn, double dt_s);
    std::vector<double> commanded_um_, applied_um_;
    std::vector<taken> commanded_, applied_;
    std::map<std::string, double> forced_;
    plc_state state_;
    std::vector<std::string> events_;

    std::int64_t start_us_, nc_due_us_, scan_due_us_;
    std::int64_t nc_cycle_us_, scan_us_;
    std::int64_t since_start_us_ = 0;  // time of the scan
    std::int64_t reset_until_us_ = -1;
    std::int64_t box_moved_us_ = 0;  // when the box's heartbeat last changed
    long long nc_cycles_ = 0, nc_cycles_shown_ = 0;
    bool enable_ = false, referenced_ = false, permit_ = true, frozen_ = false;
    bool with_truth_ = true;
    bool enable_by_hand_ = false, reference_by_hand_ = false;
    bool box_seen_ = false, box_alive_ = false, program_started_ = false;
    std::uint16_t plc_heartbeat_ = 0, box_heartbeat_ = 0, status_ = 0;
    std::uint16_t last_noted_status_ = 0, last_noted_control_ = 0;
};

template <typename visitor>
void fake_plc::run_to(std::int64_t now_us, visitor on_scan) {
    while (next_due_us() <= now_us) {
        if (nc_due_us_ <= scan_due_us_) {
            nc_cycle();
        } else {
            scan();
            on_scan(state_);
        }
    }
}

}  // namespace compbox
