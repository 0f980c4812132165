// SPDX-License-Identifier: MIT
// The report of a model's drift: what probes have shown over months, as figures, text and plot.
#pragma once

#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"
#include "host-tools/metrology/model_drift.h"

namespace compbox::test_report {

struct series_drift {
    metrology::residual_series series;
    metrology::model_drift drift;
};

// in : residuals_in(table). out: each with its periods, and when a drift began and was noticed
std::vector<series_drift> drifts_of(const std::vector<metrology::residual_series> &all,
                                    const metrology::drift_options &options);

// out: for each series its periods with their figures, the finding as a sentence, and when a drift
//      began and was noticed (null: never)
json drift_figures(const std::vector<series_drift> &all, const metrology::drift_options &options);

std::string drift_text(const std::vector<series_drift> &all,
                       const metrology::drift_options &options);

// A panel for each series: its residuals, the means of the periods, and where the drift began.
void plot_drifts(const std::vector<series_drift> &all, const metrology::drift_options &options,
                 const std::string &path);

}  // namespace compbox::test_report
