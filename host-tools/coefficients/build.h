// SPDX-License-Identifier: MIT
// `compbox build` for other commands.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "host-tools/formats/json.h"

namespace compbox::coefficients {

struct build_request {
    std::string machine;
    std::vector<std::string> terms;
    std::optional<unsigned> revision;  // empty: the machine file's
    std::string output;
    std::string plot;            // of the demand, see plot_demand(); empty: none
    bool accept_range = false;   // builds in spite of comparison::refusals
    bool for_stm32f405 = false;  // refuses what that cannot run
};

struct built_file {
    std::vector<std::string> notes;    // what was filled in, and what each channel demands
    std::vector<std::string> remarks;  // what hardly belongs together, one sentence each
    std::vector<std::string> files;    // that were written
    json channels, curves;             // as struct comparison has them
};

// Joins the files (merge.h), checks the result with the box's loader, compares its parts
// (compare.h), then writes the figures and `output`, or *out if it is not null and the path means
// standard output. It writes over no file that it has read.
// Throws input_error naming the file with the error.
built_file build_file(const build_request &request, std::ostream *out = nullptr);

}  // namespace compbox::coefficients
