// SPDX-License-Identifier: MIT
#include "host-tools/compbox/monte_carlo_report.h"

#include <fmt/core.h>

#include <cmath>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/compbox/line_sigma.h"
#include "host-tools/formats/json.h"
#include "host-tools/identification/identify.h"

namespace compbox {

namespace {

json statistics_json(const identification::method_statistics &statistics, std::size_t k) {
    json one;
    one["mean"] = statistics.mean[k];
    one["sigma"] = statistics.sigma[k];
    one["sigma_closed_form"] = statistics.closed_form[k];
    return one;
}

// out: reduction from `before` to `now`, %; null if `before` is 0
json less_percent(double now, double before) {
    return before == 0.0 ? json(nullptr) : json(100.0 * (1.0 - now / before));
}

// A number to `places` decimals, or "-" for null, in a column of `width`.
std::string cell(const json &value, int width, int places) {
    return value.is_null() ? fmt::format("{:>{}}", "-", width)
                           : fmt::format("{:{}.{}f}", value.get<double>(), width, places);
}

}  // namespace

void add_monte_carlo(cli::command &command, monte_carlo_arguments &arguments) {
    command
        .add_option("--monte-carlo N", arguments.runs,
                    "Compare both methods over N runs with noise, as a check of the closed form")
        .check(cli::whole_between(2, 100000000));
    command.add_option("--seed K", arguments.seed, "Of the noise (1)");
}

// out: mean, sigma and closed-form sigma of each error, µm or µrad; percentages against traditional
json monte_carlo_json(const identification::monte_carlo_result &result,
                      const identification::monte_carlo_options &options) {
    const auto names = identification::error_names(options.axis);
    json report;
    report["runs"] = options.runs;
    report["seed"] = options.seed;
    report["reading_sigma_um"] = line_sigma_json(options.sigma_um);
    for (std::size_t k = 0; k < 6; ++k) {
        json one;
        one["unit"] = k < 3 ? "um" : "urad";
        one["preset"] = options.preset[k];
        one["improved"] = statistics_json(result.improved, k);
        if (result.traditional) {
            const auto &other = *result.traditional;
            one["traditional"] = statistics_json(other, k);
            one["mean_closer_percent"] =
                less_percent(std::fabs(result.improved.mean[k] - options.preset[k]),
                             std::fabs(other.mean[k] - options.preset[k]));
            one["sigma_lower_percent"] = less_percent(result.improved.sigma[k], other.sigma[k]);
        }
        report["errors"][names[k]] = one;
    }
    return report;
}

std::string monte_carlo_table(const json &report) {
    const json &sigma = report["reading_sigma_um"];
    const std::string readings =
        sigma.is_number() ? fmt::format("sigma of a reading {:.3g} um", sigma.get<double>())
                          : "sigma of each line as above";
    std::string text = fmt::format(
        "Monte Carlo, {} runs, seed {}, {}\n"
        "                        traditional                  improved             closer   lower\n"
        "  error    preset      mean  sigma (closed)      mean  sigma (closed)     mean   sigma\n",
        report["runs"].get<unsigned>(), report["seed"].get<std::uint64_t>(), readings);
    for (const auto &[name, one] : report["errors"].items()) {
        text += "  " + name + cell(one["preset"], 11, 3);
        for (const char *method : {"traditional", "improved"}) {
            if (!one.contains(method)) {
                text += "        -       -        ";
                continue;
            }
            text += fmt::format("{}{} ({})", cell(one[method]["mean"], 10, 3),
                                cell(one[method]["sigma"], 8, 3),
                                cell(one[method]["sigma_closed_form"], 6, 3));
        }
        if (one.contains("traditional")) {
            text += cell(one["mean_closer_percent"], 8, 1) + " %" +
                    cell(one["sigma_lower_percent"], 6, 1) + " %";
        }
        text += "  " + one["unit"].get<std::string>() + "\n";
    }
    return text;
}

}  // namespace compbox
