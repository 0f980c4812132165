// SPDX-License-Identifier: MIT
#include "host-tools/compbox/reading_arguments.h"

namespace compbox {

void add_unit(cli::command &command, fitting::reading_options &reading) {
    reading.unit_option = true;
    command.add_option("--unit UNIT", reading.unit,
                       "Unit of the error where the file states none, or those of position and "
                       "error: um, in, mm,um …");
}

}  // namespace compbox
