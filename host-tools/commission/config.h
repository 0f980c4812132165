// SPDX-License-Identifier: MIT
// The configuration of the box for `compbox commission`: registers, limits and safety functions of
// the file; the channels write the offsets of the sign test.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

struct cb_config;

namespace compbox::commission {

// Channels that move together: one, or the two of a pair.
struct test_axis {
    std::string name;                   // "X"; of a pair "X1+X2"
    std::vector<std::size_t> channels;  // indices in the file
    double max_difference_um = 0.0;     // of a pair; 0: one channel
};

struct box_setup {
    std::unique_ptr<cb_config> config;
    std::vector<test_axis> axes;
    std::vector<std::size_t> offset_signal;  // of each channel: the signal that is its offset in µm
    std::vector<std::string> remarks;
};

// in : a machine or coefficient file; the maximum rate of offsets, µm/s
// out: the configuration without sums, terms, tangents and signals from elsewhere than the PLC. No
// channel or ramp exceeds the rate. A range that is null accepts any value, with a remark.
// Throws input_error with the loader's message for an error in the rest of the file.
box_setup make_box_setup(const json &document, const std::string &file, double rate_um_per_s);

}  // namespace compbox::commission
