// SPDX-License-Identifier: MIT
// Duties of the PLC program, independent of the box: watchdog, slope limit, zero at start
// (docs/fakeplc.md). docs/plc/ has the same program for real controls.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/register_map.h"
#include "host-tools/twin/twin_file.h"

namespace compbox::fakeplc {

// out: rounded
std::int64_t to_us(double seconds);

// The low byte of the box's status register (docs/DESIGN.md).
namespace box_mode {
enum : unsigned { standby = 0, active = 1, hold = 2, ramp = 3, fault = 4, stopped = 5 };
const char *name_of(unsigned mode);  // as the box calls it
}  // namespace box_mode

// Correction of an axis: um at reference_mm, and a slope around it.
struct correction {
    double um = 0.0, slope = 0.0, reference_mm = 0.0;

    double at_um(double position_mm) const {
        return um + 1e3 * slope * (position_mm - reference_mm);
    }
};

// held moved towards want by at most step.
double toward(double held, double want, double step);

class plc_duties {
  public:
    // State at power-on at now_us: all values are zero, the box is unknown. sizes_um: largest
    // applied offset of each channel, >= 0.
    plc_duties(const register_map &map, const twin::twin_plc &limits, std::vector<double> sizes_um,
               std::int64_t now_us);

    // One scan at now_us, dt_s after the previous one. registers: all of the PLC's; permitted: the
    // control is enabled and referenced; position_mm: axis position of each channel, if it has one.
    void scan(const std::vector<std::uint16_t> &registers, bool permitted,
              const std::vector<std::optional<double>> &position_mm, std::int64_t now_us,
              double dt_s);

    // By channel: last value of the box in a complete block, and the value for the NC.
    const std::vector<correction> &commanded() const { return commanded_; }
    const std::vector<correction> &wanted() const { return wanted_; }
    bool box_alive() const { return box_alive_; }
    // The box's heartbeat did not change for watchdog_s, and its status was not STOPPED.
    bool box_lost() const { return box_lost_; }
    bool torn_for_long() const { return torn_for_long_; }
    // The newest complete block has a value that is not a number and was rejected.
    bool not_a_number() const { return !numbers_; }
    // By channel: the value of the box exceeds the size and is limited.
    const std::vector<bool> &limited() const { return limited_; }
    // number of such limitations since power-on, all channels
    int times_limited() const { return times_limited_; }
    const std::vector<double> &sizes_um() const { return sizes_um_; }
    std::uint16_t status() const { return status_; }
    unsigned mode() const { return status_ & 0xFFu; }
    std::uint16_t box_heartbeat() const { return box_heartbeat_; }
    // out: events since the last call
    std::vector<std::string> take_events();

  private:
    void watch_box(const std::vector<std::uint16_t> &registers, std::int64_t now_us);
    bool block_is_whole(const std::vector<std::uint16_t> &registers, std::int64_t now_us);
    void take_over(const std::vector<std::uint16_t> &registers, std::int64_t now_us);
    void take_channel(std::size_t c, bool apply, const std::optional<double> &position_mm,
                      double dt_s, double share);
    bool beyond(const correction &line, double position_mm, double size_um) const;
    correction held_to_size(const correction &target, double here_um, double position_mm,
                            double size_um) const;
    void note_limited(std::size_t c, bool limited);
    double share_of_line(double dt_s);

    register_map map_;
    twin::twin_plc limits_;
    std::vector<double> sizes_um_;
    std::vector<correction> commanded_, wanted_;
    std::vector<bool> limited_;
    int times_limited_ = 0;
    double line_left_s_ = 0.0;  // remaining time of the interpolation to the newest block
    std::int64_t box_moved_us_ = 0, whole_us_ = 0, numbers_us_ = 0;
    bool scanned_ = false, box_seen_ = false, box_alive_ = false, box_lost_ = false,
         torn_for_long_ = false, numbers_ = true;
    std::uint16_t box_heartbeat_ = 0, status_ = 0;
    std::vector<std::string> events_;
};

}  // namespace compbox::fakeplc
