// SPDX-License-Identifier: MIT
// Training rows from a record that has the probe's own columns, those of an `adapt` term.
#pragma once

#include <string>
#include <vector>

#include "host-tools/metrology/join.h"

namespace compbox::metrology {

// A probe in a record: its value, um, and its count, which rises by one for each measurement.
struct probe_columns {
    std::string channel;  // X of comp_X_um
    std::string value, count;
};

// in : the record
// out: each pair of columns probe_NAME and probe_NAME_n. Its channel is the one called NAME in any
//      case, or the X of a NAME error_X_um; without such a channel it is NAME itself.
std::vector<probe_columns> find_probes(const formats::csv_table &record);

// out: whether a count after another one is a new measurement: it rises, or wraps as a uint16 does.
//      One that falls otherwise began anew with its PLC.
bool is_new_count(double was, double now);

// in : record as for join_rows; probes: as found or as the user names them; measurements of several
//      probes within options.together_s are one row
// out: a row for each measurement, at the time of its new count: time_s, the signals, error_X_um =
//      value - comp_X_um as it was before the new count (or the value alone without add_back). The
//      first count of a probe, also after its PLC began anew, is only a reference. A count that
//      goes on by more than one is one measurement. Rows with an unknown value, and groups that
//      lack one of the probes, are left out and reported.
// Throws input_error for an unknown column or channel, and where no measurement is left.
joined_rows join_probed_record(const formats::csv_table &record,
                               const std::vector<probe_columns> &probes,
                               const join_options &options);

}  // namespace compbox::metrology
