// SPDX-License-Identifier: MIT
// Electronic cams (S4): a cam is a function of one variable, so the other axes follow from the tool
// path, y = k(x).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host-tools/export/tables.h"
#include "host-tools/export/text.h"

namespace compbox::exports {

struct cam_options {
    std::string master = "X";                 // signal of the virtual axis
    std::map<std::string, std::string> path;  // by signal: a formula of the master, "0.5*X + 3"
    std::string path_file;                    // or a table, CSV with a column for each signal
    table_options table;                      // step, tolerance, range of the master, axis_of, at
};

struct cam {
    unsigned channel = 0;
    std::vector<double> slave_mm;  // at each master position: path + what the channel wants
    double step_error_um = 0.0, step_error_at_mm = 0.0;
};

struct cam_set {
    std::vector<double> master_mm;
    double step_mm = 0.0;
    bool tolerance_met = true;
    std::vector<cam> cams;  // one for each channel
    std::vector<std::string> remarks;
};

// Throws input_error for a path that is missing, cannot be read, or leaves the plausible range of
// its signal.
cam_set make_cams(const channel_model &model, const cam_options &options);

std::vector<output_file> twincat_cam(const channel_model &model, const cam_set &cams,
                                     const cam_options &how, const text_options &options);
std::vector<std::string> cam_loss_lines(const channel_model &model, const cam_set &cams,
                                        const cam_options &how);

}  // namespace compbox::exports
