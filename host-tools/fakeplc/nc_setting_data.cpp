// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/nc_setting_data.h"

#include <algorithm>
#include <cmath>

namespace compbox::fakeplc {

namespace {

constexpr double um_per_mm = 1e3;
constexpr double reach_mm = 5.0;  // a change of slope is weighted by its effect over this distance

// out: the share of a step of cost_um that costs at most budget_um
double affordable(double cost_um, double budget_um) {
    return cost_um > budget_um ? budget_um / cost_um : 1.0;
}

}  // namespace

nc_setting_data::nc_setting_data(const nc_interface &nc, const std::vector<taken_channel> &channels,
                                 std::uint64_t seed)
    : nc_(nc),
      written_(channels.size(), false),
      last_set_mm_(channels.size(), 0.0),
      held_(channels.size()),
      known_(channels.size()),
      applied_(channels.size()),
      random_(seed, "FB3 PUT") {
    for (const auto &channel : channels) tangent_.push_back(channel.tangent.has_value());
}

// [steps] The reference is written first and changes the correction at the position by (old slope)
// x (its step). The value then leaves an error of (step of the slope) x (distance from the new
// reference). The set is exact at the axis position, not at the reference, because an intermediate
// slope has a large effect far from the reference.
correction nc_setting_data::planned(const correction &held, const correction &wanted,
                                    double position_mm, double way_mm, double tear_um) {
    correction set = held;
    const double half_um = 0.5 * tear_um;
    const double step_mm = wanted.reference_mm - held.reference_mm;
    const double step_um = um_per_mm * std::fabs(held.slope * step_mm);
    const double lag_um = um_per_mm * std::fabs(held.slope * way_mm);
    const double share = affordable(step_um, std::max(half_um, lag_um));
    set.reference_mm = share < 1.0 ? held.reference_mm + share * step_mm : wanted.reference_mm;
    const double turn = wanted.slope - held.slope;
    const double turn_um = um_per_mm * std::fabs(turn * (position_mm - set.reference_mm));
    const double part = affordable(turn_um, half_um);
    set.slope = part < 1.0 ? held.slope + part * turn : wanted.slope;
    set.um = wanted.at_um(position_mm) - um_per_mm * set.slope * (position_mm - set.reference_mm);
    return set;
}

// [deadband] The PLC writes if the NC's correction near the axis position is wrong by the deadband,
// or if the reference is so far away that moving it has an effect. It also writes once at its
// start, because setting data survive a power-off.
bool nc_setting_data::is_due(std::size_t c, const correction &wanted, double position_mm) const {
    if (!written_[c]) return true;
    const correction &held = known_[c];
    const double off_um = wanted.at_um(position_mm) - held.at_um(position_mm);
    const double turned_um = um_per_mm * (wanted.slope - held.slope) * reach_mm;
    const double behind_um = um_per_mm * held.slope * (wanted.reference_mm - held.reference_mm);
    return std::fabs(off_um) + std::fabs(turned_um) >= nc_.deadband_um ||
           std::fabs(behind_um) >= 0.5 * nc_.tear_um;
}

std::int64_t nc_setting_data::put_us() {
    const double share = random_.uniform();
    return std::llround(1e6 *
                        (nc_.put_shortest_s + share * (nc_.put_longest_s - nc_.put_shortest_s)));
}

// A request, its completion and the next request take separate scans.
void nc_setting_data::scan(const std::vector<correction> &wanted,
                           const std::vector<std::optional<double>> &position_mm,
                           std::int64_t now_us) {
    applied_ = wanted;
    if (job_) {
        if (job_->next != end) return;
        known_[job_->channel] = job_->set;
        job_.reset();
        return;
    }
    for (std::size_t i = 0; i < held_.size(); ++i) {
        const std::size_t c = (next_ + i) % held_.size();
        const double at_mm = position_mm[c].value_or(wanted[c].reference_mm);
        if (!is_due(c, wanted[c], at_mm)) continue;
        const double way_mm = std::fabs(at_mm - last_set_mm_[c]);
        const bool in_steps = tangent_[c] && written_[c];
        const correction set =
            in_steps ? planned(known_[c], wanted[c], at_mm, way_mm, nc_.tear_um) : wanted[c];
        job_ = job{c, set, tangent_[c] ? reference : value, now_us + put_us()};
        written_[c] = true;
        last_set_mm_[c] = at_mm;
        next_ = c + 1;
        return;
    }
}

// [order] Reference, value, slope.
void nc_setting_data::write_one() {
    correction &held = held_[job_->channel];
    const bool last = job_->next == slope || !tangent_[job_->channel];
    if (job_->next == reference) held.reference_mm = job_->set.reference_mm;
    if (job_->next == value) held.um = job_->set.um;
    if (job_->next == slope) held.slope = job_->set.slope;
    job_->next = last ? end : static_cast<variable>(job_->next + 1);
    job_->due_us += put_us();
}

void nc_setting_data::cycle(std::int64_t now_us) {
    while (job_ && job_->next != end && job_->due_us <= now_us) write_one();
}

void nc_setting_data::restart_plc() {
    job_.reset();
    next_ = 0;
    written_.assign(written_.size(), false);
}

}  // namespace compbox::fakeplc
