// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/evaluate.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "host-tools/coefficients/evaluate_remarks.h"
#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/signals/plausible.h"
#include "firmware/wire/number.h"
}

namespace compbox::coefficients {

namespace {

constexpr int64_t start_us = 1000000;  // box time of the first row
constexpr double longest_gap_s = 86400.0;
constexpr float largest_value = 1e9f;  // docs/coefficient-file.md: signals lie within ±1e9
constexpr uint16_t enabled = 1u << 0, permit_resume = 1u << 3;

// out: the configuration with every measured signal as a physical value from a sensor of the box.
// Ranges, rates, ages and lead are unchanged; the registers' quantisation is omitted. raw: models
// without lead, at any value that the loader permits for a signal.
cb_config for_samples(const cb_config &file, bool raw) {
    cb_config config = file;
    for (const unsigned i : measured_signals(config)) {
        config.signals[i].source = CB_SOURCE_CAN;
        config.signals[i].type = CB_NUMBER_FLOAT32;
        config.signals[i].scale = 1.0f;
        config.signals[i].zero = 0.0f;
        if (!raw) continue;
        config.signals[i].min = -largest_value;
        config.signals[i].max = largest_value;
        config.signals[i].max_rate_per_s = 0.0f;
    }
    if (raw) config.lead_us = config.lead_measured = 0;
    return config;
}

// A box with a PLC that is always connected, enabled and referenced, and accepts every write.
class box_on_table {
  public:
    box_on_table(const cb_config &file, bool raw)
        : measured_(measured_signals(file)), box_(std::make_unique<cb_box>()) {
        box_->config = for_samples(file, raw);
        cb_box_start(box_.get());
        inputs_.read_ok = true;
        inputs_.sample_count = static_cast<uint8_t>(measured_.size());
    }

    const cb_box &box() const { return *box_; }
    const cb_outputs &outputs() const { return outputs_; }

    void set_values(const std::vector<double> &values) {
        for (unsigned i = 0; i < inputs_.sample_count; ++i) {
            inputs_.samples[i].signal = static_cast<uint8_t>(measured_[i]);
            inputs_.samples[i].raw = static_cast<float>(values[i]);
        }
    }

    void settle(int64_t now_us) {
        prepare(now_us);
        cb_box_settle(box_.get(), &inputs_, now_us, &outputs_);
        apply();
        remember();
    }

    // Cycles between two rows have the values of the first, without motion; step_on_row undoes the
    // effect on lags.
    void hold_until(int64_t row_us) {
        while (row_us - box_->life.now_us > box_->config.period_us) {
            step(box_->life.now_us + box_->config.period_us);
        }
    }

    // A plausible value follows the value of the last row, not its copies in the cycles between. So
    // rate and velocity are those from row to row, and lags follow the straight line between rows
    // in one exact step, as in training (host-tools/training/lagged.cpp). A sigma is of this row.
    void step_on_row(int64_t row_us) {
        bool follows[CB_MAX_SIGNALS] = {};
        for (std::size_t k = 0; k < measured_.size(); ++k) {
            follows[measured_[k]] = follows_last_row(k, row_us);
        }
        for (unsigned i = 0; i < box_->config.lags_count; ++i) {
            const unsigned lag = box_->config.lags[i];
            follows[lag] = follows[box_->config.signals[lag].lag_of];
        }
        for (unsigned i = 0; i < box_->config.signals_count; ++i) {
            if (!follows[i]) continue;
            box_->signals[i] = last_row_[i];
            box_->bank.value[i] = last_bank_.value[i];
            box_->bank.time_us[i] = last_bank_.time_us[i];
        }
        for (unsigned i = 0; i < box_->config.bank_lags_count; ++i) {
            if (follows[cb_bank_key_of(&box_->config, i).signal])
                box_->bank.lags[i] = last_bank_.lags[i];
        }
        box_->sigma.begun = false;
        step(row_us);
        remember();
    }

