// SPDX-License-Identifier: MIT
// The configuration with which `compbox commission` runs the box: the registers, limits and safety
// of the file, but what its channels write comes from the person who commissions.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::commission {

// What is moved together: a channel, or the two of a pair.
struct test_axis {
    std::string name;                   // "X"; of a pair "X1+X2"
    std::vector<std::size_t> channels;  // indices in the file
};

struct box_setup {
    std::unique_ptr<cb_config> config;
    std::vector<test_axis> axes;
    std::vector<std::size_t> offset_signal;  // of each channel: the signal that is its offset in µm
    std::vector<std::string> remarks;
};

// in : a machine or coefficient file; the rate at which offsets may move. Sums, terms, tangents and
//      signals that do not come from the PLC are left out; no channel or ramp is faster than the
//      rate; ranges that are still null are taken as anything, with a remark.
// Throws input_error with the loader's words where the rest of the file is not right.
box_setup make_box_setup(const json &document, const std::string &file, double rate_um_per_s);

}  // namespace compbox::commission
