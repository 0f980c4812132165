// SPDX-License-Identifier: MIT
// The test report: one page of HTML for A4, with everything in it.
#pragma once

#include <string>
#include <vector>

#include "host-tools/fitting/measurement.h"
#include "host-tools/formats/json_type.h"

namespace compbox::test_report {

// What a report states beside its figures, as texts; "" is left out or leaves a line to write on.
struct particulars : formats::laser_particulars {
    std::string name;         // of the error by ISO 230-1, "EXX"
    std::string environment;  // temperatures, pressure, humidity
    std::string number;       // of the report
    std::string software;     // "compbox 1.2.3"
};

// out: the error of ISO 230-1 that the text begins with, "EZX" of "EZX.csv"; "" if none
std::string iso_name(const std::string &text);

// out: `stated`, filled up from the first file that states a thing; a name that is none is taken
//      from the files' titles and names, such as EZX in EZX.csv
particulars completed(const particulars &stated, const std::vector<fitting::measurement> &files);

// out: "EZX: straightness of X in Z, Portal" for titles: what the files measured
std::string heading_of(const particulars &about, const std::string &unit);

// in : comparison_of the files, with "uncertainty" of each if it is known, and "conformity" if
//      there are limits
// out: the page as HTML, every text of it escaped. Throws input_error without gnuplot.
std::string page_of(const json &report, const std::vector<fitting::measurement> &files,
                    const particulars &about);

}  // namespace compbox::test_report
