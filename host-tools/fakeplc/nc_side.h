// SPDX-License-Identifier: MIT
// The way of a compensation from the PLC program into the NC: what the PLC does in a scan and what
// the NC does with it in an interpolation cycle. One implementation for each nc_way.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/fakeplc/duties.h"
#include "host-tools/fakeplc/profile.h"

namespace compbox {

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
    // What the NC has of each channel, this moment.
    virtual const std::vector<correction> &held() const = 0;

    // What the PLC returns as applied: what it handed over.
    virtual const std::vector<correction> &applied() const = 0;
    // The handshake register (docs/coefficient-file.md); 0 where there is none.
    virtual std::uint16_t handshake() const { return 0; }
    // The NC's alarm, in words; "": none.
    virtual std::string alarm() const { return {}; }
    virtual void reset() {}
    // The PLC starts anew; the NC keeps what it has.
    virtual void restart_plc() {}
};

std::unique_ptr<nc_side> make_nc_side(const nc_interface &nc, const register_map &map,
                                      std::uint64_t seed);

}  // namespace compbox