  private:
    bool follows_last_row(std::size_t sample, int64_t row_us) const {
        const unsigned i = measured_[sample];
        const cb_signal_config &signal = box_->config.signals[i];
        const float value = inputs_.samples[sample].raw;
        const float elapsed_s = static_cast<float>(row_us - last_row_[i].time_us) * 1e-6f;
        return last_row_[i].known && cb_signal_in_range(&signal, value) &&
               !cb_signal_too_fast(&signal, value - last_row_[i].value, elapsed_s);
    }

    void prepare(int64_t now_us) {
        const cb_plc_config &plc = box_->config.plc;
        inputs_.read_us = now_us;
        inputs_.registers[plc.control] =
            static_cast<uint16_t>(enabled | permit_resume | plc.referenced_mask);
        ++inputs_.registers[plc.plc_heartbeat];
        for (unsigned i = 0; i < inputs_.sample_count; ++i) inputs_.samples[i].time_us = now_us;
    }

    void step(int64_t now_us) {
        prepare(now_us);
        cb_box_step(box_.get(), &inputs_, now_us, &outputs_);
        apply();
        inputs_.last_write = CB_TRANSFER_OK;
    }

    // The PLC applies the written values and returns them in the next reading.
    void apply() {
        for (unsigned i = 0; i < box_->config.channels_count; ++i) {
            const cb_channel_config &channel = box_->config.channels[i];
            if (!channel.has_applied) continue;
            const auto type = static_cast<cb_number_type>(channel.type);
            std::copy_n(outputs_.registers + channel.reg, cb_number_registers(type),
                        inputs_.registers + channel.applied_reg);
        }
    }

    void remember() {
        inputs_.last_write = CB_TRANSFER_OK;
        std::copy(std::begin(box_->signals), std::end(box_->signals), std::begin(last_row_));
        last_bank_ = box_->bank;
    }

