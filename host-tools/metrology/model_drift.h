// SPDX-License-Identifier: MIT
// Whether a model still holds: what probes have shown over months, by days or weeks, and the day
// from which their mean has moved.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/formats/csv.h"

namespace compbox::metrology {

// Residuals of one error in order of time.
struct residual_series {
    std::string name;
    std::string what;  // for a person: what the residuals are
    std::vector<double> time_s, left_um;
};

struct drift_options {
    double period_s = 86400.0;
    std::size_t reference = 0;  // periods at the beginning that are right; 0: chosen
};

// All measurements of a day or a week.
struct drift_period {
    double start_s = 0.0;  // of the period, on the record's clock or in seconds since 1970
    std::size_t count = 0;
    double mean_um = 0.0, rms_um = 0.0, p95_um = 0.0, largest_um = 0.0;
    double up = 0.0, down = 0.0;  // CUSUM, in standard deviations of a period's mean
};

struct model_drift {
    std::vector<drift_period> periods;
    std::size_t reference = 0;  // number of periods that the mean and its spread are from
    double mean_um = 0.0, spread_um = 0.0;
    std::optional<std::size_t> noticed;  // the first period with a CUSUM beyond 5 …
    std::optional<std::size_t> since;    // … and the one in which it began to rise
    double change_um = 0.0;              // mean since then, less the reference's
};

// in : a record of compboxd with probe columns (probed_record.h), a table with pairs of columns
// NAME
//      and NAME_predicted, or a table with error_NAME_um; time_s, or unix_s instead
// out: of a record what is left without adaptation where it has the columns NAME and NAME_adapted,
//      else what the probe showed; of a table the error less its prediction; of `join` the errors
// Throws input_error for a table that is none of these.
std::vector<residual_series> residuals_in(const formats::csv_table &table);

// in : series with at least one row; options.period_s > 0
// out: the periods with a row. The reference is the first fifth of the periods, at least 7; the
//      CUSUM is two-sided with an allowance of half a standard deviation of the reference's means,
//      and that of their mean.
//      With fewer than 10 periods, or no period behind the reference, nothing is noticed.
model_drift drift_of(const residual_series &series, const drift_options &options);

// "2026-06-03" of seconds since 1970, "day 4" of another clock; weeks likewise
std::string period_name(const drift_period &period, const drift_options &options);

}  // namespace compbox::metrology
