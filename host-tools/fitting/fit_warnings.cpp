// SPDX-License-Identifier: MIT
// Warnings about a fit, one sentence each.
#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <utility>

#include "host-tools/fitting/methods.h"
#include "host-tools/fitting/signs.h"
#include "host-tools/formats/csv.h"

namespace compbox::fitting {

namespace {

// Whether the name is an axis error of ISO 230-1: E, the direction, the axis.
bool is_iso_error(const std::string &name) {
    return name.size() == 3 && name[0] == 'E' &&
           std::string("XYZABC").find(name[1]) != std::string::npos &&
           std::string("XYZABCUVW").find(name[2]) != std::string::npos;
}

// A rotation in um, or a translation in urad: every result from it would be wrong by its lever.
void warn_of_other_unit(fit_result &result) {
    const std::string &name = result.options.name, &unit = result.data.unit;
    if (!is_iso_error(name)) return;
    const bool angle = name[1] < 'D';  // A, B, C
    if (angle == (unit == "urad")) return;
    result.warnings.push_back(fmt::format("{} is by its name {}, but the readings are in {}", name,
                                          angle ? "an angle" : "no angle", unit));
}

// The third letter is the axis that the error belongs to.
void warn_of_other_axis(fit_result &result) {
    const std::string &name = result.options.name, &signal = result.options.signal;
    if (!is_iso_error(name) || signal.empty() ||
        std::toupper(static_cast<unsigned char>(signal[0])) == name[2]) {
        return;
    }
    result.warnings.push_back(
        fmt::format("{} is by its name an error of axis {}, but the curve depends on signal {}",
                    name, name[2], signal));
}

// out: all readings of all runs are equal, and there are enough of them for a warning
bool is_constant(const measurement &data) {
    const double first = data.runs.front().error.front();
    return data.position.size() >= 3 &&
           std::all_of(data.runs.begin(), data.runs.end(), [first](const measured_run &run) {
               return std::all_of(run.error.begin(), run.error.end(),
                                  [first](double error) { return error == first; });
           });
}

// The smoothness depends on an assumed noise.
void warn_of_unknown_noise(fit_result &result) {
    if (result.constant) return;
    const bool used =
        result.options.method == fit_method::bspline && result.options.tolerance_um <= 0;
    if (!used || result.best.noise_measured || result.data.position.size() < 3) return;
    result.warnings.push_back(
        fmt::format("the noise could not be measured (no repeats, no column sigma); about {:.2g} "
                    "{} is assumed, as usual for instruments; measure three runs, or give sigma",
                    result.noise, result.data.unit));
}

double rms_of(const std::vector<double> &values) {
    double squares = 0.0;
    for (const double value : values) squares += value * value;
    return values.empty() ? 0.0 : std::sqrt(squares / static_cast<double>(values.size()));
}

// Averaging removes less of noise that is alike at neighbouring targets; one run hides it.
void warn_of_correlated_noise(fit_result &result) {
    const smooth_curve &best = result.best;
    const std::string &unit = result.data.unit;
    if (result.constant || best.x.empty()) return;
    if (best.correlated()) {
        result.warnings.push_back(fmt::format(
            "the noise of neighbouring targets of a run is alike (correlation {:.2f}): the band is "
            "{:.1f} times as wide as for independent readings; more runs narrow it, more targets "
            "do not",
            best.noise_correlation, best.widened));
    }
    const double more = rms_of(best.more_sigma), own = rms_of(best.sigma);
    if (result.data.repeat_freedom > 0 || result.data.runs_aligned || more < 2.0 * own) return;
    if (more < 0.01 * rms_of(best.mean)) return;
    result.warnings.push_back(
        fmt::format("one run cannot show whether slow waves of about {:.2g} {} are the axis' or "
                    "the instrument's; the band contains both; measure three runs",
                    more, unit));
}

// Warns of a reading that contradicts the others; no fit can correct it. The test compares the
// expected effect of leaving it out with the effect at other positions.
void warn_of_outliers(fit_result &result) {
    const smooth_curve &best = result.best;
    double worst = 0.0, squares = 0.0;
    std::size_t where = 0;
    const std::size_t n = best.left_out.size();
    for (std::size_t i = 0; i < n; ++i) {
        const double apart = std::abs(best.left_out[i]) / std::sqrt(best.left_out_variance[i]);
        squares += apart * apart;
        if (apart > worst) {
            worst = apart;
            where = i;
        }
    }
    if (n < 12) return;
    const double usual = std::sqrt((squares - worst * worst) / static_cast<double>(n - 1));
    if (worst < 5.0 * std::max(usual, 1.0)) return;
    result.warnings.push_back(
        fmt::format("the reading at {:.7g} mm is far from its neighbours: a corner of the curve, "
                    "or a wrong reading to measure again or leave out",
                    result.data.position[where]));
}

// Readings of one position and direction.
struct repeats {
    double sum = 0.0, squares = 0.0, low = 0.0, high = 0.0;
    int count = 0;

