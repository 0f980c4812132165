// SPDX-License-Identifier: MIT
// FANUC: the ladder writes the machine zero-point shift by external data input, one axis after the
// other. It sets ED (the value) and EA (the axis) in one scan and ESTB in the next. EREND confirms;
// then ESTB and EREND are reset, which makes four scans an axis. The axis moves at once. A control
// with the extended shift takes all axes together.
#pragma once

#include "host-tools/fakeplc/nc_side.h"
#include "host-tools/twin/random.h"

namespace compbox::fakeplc {

class nc_handshake : public nc_side {
  public:
    nc_handshake(const nc_interface &nc, const std::vector<taken_channel> &channels,
                 bool axes_at_once, std::uint64_t seed);

    void scan(const std::vector<correction> &wanted,
              const std::vector<std::optional<double>> &position_mm, std::int64_t now_us) override;
    void cycle(std::int64_t now_us) override;
    const std::vector<correction> &held() const override { return held_; }
    const std::vector<correction> &applied() const override { return held_; }
    std::uint16_t handshake() const override;
    std::string alarm() const override { return alarm_; }
    void reset() override { alarm_.clear(); }
    void restart_plc() override;
    // out: ED of each channel at the beginning of a handshake
    const std::vector<long> &data() const { return data_; }

  private:
    enum class step { idle, address, strobe, release };
    void choose(const std::vector<correction> &wanted);
    void take(std::size_t c);

    nc_interface nc_;
    std::vector<double> increment_um_;
    std::vector<std::string> names_;
    bool axes_at_once_;
    std::vector<correction> held_;
    std::vector<long> units_;           // in the NC
    std::vector<long> data_;            // ED of each axis
    std::vector<bool> written_;         // since the PLC started
    std::size_t first_ = 0, last_ = 0;  // the channels of this handshake: [first, last)
    std::size_t next_ = 0;
    step step_ = step::idle;
    bool estb_ = false, erend_ = false;
    int cycles_left_ = 0;
    std::string alarm_;
    twin::random_stream random_;
};

}  // namespace compbox::fakeplc
