// SPDX-License-Identifier: MIT
// The units of other people's files: one table of spellings and factors for every reader.
#pragma once

#include <functional>
#include <string>

namespace compbox::formats {

enum class quantity { length, angle, temperature, duration, rotation };

// In the quantity's first unit (µm, µrad, °C, s, rpm) a value is factor * value + zero.
struct measuring_unit {
    const char *name;  // as this project writes it in names of columns: "um", "degC"
    quantity of;
    double factor, zero;
};

// out: the unit of a spelling, in any case ("µm", "[um]", "Zoll", "arc sec", "µm/m"); null: unknown
const measuring_unit *find_unit(const std::string &spelling);

// in : two units of one quantity. out: the value in the second one
double converted(double value, const measuring_unit &from, const measuring_unit &to);

// out: a text for comparisons: lower case, letters without accents (ü: u), one spelling of µ, of
//      brackets and of blanks
std::string plain(const std::string &text);

// "Temp 1 [°C]" -> "Temp 1" and "°C". Without brackets at its end a text has no unit.
struct name_and_unit {
    std::string name, unit;
};
name_and_unit split_brackets(const std::string &text);

// Name and unit that a reader wants for a column; in : its name without brackets, and its unit
struct wanted_column {
    std::string name;
    const measuring_unit *in;
};
using unit_choice = std::function<wanted_column(const std::string &, const measuring_unit &)>;

// The name itself, in the units of a machine file: mm (µm for smaller units), degrees, µrad, °C,
// rpm. Durations are in seconds, and "_s" is appended to the name.
wanted_column machine_unit(const std::string &name, const measuring_unit &is);

// out: a choice of names with a unit at their end, such as dx1_um for "dx1 [mm]"; else
//      machine_unit
unit_choice units_of_names(const std::vector<std::string> &names);

}  // namespace compbox::formats
