// SPDX-License-Identifier: MIT
// What `compbox build` does, for other commands too.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace compbox::coefficients {

// Joins the files (merge.h), asks the box's loader, and only then writes `output`, to *out where
// that is given and the path means standard output. Returns remarks, one line each. Throws
// input_error naming the file at fault.
std::vector<std::string> build_file(const std::string &machine,
                                    const std::vector<std::string> &terms,
                                    std::optional<unsigned> revision, const std::string &output,
                                    std::ostream *out = nullptr);

}  // namespace compbox::coefficients
