// SPDX-License-Identifier: MIT
// The tables in the format of each control. docs/export.md lists the sources of these formats.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host-tools/export/tables.h"

namespace compbox::exports {

struct text_options {
    std::string source;                            // name of the coefficient file, for comments
    int sign = 1;                                  // -1 inverts every value
    int first_table = 0;                           // sinumerik-cec: index of the first table
    bool trims = false;                            // linuxcnc-comp: COMP_FILE_TYPE = 1
    std::string unit = "mm";                       // linuxcnc-comp: mm or inch
    std::map<std::string, std::string> axis_name;  // the control's name by channel or signal
    std::map<std::string, double> lost_motion_um;  // forward - backward, by channel
};

struct output_file {
    std::string name, text;
};

// out: the control's name of a channel's axis or of a position; SINUMERIK calls machine axes X1, Y1
std::string control_name(const text_options &options, const std::string &name);
std::string machine_axis(const text_options &options, const std::string &name);

// out: losses, one sentence each: table step, limits of the format, constant signals
std::vector<std::string> loss_lines(const channel_model &model, const table_set &tables);

std::vector<output_file> linuxcnc_comp(const channel_model &, const table_set &,
                                       const text_options &);
std::vector<output_file> sinumerik_lec(const channel_model &, const table_set &,
                                       const text_options &);
std::vector<output_file> sinumerik_cec(const channel_model &, const table_set &,
                                       const text_options &);
std::vector<output_file> heidenhain_com(const channel_model &, const table_set &,
                                        const text_options &);

// "%.6f" of a double, never "-0.000000".
std::string fixed6(double value);

}  // namespace compbox::exports
