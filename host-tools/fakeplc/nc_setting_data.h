// SPDX-License-Identifier: MIT
// SINUMERIK: the PLC writes setting data by FB3 PUT, one axis after the other, and of an axis one
// variable after the other: SD43920 P0, SD43900 K0, SD43910 tan beta. Interpolation cycles fall
// between them, so the NC may compute with a set that is half old and half new.
//
// So that this does not show, the PLC program moves reference and slope in steps (planned()).
#pragma once

#include "host-tools/fakeplc/nc_side.h"
#include "host-tools/twin/random.h"

namespace compbox::fakeplc {

class nc_setting_data : public nc_side {
  public:
    nc_setting_data(const nc_interface &nc, const std::vector<taken_channel> &channels,
                    std::uint64_t seed);

    void scan(const std::vector<correction> &wanted,
              const std::vector<std::optional<double>> &position_mm, std::int64_t now_us) override;
    void cycle(std::int64_t now_us) override;
    const std::vector<correction> &held() const override { return held_; }
    const std::vector<correction> &applied() const override { return applied_; }
    void restart_plc() override;

    // in : held: the set in the NC; wanted: its target; an axis at position_mm that has moved
    // way_mm since its last set
    // out: the next set, to be written in the order reference, value, slope. Meanwhile the
    // correction at position_mm stays within half of tear_um of its old or new value; on a moving
    // axis within slope x way_mm, the lag of a value without a slope. The complete set is exact at
    // position_mm.
    static correction planned(const correction &held, const correction &wanted, double position_mm,
                              double way_mm, double tear_um);

    // A PUT in progress; the variables before `next` are in the NC.
    enum variable { reference, value, slope, end };
    struct job {
        std::size_t channel;
        correction set;
        variable next;
        std::int64_t due_us;
    };
    const std::optional<job> &running() const { return job_; }

  private:
    bool is_due(std::size_t c, const correction &wanted, double position_mm) const;
    std::int64_t put_us();
    void write_one();

    nc_interface nc_;
    std::vector<bool> tangent_, written_;
    std::vector<double> last_set_mm_;
    std::vector<correction> held_;             // in the NC
    std::vector<correction> known_, applied_;  // the PLC's copy of the NC's values; its targets
    std::optional<job> job_;
    std::size_t next_ = 0;  // the channel to check first
    twin::random_stream random_;
};

}  // namespace compbox::fakeplc
