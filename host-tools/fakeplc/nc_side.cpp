// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/nc_side.h"

#include "host-tools/fakeplc/nc_handshake.h"
#include "host-tools/fakeplc/nc_setting_data.h"

namespace compbox::fakeplc {

namespace {

// A control that applies the PLC's values within the scan.
class nc_direct : public nc_side {
  public:
    explicit nc_direct(std::size_t channels) : held_(channels) {}

    void scan(const std::vector<correction> &wanted, const std::vector<std::optional<double>> &,
              std::int64_t) override {
        held_ = wanted;
    }
    void cycle(std::int64_t) override {}
    const std::vector<correction> &held() const override { return held_; }
    const std::vector<correction> &applied() const override { return held_; }

  private:
    std::vector<correction> held_;
};

}  // namespace

std::unique_ptr<nc_side> make_nc_side(const nc_interface &nc, const register_map &map,
                                      std::uint64_t seed) {
    switch (nc.way) {
        case nc_way::setting_data: {
            nc_interface own = nc;
            own.deadband_um = map.deadband_um.value_or(nc.deadband_um);
            return std::make_unique<nc_setting_data>(own, map.channels, seed);
        }
        case nc_way::handshake:
            return std::make_unique<nc_handshake>(nc, map.channels, map.axes_at_once, seed);
        case nc_way::direct:
            break;
    }
    return std::make_unique<nc_direct>(map.channels.size());
}

}  // namespace compbox::fakeplc
