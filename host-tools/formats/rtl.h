// SPDX-License-Identifier: MIT
// Laser interferometer files of Renishaw's text format: .rtl (linear, straightness: µm) and .rta
// (angles: mrad, converted to µrad). Unknown sections of other program versions are skipped.
// Written in the plain form that several public readers accept.
#pragma once

#include <string>
#include <vector>

namespace compbox {

// One run along the targets, in the order of measurement.
struct laser_run {
    int direction = 1;                // +1 forward, -1 backward
    std::vector<std::size_t> target;  // index into laser_file::targets_mm
    std::vector<double> deviation;    // µm, or µrad for .rta
    std::vector<long> line;           // line of each reading; empty if not read from a file
};

struct laser_file {
    std::string file;            // for messages
    bool angular = false;        // .rta: deviations are µrad
    bool bidirectional = false;  // odd runs forward, even runs backward
    std::string machine, serial, date, by, axis, location, title;
    std::vector<double> targets_mm;  // strictly ascending
    std::vector<laser_run> runs;
};

// out: whether the name ends in .rtl or .rta, in any case
bool is_laser_file(const std::string &path);

// Reads a .rtl or .rta file (UTF-8, UTF-16, GBK or Windows-1252; texts become UTF-8; a decimal
// comma is read). A file whose name ends in .rta is angular. Descending targets are reversed.
// Throws input_error with file and line: missing sections, counts that disagree with what follows,
// text in numbers, targets out of order or out of range, a target twice in one run, a run without
// readings.
laser_file read_laser(const std::string &path);

// The text of a file that read_laser reads back to the same numbers (three decimals of a µm or of
// a µrad are kept; targets to 1e-5 mm).
std::string laser_text(const laser_file &file);

}  // namespace compbox
