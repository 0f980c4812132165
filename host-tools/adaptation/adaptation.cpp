// SPDX-License-Identifier: MIT
#include "host-tools/adaptation/adaptation.h"

#include <algorithm>
#include <cmath>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/formats/numbers.h"
#include "host-tools/formats/probe_names.h"
#include "host-tools/training/bank_sigma.h"

namespace compbox::adaptation {

using training::is_name_of_the_box;
using training::longest_name;
using training::train_result;

namespace {

constexpr std::size_t least_probes = 20;
constexpr double s_of_min = 60.0;
constexpr double wrong_share = 0.05, wrong_um = 100.0;
constexpr std::uint64_t wrong_seeds = 8;  // their figures are of so many draws together
constexpr double shortest_interval_s = 60.0;
constexpr const char *term_suffix = "_adapted";

std::vector<double> intervals_s(const adapt_options &options) {
    std::vector<double> all;
    for (const double minutes : options.intervals_min) all.push_back(minutes * s_of_min);
    return all.empty() ? std::vector<double>{1800.0, 3600.0} : all;
}

// Rows of a model with their predictions for one output, in order of time.
struct predicted_rows {
    std::vector<std::size_t> source, run;
    Eigen::VectorXd error, model;
};

// in : rows of `all` that count; the memory of the whole record is first where rows count twice
// out: the series; the box starts anew where time goes back, and at each run if runs begin at zero
error_series series_of(const train_result &result, const predicted_rows &rows) {
    error_series series;
    for (std::size_t i = 0; i < rows.source.size(); ++i) {
        const auto at = static_cast<Eigen::Index>(i);
        if (i > 0 && rows.source[i] <= rows.source[i - 1]) break;  // the second copy
        const double time_s = result.data.time_s[rows.source[i]];
        const bool other_run = i == 0 || rows.run[i] != rows.run[i - 1];
        const bool goes_back = i == 0 || time_s <= series.time_s.back();
        series.begins.push_back(goes_back || (other_run && result.options.zero_at_start));
        series.time_s.push_back(time_s);
        series.error_um.push_back(rows.error[at]), series.model_um.push_back(rows.model[at]);
        series.run.push_back(rows.run[i]);
    }
    return series;
}

// out: the model's own sigma at rows of its columns, of one output; nothing if it states none
std::vector<cb_sigma> own_sigmas(const train_result &result, std::size_t output,
                                 const Eigen::MatrixXd &x) {
    std::vector<cb_sigma> all;
    if (result.network_better[output] || !training::has_sigma(result)) return all;
    const auto k = static_cast<Eigen::Index>(output);
    const training::bank_sigma sigma = training::sigma_of_bank(result);
    const Eigen::MatrixXd places = training::places_of(sigma, x);
    for (Eigen::Index r = 0; r < places.rows(); ++r) {
        cb_sigma own{};
        own.floor_um = static_cast<float>(sigma.floor_um[k]);
        own.along_um = static_cast<float>(sigma.along_um[k]);
        own.model = 1;
        for (Eigen::Index d = 0; d < places.cols(); ++d) {
            own.place[d] = static_cast<float>(places(r, d));
        }
        all.push_back(own);
    }
    return all;
}

// out: predictions of each row left out, by a model trained without its run; where evidence chose
//      the decay no run was left out, and they are those of the model itself
predicted_rows left_out_rows(const train_result &result, std::size_t output) {
    const auto k = static_cast<Eigen::Index>(output);
    const bool network = result.network_better[output];
    const Eigen::MatrixXd &left_out =
        (network ? result.network : result.linear).left_out_predictions;
    predicted_rows rows;
    rows.source = result.learn.source, rows.run = result.learn.run;
    rows.error = result.learn.y.col(k);
    if (left_out.rows() == 0) {
        rows.model = result.predict(result.chosen, result.learn.x, result.learn).col(k);
        return rows;
    }
    rows.model = left_out.col(k);
    if (!network) return rows;
    rows.error = Eigen::VectorXd(rows.error(result.network_rows));
    rows.source.clear(), rows.run.clear();
    for (const Eigen::Index r : result.network_rows) {
        rows.source.push_back(result.learn.source[static_cast<std::size_t>(r)]);
        rows.run.push_back(result.learn.run[static_cast<std::size_t>(r)]);
    }
    return rows;
}

// out: predictions of the runs held out, as the box would hold and fade them
predicted_rows held_out_rows(const train_result &result, std::size_t output) {
    const auto k = static_cast<Eigen::Index>(output);
    const training::trained_range &range = result.range;
    const Eigen::MatrixXd x = result.options.bank ? result.test_held : range.held(result.test.x);
    const Eigen::MatrixXd free = result.predict(result.chosen, x, result.test);
    predicted_rows rows;
    rows.source = result.test.source, rows.run = result.test.run;
    rows.error = result.test.y.col(k);
    rows.model = range.weight(result.test.x).cwiseProduct(free.col(k));
    return rows;
}

left_figures left_by(const std::vector<double> &left_um) {
    left_figures figures;
    std::vector<double> sizes;
    double sum = 0.0;
    for (const double left : left_um) sizes.push_back(std::fabs(left)), sum += left * left;
    figures.rms_um = std::sqrt(sum / static_cast<double>(left_um.size()));
    figures.p95_um = quantile(sizes, 0.95);
    figures.largest_um = *std::max_element(sizes.begin(), sizes.end());
    return figures;
}

std::vector<double> model_residuals(const error_series &series) {
    std::vector<double> left_um;
    for (std::size_t r = 0; r < series.rows(); ++r) {
        left_um.push_back(series.error_um[r] - series.model_um[r]);
    }
    return left_um;
}

// Up to the next 1, 0.5, 0.05 …: a number that a person can read.
double rounded_up(double value, double step) {
    return std::ceil(value / step - 1e-9) * step;
}

double readable(double value) {
    const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
    return std::round(value / unit) * unit;
}

cb_adapt_settings settings_of(const drift_rates &rates, double bias_max_um, double gain_max,
                              double step_max_um) {
    cb_adapt_settings settings{};
    settings.bias_max_um = static_cast<float>(bias_max_um);
    settings.gain_max = static_cast<float>(gain_max);
    settings.step_max_um = static_cast<float>(step_max_um);
    settings.drift_um_per_sqrt_h = static_cast<float>(rates.drift_um_per_sqrt_h);
    settings.gain_drift_per_sqrt_h = static_cast<float>(rates.gain_drift_per_sqrt_h);
    settings.sigma_um = static_cast<float>(rates.sigma_um);
    settings.min_interval_s = static_cast<float>(shortest_interval_s);
    return settings;
}

// out: what is left with wrong probes, of all draws
std::vector<double> left_with_wrong(const error_series &series, const cb_adapt_settings &settings,
                                    double interval_s) {
    std::vector<double> all;
    for (std::uint64_t seed = 1; seed <= wrong_seeds; ++seed) {
        const probing how{interval_s, wrong_share, wrong_um, false, seed};
        const probed_course one = simulate_probes(series, settings, how);
        all.insert(all.end(), one.left_um.begin(), one.left_um.end());
    }
    return all;
}

// in : settings with all but step_max_um; usual_um: 99 % of the movements without bounds
// out: the step that leaves least, with right probes and with wrong ones, each interval relative to
//      the best at it: a short step keeps wrong probes out, a long one follows real jumps
double choose_step(cb_adapt_settings settings, const error_series &series,
                   const std::vector<double> &every_s, double usual_um) {
    std::vector<double> steps, totals;
    for (double step_um = 1.5 * usual_um; step_um > 0.15 * usual_um; step_um /= 1.25) {
        steps.push_back(readable(std::max(step_um, 0.1)));
    }
    totals.assign(steps.size(), 0.0);
    for (const double interval_s : every_s) {
        std::vector<double> own;
        for (const double step_um : steps) {
            settings.step_max_um = static_cast<float>(step_um);
            const probed_course right = simulate_probes(series, settings, {interval_s});
            own.push_back(left_by(right.left_um).rms_um +
                          left_by(left_with_wrong(series, settings, interval_s)).rms_um);
        }
        const double best = std::max(*std::min_element(own.begin(), own.end()), 1e-6);
        for (std::size_t k = 0; k < steps.size(); ++k) totals[k] += own[k] / best;
    }
    const auto least = std::min_element(totals.begin(), totals.end());
    return steps[static_cast<std::size_t>(least - totals.begin())];
}

// out: settings and reasons from what the model leaves of runs left out
void choose_settings(adapted_output &adapted, const error_series &series,
                     const std::vector<double> &every_s, const adapt_options &options) {
    drift_rates rates = estimate_drift(series, every_s, options.sigma_um);
    for (double drift_rates::*rate :
         {&drift_rates::drift_um_per_sqrt_h, &drift_rates::gain_drift_per_sqrt_h,
          &drift_rates::sigma_um}) {
        rates.*rate = readable(rates.*rate);
    }
    constexpr double no_bound_um = 1e5, no_gain_bound = 10.0;
    const cb_adapt_settings free = settings_of(rates, no_bound_um, no_gain_bound, no_bound_um);
    std::vector<double> moves_um, gains;
    double most_bias_um = 0.0;
    std::size_t probes = 0;
    for (const double interval_s : every_s) {
        const probed_course course = simulate_probes(series, free, {interval_s});
        probes += course.probes;
        moves_um = course.moves_um;  // of the longest interval, which is the last
        gains.insert(gains.end(), course.gains.begin(), course.gains.end());
        most_bias_um = std::max(most_bias_um, course.most_bias_um);
    }
    std::vector<double> sizes;
    for (const double left : model_residuals(series)) sizes.push_back(std::fabs(left));
    const double usual_um = quantile(sizes, 0.999), usual_gain = quantile(gains, 0.99);
    const double usual_move_um = quantile(moves_um, 0.99);
    const double bias_max_um = rounded_up(std::max(1.5 * usual_um, 1.25 * most_bias_um), 1.0);
    const double gain_max = std::clamp(rounded_up(1.5 * usual_gain, 0.05), 0.1, 0.5);
    const cb_adapt_settings bounded = settings_of(rates, bias_max_um, gain_max, no_bound_um);
    const double step_max_um = choose_step(bounded, series, every_s, usual_move_um);
    adapted.settings = settings_of(rates, bias_max_um, gain_max, step_max_um);
    adapted.reasons = {
        fmt::format(
            "bias_max_um {:g}: 99.9 % of the model's residuals are below {:.3g} um, and the "
            "largest bias without bounds was {:.3g} um",
            bias_max_um, usual_um, most_bias_um),
        fmt::format("gain_max {:g}: 99 % of the gains without bounds were below {:.2g}", gain_max,
                    usual_gain),
        fmt::format(
            "step_max_um {:g}: leaves least with right probes and with 5 % wrong ones by {:g} um; "
            "at one in {:g} min 99 % moved the term by less than {:.3g} um",
            step_max_um, wrong_um, every_s.back() / s_of_min, usual_move_um),
        fmt::format("drift_um_per_sqrt_h {:g}, gain_drift_per_sqrt_h {:g}, sigma_um {:g}: {} of {} "
                    "simulated probes",
                    rates.drift_um_per_sqrt_h, rates.gain_drift_per_sqrt_h, rates.sigma_um,
                    options.sigma_um > 0.0 ? "with the given sigma the most likely ones"
                                           : "the most likely ones",
                    probes)};
}

// out: what a probe at this interval leaves of the series, alone and with the model
interval_figures figures_at(double interval_s, const error_series &series,
                            const cb_adapt_settings &settings) {
    interval_figures figures;
    figures.interval_min = interval_s / s_of_min;
    const probed_course course = simulate_probes(series, settings, {interval_s});
    figures.rezero = left_by(rezero(series, {interval_s}));
    figures.adapted = left_by(course.left_um);
    figures.adapted_wrong = left_by(left_with_wrong(series, settings, interval_s));
    std::size_t within = 0;
    for (std::size_t i = 0; i < course.innovation_um.size(); ++i) {
        within += std::fabs(course.innovation_um[i]) <= 2.0 * course.expected_um[i];
    }
    figures.probes = course.probes;
    figures.within_two_sigma =
        static_cast<double>(within) /
        static_cast<double>(std::max<std::size_t>(1, course.innovation_um.size()));
    return figures;
}

// Throws input_error for a list of names of another length than the outputs, and for names that the
// box does not take.
void check_probe_names(const train_result &result, const adapt_options &options) {
    const std::size_t outputs = result.data.outputs.size();
    for (const auto &[option, names] :
         {std::pair{"--probe-value", options.values}, std::pair{"--probe-count", options.counts}}) {
        if (!names.empty() && names.size() != outputs) {
            throw input_error(
                fmt::format("{}: names {} signals for {} outputs: give one for each, in "
                            "the order of --outputs",
                            option, names.size(), outputs));
        }
        for (const auto &name : names) {
            if (is_name_of_the_box(name)) continue;
            throw input_error(
                fmt::format("{}: the box cannot use the name '{}': it takes 1 to 23 "
                            "letters A to Z, digits, _ - .",
                            option, name));
        }
    }
}

// out: a name of at most 23 bytes
std::string joined_name(const std::string &before, const std::string &name,
                        const std::string &behind) {
    return before + name.substr(0, longest_name - before.size() - behind.size()) + behind;
}

// out: the probe's value of an output without --probe-value: of error_X_um probe_x, as `init` and
//      `join` name it; of another probe_NAME
std::string usual_probe(const std::string &output) {
    const std::string start = "error_", end = "_um";
    const bool joined = output.size() > start.size() + end.size() &&
                        output.compare(0, start.size(), start) == 0 &&
                        output.compare(output.size() - end.size(), end.size(), end) == 0;
    if (!joined) return joined_name("probe_", output, "");
    const std::size_t length = output.size() - start.size() - end.size();
    return formats::probe_names_of(output.substr(start.size(), length)).value;
}

adapted_output named_output(const train_result &result, const adapt_options &options,
                            std::size_t k) {
    adapted_output adapted;
    adapted.output = result.data.outputs[k];
    adapted.term = joined_name("", adapted.output, term_suffix);
    adapted.value = options.values.empty() ? usual_probe(adapted.output) : options.values[k];
    adapted.count =
        options.counts.empty() ? joined_name("", adapted.value, "_n") : options.counts[k];
    return adapted;
}

}  // namespace

std::vector<adapted_output> adapt_outputs(const train_result &result,
                                          const adapt_options &options) {
    if (result.data.time_s.empty()) {
        throw input_error(result.data.file, 0, 0,
                          "has no time, which simulated probes need: name its column with "
                          "--time-column");
    }
    check_probe_names(result, options);
    const std::vector<double> every_s = intervals_s(options);
    std::vector<adapted_output> all;
    for (std::size_t k = 0; k < result.data.outputs.size(); ++k) {
        adapted_output adapted = named_output(result, options, k);
        error_series learnt = series_of(result, left_out_rows(result, k));
        learnt.own = own_sigmas(result, k, result.learn.x);
        const std::size_t probes =
            simulate_probes(learnt, settings_of({}, 1.0, 0.1, 1.0), {every_s.back()}).probes;
        if (probes < least_probes) {
            throw input_error(
                result.data.file, 0, 0,
                "has room for {} probes at one in {:g} min; simulated probes need {}: "
                "record for longer, or choose shorter intervals",
                probes, every_s.back() / s_of_min, least_probes);
        }
        choose_settings(adapted, learnt, every_s, options);
        adapted.held_out = result.test.x.rows() > 0;
        error_series shown = learnt;
        if (adapted.held_out) {
            shown = series_of(result, held_out_rows(result, k));
            shown.own = own_sigmas(result, k, result.test.x);
        }
        adapted.nothing = left_by(shown.error_um);
        adapted.model = left_by(model_residuals(shown));
        for (const double interval_s : every_s) {
            adapted.intervals.push_back(figures_at(interval_s, shown, adapted.settings));
        }
        all.push_back(std::move(adapted));
    }
    return all;
}

namespace {

json setting(float value) {
    return json(std::stod(fmt::format("{}", value)));
}

json figures_json(const left_figures &figures) {
    return {{"rms_um", formats::five_digits(figures.rms_um)},
            {"p95_um", formats::five_digits(figures.p95_um)},
            {"largest_um", formats::five_digits(figures.largest_um)}};
}

json term_json(const adapted_output &adapted, const adapt_options &options) {
    const cb_adapt_settings &settings = adapted.settings;
    json term{{"name", adapted.term},
              {"type", "adapt"},
              {"of", adapted.output},
              {"probe", {{"value", adapted.value}, {"count", adapted.count}}}};
    if (options.measures_whole) term["measures"] = "whole";
    term["bias_max_um"] = setting(settings.bias_max_um);
    term["gain_max"] = setting(settings.gain_max);
    term["step_max_um"] = setting(settings.step_max_um);
    term["drift_um_per_sqrt_h"] = setting(settings.drift_um_per_sqrt_h);
    term["gain_drift_per_sqrt_h"] = setting(settings.gain_drift_per_sqrt_h);
    term["sigma_um"] = setting(settings.sigma_um);
    term["min_interval_s"] = setting(settings.min_interval_s);
    return term;
}

void add_line(std::string &text, const std::string &what, const left_figures &figures,
              const std::string &more) {
    text += fmt::format("  {:34}{:9.2f}{:9.2f}{:9.2f}{}\n", what, figures.rms_um, figures.p95_um,
                        figures.largest_um, more);
}

// out: what the figures say against a probe, or nothing
std::string advice(const adapted_output &adapted) {
    for (const interval_figures &one : adapted.intervals) {
        if (one.adapted.rms_um > 1.02 * one.rezero.rms_um) {
            return fmt::format(
                "note: {}: at one probe in {:g} min the probe alone is better than with the model: "
                "train it on more of the machine's life, or leave it out\n",
                adapted.output, one.interval_min);
        }
        if (one.adapted.rms_um > 0.95 * adapted.model.rms_um) {
            return fmt::format("note: {}: one probe in {:g} min buys next to nothing here\n",
                               adapted.output, one.interval_min);
        }
    }
    return "";
}

}  // namespace

void add_adapt_terms(json &fragment, const std::vector<adapted_output> &adapted,
                     const train_result &result, const adapt_options &options) {
    json &findings = fragment["provenance"][result.options.name];
    for (const adapted_output &one : adapted) {
        json found{{"nothing", figures_json(one.nothing)},
                   {"model", figures_json(one.model)},
                   {"rows_of", one.held_out ? "runs held out" : "runs left out"},
                   {"settings", one.reasons}};
        for (const interval_figures &at : one.intervals) {
            found["probed"].push_back(
                {{"interval_min", at.interval_min},
                 {"probes", at.probes},
                 {"rezero", figures_json(at.rezero)},
                 {"adapted", figures_json(at.adapted)},
                 {"adapted_5_percent_wrong", figures_json(at.adapted_wrong)},
                 {"within_two_sigma", formats::five_digits(at.within_two_sigma)}});
        }
        findings["probes"][one.output] = found;
        if (options.write) fragment["terms"].push_back(term_json(one, options));
    }
}

std::string adapt_text(const std::vector<adapted_output> &adapted, const adapt_options &options) {
    std::string text = fmt::format(
        "\nWhat a probe would buy, on runs {} (um)\n  {:34}{:>9}{:>9}{:>9}   2 sigma holds\n",
        adapted.front().held_out ? "held out" : "left out of training", "", "rms", "95 %",
        "largest");
    for (const adapted_output &one : adapted) {
        text += one.output + "\n";
        add_line(text, "nothing", one.nothing, "");
        add_line(text, "model alone", one.model, "");
        for (const interval_figures &at : one.intervals) {
            const std::string every = fmt::format(", {:g} min", at.interval_min);
            add_line(text, "re-zero by probe" + every, at.rezero, "");
            add_line(text, "model + probe" + every, at.adapted,
                     fmt::format("{:14.1f} %", 100.0 * at.within_two_sigma));
            add_line(text, "  5 % of the probes wrong by 100", at.adapted_wrong, "");
        }
    }
    for (const adapted_output &one : adapted) {
        text += options.write
                    ? fmt::format("term {} of {}, probe {} and {}\n", one.term, one.output,
                                  one.value, one.count)
                    : fmt::format("an adapt term of {} (--adapt writes it)\n", one.output);
        for (const auto &reason : one.reasons) text += "  " + reason + "\n";
        text += advice(one);
    }
    return text;
}

}  // namespace compbox::adaptation
