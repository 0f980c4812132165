// SPDX-License-Identifier: MIT
// The live table of commissioning: each register by name, with the place where the control's
// display shows the same.
#pragma once

#include <string>
#include <vector>

#include "host-tools/commission/register_map.h"

namespace compbox::commission {

// out: a headline, the names of the columns, and a line for each row of both blocks: register,
// type, name, raw words, value with unit, least and largest that was seen, age, state, display. The
// signals before `current` agree.
std::vector<std::string> table_lines(const live_box &live, const register_map &map,
                                     const map_row *current);

// out: the line of one row
std::string table_line(const live_box &live, const map_row &row, const map_row *current);

// out: value with unit, or the words of a control or status word
std::string value_text(const map_row &row);

// out: where the profile's display shows the value; "": nowhere
std::string display_of(const cb_config &config, const map_row &row);

}  // namespace compbox::commission
