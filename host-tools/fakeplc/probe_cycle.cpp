// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/probe_cycle.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "host-tools/fakeplc/duties.h"

namespace compbox::fakeplc {

probe_cycle::probe_cycle(const twin::twin_probe &kind, std::vector<placed_probe> probes,
                         std::uint64_t seed, std::int64_t now_us)
    : kind_(kind),
      probes_(std::move(probes)),
      noise_(seed, "touch probe"),
      value_um_(probes_.size(), 0.0),
      count_(probes_.size(), 0),
      standing_since_us_(now_us),
      counted_us_(now_us),
      interval_due_us_(now_us + to_us(kind.interval_s)) {}

bool probe_cycle::order(const std::string &axis, double off_um) {
    for (std::size_t p = 0; p < probes_.size(); ++p) {
        if (probes_[p].axis != axis) continue;
        waiting_.push_back({p, off_um});
        return true;
    }
    return false;
}

// [probe] The value in one scan, its count in the next: a box that reads in between has the old
// count with the new value, and never a new count with the old value.
void probe_cycle::scan(const probe_scan &now, const std::function<twin::xyz()> &true_error_um) {
    if (counting_) {
        count();
        counted_us_ = now.now_us;
        standing_since_us_ = now.now_us;
        return;
    }
    if (!now.standing) standing_since_us_ = now.now_us;
    begin(now);
    if (running_.empty() || now.now_us - standing_since_us_ < to_us(kind_.duration_s)) return;
    measure(true_error_um());
}

// Chooses the next cycle: one on command, on the box's request, or at the end of an interval.
void probe_cycle::begin(const probe_scan &now) {
    if (!running_.empty()) return;
    if (!now.requested) repeats_ = 0;
    if (!waiting_.empty()) {
        running_ = {waiting_.front()};
        waiting_.erase(waiting_.begin());
        repeats_ = 0;
    } else if (now.requested && repeats_ < most_repeats && !last_.empty()) {
        if (now.now_us - counted_us_ < to_us(kind_.duration_s)) return;
        running_ = last_;
        for (auto &one : running_) one.off_um = 0.0;
        ++repeats_;
        events_.push_back("the box asks for another probe");
    } else if (kind_.interval_s > 0.0 && now.now_us >= interval_due_us_) {
        for (std::size_t p = 0; p < probes_.size(); ++p) running_.push_back({p, 0.0});
        interval_due_us_ = now.now_us + to_us(kind_.interval_s);
        repeats_ = 0;
    }
}

void probe_cycle::measure(const twin::xyz &error_um) {
    for (const auto &one : running_) {
        double um = error_um[probes_[one.probe].direction] + one.off_um;
        um += kind_.sigma_um * noise_.normal();
        const bool wrong = noise_.uniform() < kind_.wrong_fraction;
        if (wrong) um += noise_.uniform() < 0.5 ? -kind_.wrong_um : kind_.wrong_um;
        value_um_[one.probe] = um;
    }
    counting_ = true;
}

void probe_cycle::count() {
    for (const auto &one : running_) {
        ++count_[one.probe];
        ++measurements_;
        events_.push_back(fmt::format("probe {} {:.3f} um count {}", probes_[one.probe].axis,
                                      value_um_[one.probe], count_[one.probe]));
    }
    last_ = std::exchange(running_, {});
    counting_ = false;
}

void probe_cycle::restart() {
    waiting_.clear();
    running_.clear();
    last_.clear();
    counting_ = false;
}

std::optional<double> probe_cycle::shown(const std::string &signal) const {
    for (std::size_t p = 0; p < probes_.size(); ++p) {
        if (probes_[p].value == signal) return value_um_[p];
        if (probes_[p].count == signal) return count_[p];
    }
    return std::nullopt;
}

bool probe_cycle::measured(const std::string &value) const {
    return counting_ && std::any_of(running_.begin(), running_.end(), [&](const auto &one) {
               return probes_[one.probe].value == value;
           });
}

std::vector<std::string> probe_cycle::take_events() {
    return std::exchange(events_, {});
}

}  // namespace compbox::fakeplc
