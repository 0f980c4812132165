// SPDX-License-Identifier: MIT
// Machine file + term fragments = coefficient file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host-tools/formats/json.h"

namespace compbox::coefficients {

struct entry_home {
    std::string file;
    std::size_t index;  // in its list there
};

struct merged_file {
    json file;                         // what the box will read
    std::vector<std::string> notes;    // what was filled in or left out, one line each
    std::vector<std::string> remarks;  // terms without effect, one sentence each
    // Where each entry came from, in the order of file["signals"] and file["terms"].
    std::vector<entry_home> signal_homes, term_homes;
};

// Joins the files. Throws input_error for what is not a machine file or fragment, for a name in two
// files (it names both; a lag written alike in both is one signal), and for a signal that a term
// needs and no file has; what only the box's loader can judge is left to it.
merged_file merge_files(const std::string &machine_path, const std::vector<std::string> &fragments,
                        std::optional<unsigned> revision);

// Fills in what the machine file leaves open with null:
//   - a channel's sum (also "auto", [] or no key): every term output with an ISO 230-1 name whose
//     direction is the channel's name: EZX and EZY for channel Z, or that is named after the
//     channel as `join` and `train` do: error_Z_um, error_Z_um_by_X; a channel without any is left
//     out
//   - a signal's min and max: plausible_around() the curves over it; a signal that nothing uses is
//     left out
// All else stays as written. Throws input_error where the files do not determine a value.
void fill_in(merged_file &merged, const std::string &machine_path);

}  // namespace compbox::coefficients
