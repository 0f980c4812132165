// SPDX-License-Identifier: MIT
#include "host-tools/export/text.h"

#include <fmt/core.h>

#include "host-tools/formats/csv.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::exports {

namespace {

constexpr double um_per_mm = 1000.0;

// out: a position to 1e-6 mm without trailing zeros: 0.1, not 0.100000
std::string position(double mm) {
    std::string text = fixed6(mm);
    text.erase(text.find_last_not_of('0') + 1);
    return text.back() == '.' ? text + "0" : text;
}

std::string signal_name(const channel_model &model, unsigned signal) {
    return model.config().signals[signal].name;
}

std::string channel_name(const channel_model &model, const table_column &column) {
    return model.config().channels[column.channel].name;
}

double lost_motion_um(const channel_model &model, const text_options &options,
                      const table_column &column) {
    const auto found = options.lost_motion_um.find(channel_name(model, column));
    return found == options.lost_motion_um.end() || !column.own ? 0.0 : found->second;
}

// out: whether the column has different values forward and backward
bool directed(const channel_model &model, const text_options &options, const table_column &column) {
    return !column.half_um.empty() || lost_motion_um(model, options, column) != 0.0;
}

// out: displacement in mm at point k for an axis that moves forward (+1), backward (-1) or either
// way (0). With --lost-motion-um the curve is the mean of both directions, and the tool is half of
// the lost motion further forward on the way forward.
double wanted_mm(const table_column &column, std::size_t k, double lost_um, int direction) {
    const double half = column.half_um.empty() ? -0.5 * lost_um : column.half_um[k];
    return (column.wanted_um[k] + direction * half) / um_per_mm;
}

std::string comment_lines(const channel_model &model, const table_set &tables,
                          const text_options &options, const std::string &mark) {
    std::string text = fmt::format("{}compbox export of {}, revision {}\n", mark, options.source,
                                   model.config().revision);
    for (const auto &line : loss_lines(model, tables)) text += mark + line + "\n";
    return text;
}

// ---- LinuxCNC ----

// out: a length in the unit of LinuxCNC's INI file; 1e-8 inch is 0.25 nm
std::string machine_length(const text_options &options, double mm) {
    constexpr double mm_per_inch = 25.4;
    if (options.unit == "mm") return fixed6(mm);
    const std::string text = fmt::format("{:.8f}", mm / mm_per_inch);
    return text == "-0.00000000" ? text.substr(1) : text;
}

// ---- SINUMERIK ----

struct cec_table {
    int index, direction;  // 0 both, 1 forward, -1 backward
    const axis_table *table;
    const table_column *column;
};

// One table of SINUMERIK's cross-error compensation: values in mm, negated by options.sign.
std::string cec_text(const channel_model &model, const text_options &options,
                     const cec_table &one) {
    const double lost = lost_motion_um(model, options, *one.column);
    std::string text = fmt::format("; table {0}: needs $MN_MM_CEC_MAX_POINTS[{0}] = {1} or more\n",
                                   one.index, one.table->position_mm.size());
    for (std::size_t k = 0; k < one.table->position_mm.size(); ++k) {
        const double value = -options.sign * wanted_mm(*one.column, k, lost, one.direction);
        text += fmt::format("$AN_CEC[{},{}]={}\n", one.index, k, fixed6(value));
    }
    return text + fmt::format(
                      "$AN_CEC_INPUT_AXIS[{0}]=({1})\n"
                      "$AN_CEC_OUTPUT_AXIS[{0}]=({2})\n"
                      "$AN_CEC_STEP[{0}]={3}\n"
                      "$AN_CEC_MIN[{0}]={4}\n"
                      "$AN_CEC_MAX[{0}]={5}\n"
                      "$AN_CEC_DIRECTION[{0}]={6}\n"
                      "$AN_CEC_MULT_BY_TABLE[{0}]=0\n"
                      "$AN_CEC_IS_MODULO[{0}]=0\n",
                      one.index, machine_axis(options, signal_name(model, one.table->signal)),
                      machine_axis(options, channel_name(model, *one.column)),
                      position(one.table->step_mm), position(one.table->position_mm.front()),
                      position(one.table->position_mm.back()), one.direction);
}

// ---- HEIDENHAIN ----

std::string padded(std::string text, std::size_t width) {
    text.resize(std::max(width, text.size() + 1), ' ');
    return text;
}

constexpr std::size_t number_width = 8, value_width = 14;

// One axis in HEIDENHAIN's .COM: columns in mm, padded; BACKLASH only for the axis' own column.
std::string com_text(const channel_model &model, const text_options &options,
                     const axis_table &table, const std::string &name) {
    std::string text = fmt::format("BEGIN {} MM\r\n", name);
    text += padded("NR", number_width) + padded("AXISPOS", value_width) +
            padded("BACKLASH", value_width);
    for (const auto &column : table.columns) {
        text += padded(control_name(options, channel_name(model, column)), value_width);
    }
    text += "\r\n";
    for (std::size_t k = 0; k < table.position_mm.size(); ++k) {
        std::string backward, values;
        for (const auto &column : table.columns) {
            const double lost = lost_motion_um(model, options, column);
            const bool both = directed(model, options, column) && column.own;
            values += padded(fixed6(-options.sign * wanted_mm(column, k, lost, both ? 1 : 0)),
                             value_width);
            if (both) backward = fixed6(-options.sign * wanted_mm(column, k, lost, -1));
        }
        text += fmt::format("{}{}{}{}\r\n", padded(std::to_string(k), number_width),
                            padded(position(table.position_mm[k]), value_width),
                            padded(backward, value_width), values);
    }
    return text + "[END]\r\n";
}

}  // namespace

