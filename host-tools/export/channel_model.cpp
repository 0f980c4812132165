// SPDX-License-Identifier: MIT
#include "host-tools/export/channel_model.h"

#include <cstring>

#include "host-tools/coefficients/load.h"
#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/terms/kinds.h"
#include "firmware/terms/terms.h"
}

namespace compbox::exports {

namespace {

// All texts in a value, however deep.
void texts_of(const json &value, std::set<std::string> &texts) {
    if (value.is_string()) texts.insert(value.get<std::string>());
    if (!value.is_structured()) return;
    for (const auto &item : value) texts_of(item, texts);
}

// The texts of a term that may name signals or outputs of other terms.
std::set<std::string> references_of(const json &term) {
    std::set<std::string> texts;
    for (const auto &[key, value] : term.items()) {
        if (key != "name" && key != "type" && key != "outputs") texts_of(value, texts);
    }
    if (term["type"] == "volumetric" && !term.contains("positions")) {
        texts.insert({"X", "Y", "Z"});
    }
    return texts;
}

std::vector<std::string> outputs_of(const json &term) {
    if (!term.contains("outputs")) return {term["name"].get<std::string>()};
    return term["outputs"].get<std::vector<std::string>>();
}

// The signal that a chain of lags begins with.
unsigned source_of(const cb_config &config, unsigned signal) {
    while (config.signals[signal].source == CB_SOURCE_LAG) signal = config.signals[signal].lag_of;
    return signal;
}

// The signals behind a term, through other terms and lags.
std::set<unsigned> signals_behind(const json &terms, const cb_config &config, const json &term) {
    std::set<unsigned> found;
    for (const auto &name : references_of(term)) {
        for (unsigned i = 0; i < config.signals_count; ++i) {
            if (name == config.signals[i].name) found.insert(source_of(config, i));
        }
        for (const auto &other : terms) {
            const auto names = outputs_of(other);
            if (std::find(names.begin(), names.end(), name) == names.end()) continue;
            for (const unsigned i : signals_behind(terms, config, other)) found.insert(i);
        }
    }
    return found;
}

}  // namespace

channel_model::channel_model(const std::string &path)
    : path_(path), json_(read_json(path)), config_(coefficients::load_coefficients(path)) {
    depends_.resize(config_->outputs_count);
    for (const auto &term : json_["terms"]) {
        const auto signals = signals_behind(json_["terms"], *config_, term);
        for (const auto &name : outputs_of(term)) {
            for (unsigned i = 0; i < config_->outputs_count; ++i) {
                if (name == config_->outputs[i].name) depends_[i] = signals;
            }
        }
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
    throw input_error(path_, 0, 0, "has no signal '" + name + "' to be set (it has " + there + ")");
}

bool channel_model::is_position(unsigned signal) const {
    const char *unit = config_->signals[signal].unit;
    for (unsigned t = 0; t < config_->terms_count; ++t) {
        const auto &term = config_->terms[t];
        if (term.type == CB_TERM_VOLUMETRIC && term.as.volumetric.tool_length == signal)
            return false;
    }
    return std::strcmp(unit, "mm") == 0 || std::strcmp(unit, "deg") == 0;
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
    cb_terms_evaluate(config_.get(), signals.data(), states.data(), &counters, 0.0f, raw);
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
