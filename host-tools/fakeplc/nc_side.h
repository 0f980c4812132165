// SPDX-License-Identifier: MIT
// Transfer of a compensation from the PLC program to the NC: the part of a PLC scan and the part of
// an interpolation cycle. One implementation for each nc_way.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/duties.h"
#include "host-tools/fakeplc/profile.h"

namespace compbox::fakeplc {

class nc_side {
  public:
    virtual ~nc_side() = default;

    // [hand-over] A scan of the PLC at now_us: wanted and position_mm as in plc_duties, of each
    // channel.
    virtual void scan(const std::vector<correction> &wanted,
                      const std::vector<std::optional<double>> &position_mm,
                      std::int64_t now_us) = 0;
    // An interpolation cycle of the NC at now_us.
    virtual void cycle(std::int64_t now_us) = 0;
    // out: the NC's present value of each channel
    virtual const std::vector<correction> &held() const = 0;

    // out: the value that the PLC reports as applied
    virtual const std::vector<correction> &applied() const = 0;
    // out: the handshake register (docs/coefficient-file.md); 0 without one
    virtual std::uint16_t handshake() const { return 0; }
    // out: text of the NC's alarm; "": none
    virtual std::string alarm() const { return {}; }
    virtual void reset() {}
    // Restarts the PLC; the NC keeps its values.
    virtual void restart_plc() {}
};

std::unique_ptr<nc_side> make_nc_side(const nc_interface &nc, const register_map &map,
                                      std::uint64_t seed);

}  // namespace compbox::fakeplc
