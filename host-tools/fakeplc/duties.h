// SPDX-License-Identifier: MIT
// What the PLC program owes the machine whatever the box does: watchdog, slope limit, zero at start
// (docs/fakeplc.md). docs/plc/ has the same program for real controls.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/register_map.h"
#include "host-tools/twin/twin_file.h"

namespace compbox {

// The low byte of the box's status register (docs/DESIGN.md).
namespace box_mode {
enum : unsigned { standby = 0, active = 1, hold = 2, ramp = 3, fault = 4, stopped = 5 };
}

// What an axis is to be moved by: um where it stands at reference_mm, and along a slope around it.
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
    // From power-on at now_us: everything is zero, and the box has not been seen. sizes_um: of each
    // channel, the largest offset that is taken over, >= 0.
    plc_duties(const register_map &map, const twin_plc &limits, std::vector<double> sizes_um,
               std::int64_t now_us);

    // One scan, dt_s after the one before, at now_us. registers: all of the PLC's; permitted: the
    // control is enabled and referenced; position_mm: of the axis of each channel that has one.
    void scan(const std::vector<std::uint16_t> &registers, bool permitted,
              const std::vector<std::optional<double>> &position_mm, std::int64_t now_us,
              double dt_s);

    // Of each channel: what the box wrote last in a block that was whole, and what is to be handed
    // to the NC.
    const std::vector<correction> &commanded() const { return commanded_; }
    const std::vector<correction> &wanted() const { return wanted_; }
    bool box_alive() const { return box_alive_; }
    // The box said nothing for watchdog_s, and not because it was stopped in good order.
    bool box_lost() const { return box_lost_; }
    bool torn_for_long() const { return torn_for_long_; }
    // The newest whole block has a value that is not a number, and was not taken over.
    bool not_a_number() const { return !numbers_; }
    // Of each channel: the box asks for more than the size, and the size holds it.
    const std::vector<bool> &limited() const { return limited_; }
    // How often that began since power-on, all channels together.
    int times_limited() const { return times_limited_; }
    const std::vector<double> &sizes_um() const { return sizes_um_; }
    std::uint16_t status() const { return status_; }
    unsigned mode() const { return status_ & 0xFFu; }
    std::uint16_t box_heartbeat() const { return box_heartbeat_; }
    // What happened since it was asked last, in words.
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
    twin_plc limits_;
    std::vector<double> sizes_um_;
    std::vector<correction> commanded_, wanted_;
    std::vector<bool> limited_;
    int times_limited_ = 0;
    double line_left_s_ = 0.0;  // of the way to the newest block
    std::int64_t box_moved_us_ = 0, whole_us_ = 0, numbers_us_ = 0;
    bool scanned_ = false, box_seen_ = false, box_alive_ = false, box_lost_ = false,
         torn_for_long_ = false, numbers_ = true;
    std::uint16_t box_heartbeat_ = 0, status_ = 0;
    std::vector<std::string> events_;
};

}  // namespace compbox
