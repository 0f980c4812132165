// SPDX-License-Identifier: MIT
#include "host-tools/compbox/reading_arguments.h"

#include "host-tools/command_line/option_checks.h"

namespace compbox {

void add_unit(cli::command &command, fitting::reading_options &reading) {
    reading.unit_option = true;
    command.add_option("--unit UNIT", reading.unit,
                       "Unit of the error where the file states none, or those of position and "
                       "error: um, in, mm,um …");
}

void add_scale(cli::command &command, scale_arguments &scale) {
    command
        .add_option("--expansion-um-per-m-K A", scale.expansion_um_per_m_K,
                    "Convert readings to 20 degC with this coefficient of the machine's scale")
        .check(cli::between(0.0, 100.0));
    command
        .add_option("--material-degC T", scale.degC,
                    "Temperature of the machine's scale, or START,END of the measurement (by "
                    "default from the file)")
        .delimiter(',')
        .check(cli::between(-50.0, 150.0));
}

test_report::scale_temperature stated_scale(const scale_arguments &scale,
                                            const std::string &option) {
    if (scale.degC.size() > 2) {
        throw cli::usage_error(option,
                               "takes one temperature, or those at the start and at the end");
    }
    test_report::scale_temperature stated;
    stated.expansion_um_per_m_K = scale.expansion_um_per_m_K;
    if (!scale.degC.empty()) {
        stated.degC = formats::start_and_end{scale.degC.front(), scale.degC.back()};
    }
    return stated;
}

}  // namespace compbox
