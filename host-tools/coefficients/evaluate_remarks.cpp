// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/evaluate_remarks.h"

#include <cstdint>
#include <iterator>

#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/signals/plausible.h"
}

namespace compbox::coefficients {

namespace {

bool is_lag(const cb_signal_config &signal) {
    return signal.source == CB_SOURCE_LAG;
}

// Counters of the box about models and outputs, with their text. --raw has no limits.
constexpr struct {
    std::uint32_t cb_counters::*counter;
    const char *text;
    bool in_raw;
} watched_counters[] = {
    {&cb_counters::outside_curve,
     "beyond the ends of a curve, which keeps its value there: ", true},
    {&cb_counters::models_extrapolated, "a model beyond the range it was trained on: ", true},
    {&cb_counters::models_weakened, "… so far beyond it that its outputs fade: ", true},
    {&cb_counters::outputs_limited, "a channel held at its limit_um: ", false},
    {&cb_counters::pairs_limited,
     "the motors of a pair held within their max_difference_um: ", false},
};

bool accepted(const cb_box &box, unsigned signal) {
    return box.signals[signal].known && box.signals[signal].time_us == box.life.now_us;
}

// Adds a remark for a column of a computed signal, which is not an input.
void remark_computed_columns(const cb_config &config, const formats::csv_table &samples,
                             std::vector<std::string> &remarks) {
    for (unsigned i = 0; i < config.signals_count; ++i) {
        const cb_signal_config &signal = config.signals[i];
        if (!is_lag(signal) || samples.find(signal.name) < 0) continue;
        remarks.push_back(
            fmt::format("column {} is not used: the box computes {} itself, a lag of {}",
                        signal.name, signal.name, config.signals[signal.lag_of].name));
    }
}

}  // namespace

std::vector<unsigned> measured_signals(const cb_config &config) {
    std::vector<unsigned> measured;
    for (unsigned i = 0; i < config.signals_count; ++i) {
        if (!is_lag(config.signals[i])) measured.push_back(i);
    }
    return measured;
}

void row_count::add(long line, const std::string &what) {
    if (count++ == 0) first_line = line, detail = what;
}

std::string row_count::text() const {
    return fmt::format("{}{}, first line {}{}", count, count == 1 ? " row" : " rows", first_line,
                       detail.empty() ? "" : ": " + detail);
}

row_watcher::row_watcher(const cb_config &config, const formats::csv_table &samples)
    : config_(config),
      samples_(samples),
      measured_(measured_signals(config)),
      held_(measured_.size()),
      missing_(measured_.size()),
      doubted_(measured_.size()) {}

std::string row_watcher::implausible_text(std::size_t sample, double value) const {
    const cb_signal_config &signal = config_.signals[measured_[sample]];
    return fmt::format("{} (plausible: {} to {})", value, signal.min, signal.max);
}

void row_watcher::require_steady_state(const cb_box &box, const std::vector<double> &values) const {
    for (std::size_t i = 0; i < measured_.size(); ++i) {
        const cb_signal_config &signal = config_.signals[measured_[i]];
        if (!signal.essential || accepted(box, measured_[i])) continue;
        throw input_error(samples_.file, samples_.lines[0], 0,
                          "the first row has no value before it to hold, but {} is implausible "
                          "there: {}; start at a row that the box accepts, or use --raw",
                          signal.name, implausible_text(i, values[i]));
    }
}

// Counts the row for each signal without a value of its own, and for each counter that rose in it.
void row_watcher::look(std::size_t row, const cb_box &box, const std::vector<double> &values) {
    for (std::size_t i = 0; i < measured_.size(); ++i) {
        const unsigned signal = measured_[i];
        const auto seen = static_cast<float>(values[i]);
        if (box.signals[signal].doubted) {
            doubted_[i].add(samples_.lines[row],
                            fmt::format("{} where they predict {:.4g}", values[i],
                                        box.signals[signal].expected));
        }
        if (accepted(box, signal) && cb_signal_in_range(&config_.signals[signal], seen)) continue;
        auto &kind = box.signals[signal].known ? held_ : missing_;
        kind[i].add(samples_.lines[row], implausible_text(i, values[i]));
    }
    for (std::size_t k = 0; k < std::size(watched_counters); ++k) {
        const auto counter = watched_counters[k].counter;
        if (box.counters.*counter != before_.*counter) counted_[k].add(samples_.lines[row], "");
    }
    if (box.mode.mode == CB_MODE_ACTIVE) return;
    not_active_.add(samples_.lines[row], fmt::format("{}, {}", cb_mode_name(box.mode.mode),
                                                     cb_reason_text(box.mode.reason)));
}

std::vector<std::string> row_watcher::remarks(bool raw) const {
    std::vector<std::string> all;
    remark_computed_columns(config_, samples_, all);
    for (std::size_t i = 0; i < measured_.size(); ++i) {
        const std::string name = config_.signals[measured_[i]].name;
        if (missing_[i].count > 0) {
            all.push_back(
                fmt::format("{} implausible and no value before it, its terms are left out: {}",
                            name, missing_[i].text()));
        }
        if (doubted_[i].count > 0) {
            all.push_back(fmt::format("{} doubted, the other sensors contradict it: {}", name,
                                      doubted_[i].text()));
        }
        if (held_[i].count == 0) continue;
        all.push_back(name +
                      (raw ? " implausible, the box would hold the last value: "
                           : " implausible, last value held: ") +
                      held_[i].text());
    }
    for (std::size_t k = 0; k < std::size(watched_counters); ++k) {
        if (counted_[k].count == 0 || (raw && !watched_counters[k].in_raw)) continue;
        all.push_back(watched_counters[k].text + counted_[k].text());
    }
    if (!raw && not_active_.count > 0) all.push_back("box not ACTIVE: " + not_active_.text());
    return all;
}

}  // namespace compbox::coefficients