std::string control_name(const text_options &options, const std::string &name) {
    const auto found = options.axis_name.find(name);
    return found == options.axis_name.end() ? name : found->second;
}

std::string machine_axis(const text_options &options, const std::string &name) {
    const auto found = options.axis_name.find(name);
    if (found != options.axis_name.end()) return found->second;
    return name.size() == 1 ? name + "1" : name;
}

std::string fixed6(double value) {
    const std::string text = fmt::format("{:.6f}", value);
    return text == "-0.000000" ? "0.000000" : text;
}

std::vector<std::string> loss_lines(const channel_model &model, const table_set &tables) {
    std::vector<std::string> lines;
    for (const auto &table : tables.tables) {
        for (const auto &column : table.columns) {
            lines.push_back(
                fmt::format("channel {} over {}: {} points every {} mm; largest table step error "
                            "{:.3f} um at {} mm",
                            channel_name(model, column), signal_name(model, table.signal),
                            table.position_mm.size(), position(table.step_mm), column.step_error_um,
                            position(column.step_error_at_mm)));
        }
    }
    for (const auto &[name, value] : tables.held_at) {
        lines.push_back(fmt::format("tables hold {} at {}", name, value));
    }
    for (const auto &loss : tables.losses) {
        std::string where;
        for (const auto &[name, value] : loss.where) {
            where += fmt::format("{}{} {:.1f}", where.empty() ? "" : ", ", name, value);
        }
        lines.push_back(fmt::format(
            "channel {}: all tables together miss up to {:.3f} um of what the box would do{}",
            model.config().channels[loss.channel].name, loss.largest_um,
            where.empty() ? "" : ", at " + where));
    }
    for (const auto &remark : tables.remarks) lines.push_back(remark);
    return lines;
}

// LinuxCNC stops reading at the first line without three numbers, so comments are at the end.
std::vector<output_file> linuxcnc_comp(const channel_model &model, const table_set &tables,
                                       const text_options &options) {
    std::vector<output_file> files;
    for (const auto &table : tables.tables) {
        for (const auto &column : table.columns) {
            const double lost = lost_motion_um(model, options, column);
            std::string text;
            for (std::size_t k = 0; k < table.position_mm.size(); ++k) {
                const double nominal = table.position_mm[k];
                text += machine_length(options, nominal);
                for (const int direction : {1, -1}) {
                    const double trim = options.sign * wanted_mm(column, k, lost, direction);
                    text += " " + machine_length(options, options.trims ? trim : nominal - trim);
                }
                text += "\n";
            }
            text += fmt::format("# COMP_FILE_TYPE = {}\n# values in {}: LINEAR_UNITS = {}\n{}",
                                options.trims ? "1" : "0", options.unit, options.unit,
                                comment_lines(model, tables, options, "# "));
            files.push_back({control_name(options, channel_name(model, column)) + ".comp", text});
        }
    }
    return files;
}

// in : tables along the corrected axis itself
// out: AX_EEC.INI with values in mm, negated because the control adds them
std::vector<output_file> sinumerik_lec(const channel_model &model, const table_set &tables,
                                       const text_options &options) {
    std::string text =
        "%_N_AX_EEC_INI\nCHANDATA(1)\n" + comment_lines(model, tables, options, "; ");
    for (const auto &table : tables.tables) {
        for (const auto &column : table.columns) {
            const std::string axis = machine_axis(options, channel_name(model, column));
            text += fmt::format("; {}: needs $MA_MM_ENC_COMP_MAX_POINTS[0,{}] = {} or more\n", axis,
                                axis, table.position_mm.size());
            for (std::size_t k = 0; k < table.position_mm.size(); ++k) {
                text += fmt::format("$AA_ENC_COMP[0,{},{}]={}\n", k, axis,
                                    fixed6(-options.sign * column.wanted_um[k] / um_per_mm));
            }
            text += fmt::format(
                "$AA_ENC_COMP_STEP[0,{0}]={1}\n"
                "$AA_ENC_COMP_MIN[0,{0}]={2}\n"
                "$AA_ENC_COMP_MAX[0,{0}]={3}\n"
                "$AA_ENC_COMP_IS_MODULO[0,{0}]=0\n",
                axis, position(table.step_mm), position(table.position_mm.front()),
                position(table.position_mm.back()));
        }
    }
    return {{"AX_EEC.INI", text + "M17\n"}};
}

std::vector<output_file> sinumerik_cec(const channel_model &model, const table_set &tables,
                                       const text_options &options) {
    std::string text =
        "%_N_NC_CEC_INI\nCHANDATA(1)\n" + comment_lines(model, tables, options, "; ");
    int index = options.first_table;
    for (const auto &table : tables.tables) {
        for (const auto &column : table.columns) {
            const bool both = directed(model, options, column);
            for (const int direction : both ? std::vector<int>{1, -1} : std::vector<int>{0}) {
                text += cec_text(model, options, {index++, direction, &table, &column});
            }
        }
    }
    return {{"NC_CEC.INI", text + "M17\n"}};
}

std::vector<output_file> heidenhain_com(const channel_model &model, const table_set &tables,
                                        const text_options &options) {
    std::vector<output_file> files;
    for (const auto &table : tables.tables) {
        const std::string name = control_name(options, signal_name(model, table.signal)) + ".COM";
        files.push_back({name, com_text(model, options, table, name)});
    }
    files.push_back({"EXPORT.TXT", comment_lines(model, tables, options, "")});
    return files;
}

}  // namespace compbox::exports
