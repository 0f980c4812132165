// SPDX-License-Identifier: MIT
// `adapt` terms for a trained model, and what a probe every so often would buy on its own record.
#pragma once

#include <string>
#include <vector>

#include "host-tools/adaptation/probing.h"
#include "host-tools/formats/json_type.h"
#include "host-tools/training/train.h"

namespace compbox::adaptation {

struct adapt_options {
    bool write = false;                 // add the terms to the fragment
    std::vector<double> intervals_min;  // to simulate; empty: 30, 60
    std::vector<std::string> values,
        counts;  // signals of the probes, one for each output;
                 // empty: probe_x of error_X_um, else probe_OUTPUT; with _n the count
    bool measures_whole = false;  // "measures": "whole"
    double sigma_um = 0.0;        // of one probe; 0: from the record
};

// What is left of an error, um.
struct left_figures {
    double rms_um = 0.0, p95_um = 0.0, largest_um = 0.0;
};

// What a probe at one interval leaves.
struct interval_figures {
    double interval_min = 0.0;
    left_figures rezero, adapted, adapted_wrong;  // wrong: 5 % of the probes by 100 um
    double within_two_sigma = 0.0;                // share of the right probes
    std::size_t probes = 0;
};

struct adapted_output {
    std::string output, term, value, count;
    cb_adapt_settings settings;
    left_figures nothing, model;
    std::vector<interval_figures> intervals;
    std::vector<std::string> reasons;  // of the settings, a sentence each
    bool held_out = false;             // figures are of the runs held out, not of those left out
};

// in : result of train() on data with a time; options.intervals_min rising, each >= 2 rows apart
// out: for each output settings that suit what the model leaves of the runs left out, and figures
//      of these runs, or of the runs held out if there are any. The settings:
//      - drift, gain drift and sigma: estimate_drift()
//      - bias_max_um: half as much again as 99.9 % of the residuals left out, at least a quarter
//        more than the largest bias without bounds
//      - gain_max: 0.1 to 0.5, half as much again as 99 % of the gains without bounds
//      - step_max_um: the one that leaves least with right probes and with 5 % wrong ones
// Throws input_error without a time, with fewer than 20 probes, and for names that do not fit.
std::vector<adapted_output> adapt_outputs(const training::train_result &result,
                                          const adapt_options &options);

// Appends the terms of type `adapt` and their findings to the fragment of `train`.
void add_adapt_terms(json &fragment, const std::vector<adapted_output> &adapted,
                     const training::train_result &result, const adapt_options &options);

// The figures as a table for a person, with the settings and their reasons.
std::string adapt_text(const std::vector<adapted_output> &adapted, const adapt_options &options);

}  // namespace compbox::adaptation