    void add(double reading) {
        low = count ? std::min(low, reading) : reading;
        high = count ? std::max(high, reading) : reading;
        sum += reading;
        squares += reading * reading;
        ++count;
    }
    double spread() const { return std::max(squares - sum * sum / count, 0.0); }
};

// Where the runs disagree far more than elsewhere, one of them has a wrong reading. It also raises
// the estimated noise, so that the curve is smoothed too much.
void warn_of_disagreement(fit_result &result) {
    const measurement &data = result.data;
    std::map<std::pair<double, int>, repeats> groups;
    for (const auto &run : data.runs) {
        for (std::size_t i = 0; i < run.position.size(); ++i) {
            const double line = run.offset + run.slope * (run.position[i] - data.centre());
            groups[{run.position[i], run.direction}].add((run.error[i] - line) / run.sigma[i]);
        }
    }
    double squares = 0.0, worst = 0.0, where = 0.0, apart = 0.0;
    int freedom = 0, worst_freedom = 0;
    for (const auto &[place, group] : groups) {
        squares += group.spread();
        freedom += group.count - 1;
        if (group.spread() <= worst) continue;
        worst = group.spread();
        worst_freedom = group.count - 1;
        where = place.first;
        apart = group.high - group.low;
    }
    const int others = freedom - worst_freedom;
    if (others < 10) return;
    const double usual = (squares - worst) / others;
    if (worst <= 30.0 * worst_freedom * usual) return;
    result.warnings.push_back(fmt::format(
        "the runs disagree at {:.7g} mm by {:.3g}{}, elsewhere by about {:.2g}; leave the wrong "
        "reading out or measure it again",
        where, apart, data.sigma_given ? " times sigma" : " " + data.unit, std::sqrt(usual)));
}

// Two branches in one curve: acceptable for straightness, a loss for positioning.
void warn_of_lost_motion(fit_result &result) {
    const double lost = result.data.mean_lost_motion;
    if (result.options.branches || !result.data.bidirectional) return;
    if (std::abs(lost) < 3.0 * result.noise) return;
    result.warnings.push_back(
        fmt::format("forward and backward differ by {:.3g} {} on average; --branches keeps both",
                    lost, result.data.unit));
}

}  // namespace

std::string noise_text(const fit_result &result) {
    if (result.data.sigma_given) return fmt::format("{:.2g} of its sigma", result.noise);
    return fmt::format("{:.2g} {}", result.noise, result.data.unit);
}

// An empty or wrong column has one value everywhere. Tests the readings as in the file.
void warn_of_constant(fit_result &result) {
    result.constant = is_constant(result.data);
    if (!result.constant) return;
    result.warnings.push_back(
        fmt::format("every reading is {} {}, which no measurement gives; check the column",
                    result.data.runs.front().error.front(), result.data.unit));
}

void add_warnings(fit_result &result) {
    warn_of_other_unit(result);
    warn_of_other_axis(result);
    warn_of_unknown_noise(result);
    warn_of_correlated_noise(result);
    warn_of_lost_motion(result);
    warn_of_outliers(result);
    warn_of_disagreement(result);
    for (const auto &warning : mirrored_run_warnings(result.data)) {
        result.warnings.push_back(warning);
    }
    for (auto &backward : result.backward) {
        warn_of_outliers(backward);
        warn_of_disagreement(backward);
        for (const auto &warning : mirrored_run_warnings(backward.data)) {
            result.warnings.push_back(warning);
        }
        for (const auto &warning : backward.warnings) {
            result.warnings.push_back("backward: " + warning);
        }
    }
}

}  // namespace compbox::fitting
