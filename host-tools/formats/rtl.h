// SPDX-License-Identifier: MIT
// Laser interferometer files of Renishaw's text format: .rtl (linear), .rts (straightness) in µm
// and .rta (angles) in mrad, converted to µrad. Unknown sections of other program versions are
// skipped. Written in the plain form that several public readers accept.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace compbox::formats {

// One run along the targets, in the order of measurement.
struct laser_run {
    int direction = 1;                // +1 forward, -1 backward
    std::vector<std::size_t> target;  // index into laser_file::targets_mm
    std::vector<double> deviation;    // µm, or µrad for angles
    std::vector<long> line;           // line of each reading; empty if not read from a file
};

// A quantity at the start and at the end of the measurement.
struct start_and_end {
    double start = 0.0, end = 0.0;
};

// Section ENVIRONMENT::. What the file does not state, and what no instrument measures (-10 °C: no
// sensor), is empty.
struct laser_environment {
    std::optional<start_and_end> air_degC, air_kPa, humidity_percent;
    std::vector<start_and_end> material_degC;    // one for each sensor
    std::optional<double> expansion_um_per_m_K;  // of the material; 0: not compensated
    std::string times;                           // as in the file

    // out: the mean of the sensors; empty without one
    std::optional<start_and_end> mean_material_degC() const;
    // The instrument converted its readings to a material of 20 °C.
    bool material_compensated() const {
        return expansion_um_per_m_K && *expansion_um_per_m_K != 0.0;
    }
};

// The first target of a measurement, measured once more at its end (ISO 230-2): their difference is
// the drift.
struct repeated_target {
    double position_mm = 0.0, first = 0.0, again = 0.0;  // µm, or µrad for angles
};

// What a file states about its measurement, as texts; "" where it does not.
struct laser_particulars {
    std::optional<repeated_target> repeated;  // a last reading of the last run, in none of the runs
    std::string machine, serial, date, by, axis, location, title;
    std::string instrument;  // the lines of EQUIPMENT::, in order
};

struct laser_file : laser_particulars {
    std::string file;                // for messages
    bool angular = false;            // deviations are µrad
    bool bidirectional = false;      // odd runs forward, even runs backward
    std::vector<double> targets_mm;  // strictly ascending
    std::vector<laser_run> runs;
    std::optional<laser_environment> environment;
};

// out: one line for a person: "air 20.3 °C, 99.0 kPa, …"; "" if the file states nothing
std::string environment_text(const laser_environment &environment);

// out: whether the text is a laser file: by its sections (HEADER::), else by the name's ending
bool is_laser_text(const std::string &path, const std::string &text);

// in : the file's text (table_text.h); a decimal comma is read; unit: of the deviations, by the
//      option --unit, or "" for what the file states (Linear, Straightness: µm; Angular: mrad)
// out: the file; descending targets are reversed. Throws input_error with file and line: missing
// sections, counts that disagree with what follows, text in numbers, targets out of order or out of
// range, a target twice in one run, a run without readings, a rotary axis, a kind that neither the
// header nor the name's ending states or that they state differently.
laser_file read_laser_text(const std::string &path, const std::string &text,
                           const std::string &unit = "");

// The text of a file that read_laser reads back to the same numbers (three decimals of a µm or of
// a µrad are kept; targets to 1e-5 mm).
std::string laser_text(const laser_file &file);

}  // namespace compbox::formats