    std::vector<unsigned> measured_;
    std::unique_ptr<cb_box> box_;
    cb_inputs inputs_ = {};
    cb_outputs outputs_ = {};
    cb_signal_state last_row_[CB_MAX_SIGNALS] = {};
    cb_bank_state last_bank_ = {};
};

std::vector<std::size_t> signal_columns(const cb_config &config,
                                        const formats::csv_table &samples) {
    std::vector<std::size_t> columns;
    for (const unsigned i : measured_signals(config)) {
        columns.push_back(samples.column(config.signals[i].name));
    }
    return columns;
}

// out: microseconds since the first row. Throws input_error if times do not ascend.
std::vector<int64_t> row_times(const formats::csv_table &samples,
                               const std::vector<double> &time_s) {
    std::vector<int64_t> times;
    for (std::size_t r = 0; r < time_s.size(); ++r) {
        const double since_first_s = time_s[r] - time_s[0];
        const double gap_s = r == 0 ? 0.0 : time_s[r] - time_s[r - 1];
        if (gap_s > longest_gap_s) {
            throw input_error(samples.file, samples.lines[r], 0,
                              "time_s is more than a day after the row before");
        }
        const bool falls = gap_s < 0.0;  // the gap may exceed the range of an integer
        times.push_back(falls ? 0 : static_cast<int64_t>(std::llround(since_first_s * 1e6)));
        if (r > 0 && (falls || times[r] <= times[r - 1])) {
            throw input_error(samples.file, samples.lines[r], 0,
                              "time_s must rise by at least a microsecond from row to row");
        }
    }
    return times;
}

std::string channel_column(const cb_config &config, unsigned channel) {
    return fmt::format("comp_{}_um", config.channels[channel].name);
}

std::vector<std::string> column_names(const cb_config &config) {
    std::vector<std::string> names{"time_s"};
    for (unsigned i = 0; i < config.outputs_count; ++i) names.push_back(config.outputs[i].name);
    for (unsigned i = 0; i < config.channels_count; ++i) {
        names.push_back(channel_column(config, i));
    }
    return names;
}

// in : written value, units * scale in float32
// out: the units times the decimal scale of the file: -0.99, not -0.98999995
float written_um(const cb_channel_config &channel, float output_um) {
    if (!cb_number_is_integer(static_cast<cb_number_type>(channel.type))) return output_um;
    const double units = std::nearbyint(static_cast<double>(output_um / channel.scale));
    return static_cast<float>(units * std::stod(fmt::format("{}", channel.scale)));
}

std::vector<adapted_term> adapted_terms(const cb_config &config) {
    std::vector<adapted_term> all;
    for (unsigned i = 0; i < config.adapts_count; ++i) {
        const cb_term_config &term = config.terms[config.adapts[i]];
        const unsigned channel = cb_adapt_channel(&term.as.adapt);
        adapted_term one = {config.outputs[term.first_output].name,
                            config.outputs[term.as.adapt.output].name,
                            {},
                            {}};
        if (channel != CB_NONE) one.channels.push_back(channel_column(config, channel));
        all.push_back(one);
    }
    return all;
}

// out: standard deviation of the term with this index in adapts, at its model's value of this row
float sigma_of_adapted(const cb_box &box, unsigned index) {
    return cb_probe_sigma(&box.config, index, &box.probes[index], &box.sigma, box.outputs,
                          box.life.now_us);
}

// out: of each output, by its model's own statement; NaN: there is none
std::vector<float> own_sigmas(const cb_box &box) {
    std::vector<float> all;
    for (unsigned i = 0; i < box.config.outputs_count; ++i) {
        const cb_sigma sigma = cb_sigma_of(&box.config, &box.sigma, static_cast<uint8_t>(i));
        all.push_back(sigma.model != 0 ? cb_sigma_um(&sigma) : std::nanf(""));
    }
    return all;
}

// out: outputs after a step; a zero is never negative
std::vector<float> row_of(const box_on_table &table, bool raw) {
    const cb_box &box = table.box();
    std::vector<float> row(box.outputs, box.outputs + box.config.outputs_count);
    for (unsigned i = 0; i < box.config.channels_count; ++i) {
        row.push_back(raw ? box.channels[i].wanted_um
                          : written_um(box.config.channels[i], table.outputs().channel_um[i]));
    }
    for (float &value : row) value += 0.0f;
    return row;
}

}  // namespace

evaluation evaluate(const cb_config &config, const formats::csv_table &samples, bool raw) {
    evaluation result;
    result.names = column_names(config);
    result.time_s = samples.values("time_s");
    result.adapted = adapted_terms(config);
    const auto columns = signal_columns(config, samples);
    const auto times = row_times(samples, result.time_s);
    box_on_table table(config, raw);
    row_watcher watch(config, samples);
    std::vector<double> values(columns.size());
    for (std::size_t r = 0; r < times.size(); ++r) {
        const int64_t row_us = start_us + times[r];
        if (r > 0) table.hold_until(row_us);
        for (std::size_t c = 0; c < columns.size(); ++c) values[c] = samples.rows[r][columns[c]];
        table.set_values(values);
        watch.begin_row(table.box());
        if (r == 0) {
            table.settle(row_us);
        } else {
            table.step_on_row(row_us);
        }
        if (r == 0 && !raw) watch.require_steady_state(table.box(), values);
        watch.look(r, table.box(), values);
        result.rows.push_back(row_of(table, raw));
        result.sigma_um.push_back(own_sigmas(table.box()));
        for (unsigned i = 0; i < config.adapts_count; ++i) {
            result.adapted[i].sigma_um.push_back(sigma_of_adapted(table.box(), i));
        }
    }
    result.remarks = watch.remarks(raw);
    return result;
}

std::string evaluation_csv(const evaluation &result) {
    std::string text;
    for (const auto &name : result.names) text += (text.empty() ? "" : ",") + name;
    text += '\n';
    for (std::size_t r = 0; r < result.rows.size(); ++r) {
        text += fmt::format("{}", result.time_s[r]);
        for (const float value : result.rows[r]) text += fmt::format(",{}", value);
        text += '\n';
    }
    return text;
}

}  // namespace compbox::coefficients
