// SPDX-License-Identifier: MIT
#include "host-tools/export/channel_model.h"

#include <cstring>

#include "host-tools/coefficients/load.h"
#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/config/config.h"
#include "firmware/terms/terms.h"
}

namespace compbox::exports {

namespace {

// out: the signal at the beginning of a chain of lags
unsigned source_of(const cb_config &config, unsigned signal) {
    while (config.signals[signal].source == CB_SOURCE_LAG) signal = config.signals[signal].lag_of;
    return signal;
}

}  // namespace

channel_model::channel_model(const std::string &path)
    : path_(path), json_(formats::read_json(path)), config_(coefficients::load_coefficients(path)) {
    depends_.resize(config_->outputs_count);
    for (unsigned t = 0; t < config_->terms_count; ++t) {  // each after those that it uses
        const auto &term = config_->terms[t];
        std::set<unsigned> found;
        unsigned count = 0;
        const std::uint8_t *one = cb_term_signals(config_.get(), &term, &count);
        for (; count > 0; --count, ++one) {
            if (*one != CB_NONE) found.insert(source_of(*config_, *one));
        }
        one = cb_term_used(&term, &count);
        for (; count > 0; --count, ++one) {
            if (*one != CB_NONE) found.insert(depends_[*one].begin(), depends_[*one].end());
        }
        for (unsigned k = 0; k < term.outputs; ++k) depends_[term.first_output + k] = found;
    }
}

void channel_model::set(values &at, unsigned signal, double value) const {
    at[signal] = value;
    for (unsigned i = 0; i < config_->lags_count; ++i) {
        const unsigned lag = config_->lags[i];
        const auto &own = config_->signals[lag];
        at[lag] = own.power == 2 ? at[own.lag_of] * at[own.lag_of] : at[own.lag_of];
    }
}

channel_model::~channel_model() = default;

channel_model::values channel_model::middle() const {
    values at(config_->signals_count, 0.0);
    for (unsigned i = 0; i < config_->signals_count; ++i) {
        const auto &signal = config_->signals[i];
        if (signal.source != CB_SOURCE_LAG) set(at, i, 0.5 * (signal.min + signal.max));
    }
    return at;
}

unsigned channel_model::signal(const std::string &name) const {
    std::string there;
    for (unsigned i = 0; i < config_->signals_count; ++i) {
        if (config_->signals[i].source == CB_SOURCE_LAG) continue;
        if (name == config_->signals[i].name) return i;
        there += (there.empty() ? "" : ", ") + std::string(config_->signals[i].name);
    }
    throw input_error(path_, 0, 0, "has no signal '{}' to be set (it has {})", name, there);
}

bool channel_model::is_position(unsigned signal) const {
    const auto &one = config_->signals[signal];
    for (const auto &term : json_["terms"]) {
        if (term.value("tool_length", "") == one.name) return false;
    }
    return std::strcmp(one.unit, "mm") == 0 || std::strcmp(one.unit, "deg") == 0;
}

bool channel_model::has_branches(unsigned channel, unsigned signal) const {
    for (unsigned t = 0; t < config_->terms_count; ++t) {
        const auto &term = config_->terms[t];
        if (!cb_term_has_branches(&term) || term.as.curve.signal != signal) continue;
        values at = middle();
        const auto forward = outputs(at, 1), backward = outputs(at, -1);
        const auto &one = config_->channels[channel];
        for (unsigned i = 0; i < one.sum_count; ++i) {
            const bool depends = depends_[one.sum[i]].count(signal) > 0;
            if (depends &&
                (one.sum[i] == term.first_output || forward[one.sum[i]] != backward[one.sum[i]])) {
                return true;
            }
        }
    }
    return false;
}

std::vector<double> channel_model::outputs(const values &at, int direction) const {
    std::vector<cb_signal_state> signals(CB_MAX_SIGNALS);
    std::vector<cb_term_state> states(CB_MAX_TERMS);
    cb_counters counters{};
    float raw[CB_MAX_OUTPUTS] = {};
    for (unsigned i = 0; i < config_->signals_count; ++i) {
        signals[i].value = signals[i].used = static_cast<float>(at[i]);
        signals[i].known = signals[i].fresh = signals[i].settled = true;
    }
    for (unsigned t = 0; t < config_->terms_count && direction != 0; ++t) {
        if (!cb_term_has_branches(&config_->terms[t])) continue;
        const double x = at[config_->terms[t].as.curve.signal];
        states[t].directed = true;
        states[t].direction = {static_cast<float>(x), static_cast<float>(direction),
                               static_cast<std::int8_t>(direction)};
    }
    const auto bank = std::make_unique<cb_bank_state>();
    cb_banks_follow(config_.get(), signals.data(), bank.get());  // steady state
    cb_terms_evaluate(config_.get(), signals.data(), bank.get(), states.data(), &counters, 0.0f,
                      raw);
    return std::vector<double>(raw, raw + config_->outputs_count);
}

double channel_model::wanted_um(unsigned channel, const values &at) const {
    const auto all = outputs(at);
    const auto &one = config_->channels[channel];
    double sum = 0.0;
    for (unsigned i = 0; i < one.sum_count; ++i) sum += all[one.sum[i]];
    return -sum;
}

}  // namespace compbox::exports
