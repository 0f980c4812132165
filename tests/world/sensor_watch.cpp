// SPDX-License-Identifier: MIT
#include "tests/world/sensor_watch.h"

#include <algorithm>
#include <cmath>

namespace compbox::world {

namespace {

constexpr time_ns settles_ns = 8 * second;  // predictions of sensors that predict each other

std::size_t ones_of(unsigned bits) {
    std::size_t count = 0;
    for (; bits != 0; bits &= bits - 1) ++count;
    return count;
}

}  // namespace

sensor_watch::sensor_watch(const nlohmann::json &section, time_ns period_ns)
    : names_(section.at("signals").get<std::vector<std::string>>()),
      center_(section.at("center").get<std::vector<double>>()),
      precision_(section.at("precision").get<std::vector<std::vector<double>>>()),
      threshold_(section.at("threshold")),
      pass_ns_(second + 2 * period_ns + 20 * ms),
      late_ns_(static_cast<time_ns>(names_.size() + 3) * period_ns),
      sensors_(names_.size()) {
    // A pass counts for the time since the one before, and for half of after_s at most.
    const double after_s = section.value("after_s", 120.0);
    const double least_s = std::min(1.0, after_s / 2);
    const double most_s = std::min(1e-9 * static_cast<double>(pass_ns_), after_s / 2);
    const auto passes = [](double s, double of_s) {
        return static_cast<time_ns>(std::ceil(s / of_s - 1e-6));
    };
    doubt_least_ns_ = (passes(after_s, most_s) - 1) * second;
    doubt_most_ns_ = passes(after_s, least_s) * pass_ns_ + late_ns_;
    trust_least_ns_ = (passes(10 * after_s, most_s) - 1) * second;
    trust_most_ns_ = (passes(10 * after_s, least_s) + 1) * pass_ns_ + late_ns_;
}

std::size_t sensor_watch::count(trust is) const {
    return static_cast<std::size_t>(std::count_if(
        sensors_.begin(), sensors_.end(), [is](const sensor &one) { return one.is == is; }));
}

// Nothing is known any more but that a sensor that agrees for long enough is trusted.
void sensor_watch::forget(time_ns now) {
    for (sensor &one : sensors_) {
        become(one, trust::either, now);
        one.quiet = one.wrong = one.off = one.agrees = {};
    }
    counts_ = false;
}

void sensor_watch::become(sensor &of, trust is, time_ns now) {
    if (of.is == is) return;
    if (is == trust::either) {
        of.was_doubted = of.is == trust::doubted;
        of.either_ns = now;
        most_ += !of.was_doubted;
    }
    if (is == trust::doubted) {
        least_ += !of.was_doubted;
        most_ += of.was_doubted;
        of.near_ns = never;
    }
    if (is == trust::sure) of.was_doubted = false;
    of.is = is;
    of.changed_ns = now;
}

void sensor_watch::look(time_ns now, const std::vector<reading> &readings) {
    if (begins_) {
        for (sensor &one : sensors_) one = {};
        past_.clear();
        least_ = most_ = 0;
        counts_ = true;
        begun_ns_ = now;
    } else if (now - looked_ns_ > late_ns_) {
        forget(now);
    }
    begins_ = false;
    looked_ns_ = now;
    keep(now, readings);
    for (std::size_t j = 0; j < sensors_.size(); ++j) {
        if (!readings[j].fresh && !(readings[j].stale && sensors_[j].was_stale)) stopped_ns_ = now;
        sensors_[j].was_stale = readings[j].stale;
        take_use(sensors_[j], readings[j], now);
    }
    judge(readings, now);
    for (std::size_t j = 0; j < sensors_.size(); ++j) step(j, now);
}

// The moments of the newest pass, and what may be late.
void sensor_watch::keep(time_ns now, const std::vector<reading> &readings) {
    moment is = {now, 0, {}, {}};
    for (std::size_t j = 0; j < readings.size(); ++j)
        is.apart.push_back(std::isnan(readings[j].value) ? 0 : readings[j].value - center_[j]);
    for (const reading &one : readings) is.near.push_back(one.near);
    std::vector<double> sorted = is.apart;
    std::sort(sorted.begin(), sorted.end());
    is.median = sorted[sorted.size() / 2];
    for (double &one : is.apart) one -= is.median;
    past_.push_back(is);
    while (now - past_.front().at_ns > pass_ns_ + late_ns_) past_.pop_front();
}

// What the box compares the others with.
void sensor_watch::take_use(sensor &of, const reading &seen, time_ns now) const {
    const use used = seen.stale || of.is == trust::doubted ? use::predicted
                     : seen.fresh && of.is == trust::sure  ? use::reads
                                                           : use::either;
    if (used != of.used) of.used_ns = now;
    of.used = used;
}

// out: where the others' intervals let the prediction of a sensor be, less its center
interval sensor_watch::predicted(std::size_t j, const std::vector<interval> &others) const {
    interval sum;
    for (std::size_t k = 0; k < others.size(); ++k) {
        if (k == j) continue;
        const double weight = -precision_[j][k] / precision_[j][j];
        const double one = weight * others[k].low, two = weight * others[k].high;
        sum.low += std::min(one, two);
        sum.high += std::max(one, two);
    }
    return sum;
}

// The others' prediction at one of the newest passes. The reading too, where it may not be doubted,
// or just became it. All of its range, where another one is predicted too.
interval sensor_watch::followed(std::size_t j, const reading &seen) const {
    const sensor &own = sensors_[j];
    bool is_alone = true;
    for (std::size_t k = 0; k < sensors_.size(); ++k)
        is_alone = is_alone &&
                   (k == j || (sensors_[k].is == trust::sure && sensors_[k].used == use::reads));
    if (!is_alone) return {seen.min, seen.max};
    interval all = interval::none();
    for (const moment &was : past_) {
        std::vector<interval> others;
        for (std::size_t k = 0; k < sensors_.size(); ++k)
            others.push_back(interval{was.apart[k], was.apart[k]}.moved(was.median, was.near[k]));
        const interval one = predicted(j, others).moved(center_[j], 1e-3);
        all.take(
            {std::clamp(one.low, seen.min, seen.max), std::clamp(one.high, seen.min, seen.max)});
    }
    if (own.is != trust::doubted || looked_ns_ - own.changed_ns < 2 * (pass_ns_ + late_ns_))
        all.take(interval{seen.value, seen.value}.moved(0, seen.near));
    return all;
}

// out: |z| of each sensor, if the box predicts these of them, whenever it did so last. Between two
// such moments only the median moves by much, and that hardly changes the differences.
std::vector<interval> sensor_watch::compared(const std::vector<reading> &readings,
                                             unsigned predicts) const {
    const std::size_t n = sensors_.size();
    const moment &is = past_.back();
    const bool several = (predicts & (predicts - 1)) != 0;
    interval median = {is.median, is.median}, newest = median;  // of a pass, of late_ns_
    for (const moment &was : past_) {
        median.take(was.median);
        if (is.at_ns - was.at_ns <= late_ns_) newest.take(was.median);
    }
    std::vector<interval> exact, around;
    for (std::size_t k = 0; k < n; ++k) {
        interval apart = {is.apart[k], is.apart[k]};
        exact.push_back(apart.moved(is.median, readings[k].near));
        for (const moment &was : past_) apart.take(was.apart[k]);
        around.push_back(apart.moved(is.median, readings[k].near));
    }
    std::vector<interval> used = around, there = exact;
    for (int round = 0; round < (several ? 12 : 1); ++round) {
        for (std::size_t k = 0; k < n; ++k) {
            if (!(predicts >> k & 1u)) continue;
            interval by = predicted(k, used).moved(0, median.width());
            by = {std::clamp(by.low, readings[k].min - center_[k], readings[k].max - center_[k]),
                  std::clamp(by.high, readings[k].min - center_[k], readings[k].max - center_[k])};
            used[k] = by;
            // Sensors that predict each other settle in some passes.
            if (several && is.at_ns - sensors_[k].changed_ns < settles_ns) used[k].take(around[k]);
            there[k] = used[k];
        }
    }
    std::vector<interval> z;
    for (std::size_t j = 0; j < n; ++j) {
        // A doubted sensor is compared within a pass, with the others at its begin.
        const bool reads = !(predicts >> j & 1u);
        const interval by = predicted(j, reads ? there : used);
        const double late = reads ? 0 : newest.width(), own = std::sqrt(precision_[j][j]);
        const double least = exact[j].low - by.high - late, most = exact[j].high - by.low + late;
        z.push_back({own * std::max({0.0, least, -most}), own * std::max(most, -least)});
    }
    return z;
}

// What holds for sure, for how long: whichever of the unsure sensors the box predicts.
void sensor_watch::judge(const std::vector<reading> &readings, time_ns now) {
    const std::size_t n = sensors_.size();
    unsigned predicts = 0, doubtful = 0;
    std::vector<std::size_t> unsure;
    for (std::size_t j = 0; j < n; ++j) {
        const sensor &one = sensors_[j];
        const bool changes = now - one.used_ns <= pass_ns_ + late_ns_;
        // The box predicts one without a value too, and that is no doubt.
        if (one.is != trust::sure && readings[j].fresh && !changes) doubtful |= 1u << j;
        if (one.used == use::either || changes)
            unsure.push_back(j);
        else if (one.used == use::predicted)
            predicts |= 1u << j;
    }
    for (sensor &one : sensors_) one.now = {};
    for (unsigned choice = 0; choice < 1u << unsure.size(); ++choice) {
        unsigned chosen = predicts;
        for (std::size_t i = 0; i < unsure.size(); ++i)
            if (choice >> i & 1u) chosen |= 1u << unsure[i];
        if (3 * ones_of(chosen & doubtful) <= n)
            add_choice(readings, chosen, compared(readings, chosen));
    }
    const std::size_t suspects = n - count(trust::sure);
    for (std::size_t j = 0; j < n; ++j) {
        sensor &one = sensors_[j];
        const std::size_t others = suspects - (one.is != trust::sure);
        one.quiet.go_on(one.now.quiet, now);
        one.wrong.go_on(one.now.wrong && one.is != trust::doubted && 3 * (others + 1) <= n &&
                            now - begun_ns_ > pass_ns_ && now - stopped_ns_ > pass_ns_ + late_ns_,
                        now);
        one.off.go_on(one.now.off, now);
        one.agrees.go_on(one.now.agrees && one.now.safe && one.is != trust::sure, now);
        if (!one.now.safe) one.changed_ns = now;
        if (one.quiet.since == never && one.loud_ns == never) one.loud_ns = now;
        if (one.quiet.lasts(now, pass_ns_)) one.loud_ns = never;
        if (one.off.since == never && one.near_ns == never) one.near_ns = now;
        if (one.off.lasts(now, pass_ns_)) one.near_ns = never;
    }
}

// in : |z| of each sensor if the box predicts the chosen ones
void sensor_watch::add_choice(const std::vector<reading> &readings, unsigned chosen,
                              const std::vector<interval> &z) {
    constexpr double beyond = 1.01, within = 0.99;
    for (std::size_t j = 0; j < z.size(); ++j) {
        sensor::verdicts &is = sensors_[j].now;
        const reading &seen = readings[j];
        if (chosen >> j & 1u) {
            is.off = is.off && (seen.stale || z[j].low > beyond * threshold_);
            is.agrees = is.agrees && seen.fresh && z[j].high < within * threshold_ / 2;
            is.wrong = is.wrong && seen.fresh;  // without a value it contradicts nothing
            continue;
        }
        bool worst = true, below = false;
        for (std::size_t k = 0; k < z.size(); ++k) {
            if (k == j || (chosen >> k & 1u)) continue;
            worst = worst && z[j].low > beyond * z[k].high;
            below = below || z[k].low > beyond * z[j].high;
        }
        const bool quiet = seen.stale || z[j].high < within * threshold_;
        is.quiet = is.quiet && quiet;
        is.safe = is.safe && (quiet || below);
        is.wrong = is.wrong && seen.fresh && worst && z[j].low > beyond * threshold_;
    }
}

void sensor_watch::step(std::size_t j, time_ns now) {
    sensor &one = sensors_[j];
    const bool may_have_room = 3 * (count(trust::doubted) + 1) <= sensors_.size();
    if (one.is == trust::sure && may_have_room && !one.now.safe && one.loud_ns != never &&
        now - one.loud_ns >= doubt_least_ns_)
        become(one, trust::either, now);
    if (one.is == trust::doubted && one.near_ns != never && now - one.near_ns >= trust_least_ns_)
        become(one, trust::either, now);
    if (one.is != trust::either) return;
    if (one.wrong.lasts(now, doubt_most_ns_)) return become(one, trust::doubted, now);
    if (one.agrees.lasts(now, trust_most_ns_)) return become(one, trust::sure, now);
    // One that was doubted may be trusted by now, and may then be doubted again.
    if (now - one.either_ns > (one.was_doubted ? doubt_least_ns_ : trust_least_ns_))
        counts_ = false;
}

}  // namespace compbox::world
