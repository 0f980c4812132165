// SPDX-License-Identifier: MIT
// `compbox build` for other commands.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace compbox::coefficients {

// Joins the files (merge.h), checks the result with the box's loader, then writes `output`, or *out
// if it is not null and the path means standard output.
// out: remarks, one line each. Throws input_error naming the file with the error.
std::vector<std::string> build_file(const std::string &machine,
                                    const std::vector<std::string> &terms,
                                    std::optional<unsigned> revision, const std::string &output,
                                    std::ostream *out = nullptr);

}  // namespace compbox::coefficients
