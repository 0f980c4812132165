// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/pair_remarks.h"

#include <fmt/core.h>

#include <cmath>

#include "host-tools/coefficients/evaluate.h"
#include "host-tools/coefficients/evaluate_remarks.h"

namespace compbox::coefficients {

namespace {

constexpr int places_of_travel = 201;
constexpr double seen_um = 0.005;  // less is rounding of the common part

double between(const cb_signal_config &signal, double share) {
    const double low = static_cast<double>(signal.min), high = static_cast<double>(signal.max);
    return low + share * (high - low);
}

// Each signal in turn along its range, the others in their middle; one row a second.
formats::csv_table sweeps(const cb_config &config, const std::vector<unsigned> &signals) {
    formats::csv_table table;
    table.file = "ranges of the signals";
    table.names = {"time_s"};
    for (const unsigned s : signals) table.names.push_back(config.signals[s].name);
    for (const unsigned moved : signals) {
        for (int place = 0; place < places_of_travel; ++place) {
            std::vector<double> row{static_cast<double>(table.rows.size())};
            for (const unsigned s : signals) {
                const double share = s == moved ? place / (places_of_travel - 1.0) : 0.5;
                row.push_back(between(config.signals[s], share));
            }
            table.rows.push_back(row);
            table.lines.push_back(static_cast<long>(table.rows.size()));
        }
    }
    return table;
}

std::string sentence(const cb_config &config, unsigned index, double apart_um,
                     const std::string &where) {
    const cb_pair_config &pair = config.pairs[index];
    return fmt::format(
        "pairs[{}]: the curves of {} and {} differ by {:.1f} µm at {}, and max_difference_um is "
        "{:.6g}: the box holds the motors back there, and the stage yaws by the rest",
        index, config.channels[pair.a].name, config.channels[pair.b].name, apart_um, where,
        pair.max_difference_um);
}

}  // namespace

std::vector<std::string> pair_remarks(const cb_config &config) {
    std::vector<std::string> remarks;
    if (config.pairs_count == 0) return remarks;
    const auto signals = measured_signals(config);
    const formats::csv_table table = sweeps(config, signals);
    const evaluation result = evaluate(config, table, true);
    for (unsigned p = 0; p < config.pairs_count; ++p) {
        const cb_pair_config &pair = config.pairs[p];
        double most_um = 0.0;
        std::size_t at = 0;
        for (std::size_t i = 0; i < result.rows.size(); ++i) {
            const float *channel = result.rows[i].data() + config.outputs_count;
            const double um = std::fabs(static_cast<double>(channel[pair.a] - channel[pair.b]));
            if (um > most_um + seen_um) most_um = um, at = i;
        }
        if (!(most_um > static_cast<double>(pair.max_difference_um))) continue;
        const std::size_t moved = at / places_of_travel;
        remarks.push_back(sentence(config, p, most_um,
                                   fmt::format("{} = {:.6g}", config.signals[signals[moved]].name,
                                               table.rows[at][moved + 1])));
    }
    return remarks;
}

}  // namespace compbox::coefficients
