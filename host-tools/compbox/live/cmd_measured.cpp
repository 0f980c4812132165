// SPDX-License-Identifier: MIT
// compbox measured: a deviation that a person has measured, for a running box.
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>
#include <sstream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/live/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

namespace compbox::live {

namespace {

constexpr double most_um = 10000.0;  // 10 mm: no deviation of a machine tool
constexpr std::size_t most_measured_bytes = 2048;

struct measured_arguments {
    std::string name, file = "/run/compboxd/measured";
    double um = 0.0;
    bool as_json = false;
};

constexpr const char *measured_example =
    R"(NAME is that of the signals with "hand" in the coefficient file, as X; VALUE is the deviation of the tool
from the workpiece in um, with the compensation as it is. The box takes it within a second, and logs it.

Example:
  compbox measured X 4.2)";

// Throws input_error for a name that no file can have.
void check_name(const std::string &name) {
    const bool plain = name.find_first_not_of(
                           "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-.") ==
                       std::string::npos;
    if (name.empty() || name.size() > 4 || !plain) {
        throw cli::usage_error("NAME",
                               fmt::format("'{}' is not a name of 1 to 4 letters and digits, as X",
                                           formats::printable(name)));
    }
}

// out: the lines of the file, without that of `name`, and the last count of that one
struct other_lines {
    std::string text;
    std::optional<unsigned> count;
};

// out: the count of a line NAME UM COUNT TIME (hal/linux/hand.h); nothing for any other line
std::optional<unsigned> count_of_line(const std::string &line) {
    std::istringstream words(line);
    std::string name, more;
    double um = 0.0;
    unsigned count = 0;
    long long unix_s = 0;
    if (!(words >> name >> um >> count >> unix_s) || words >> more) return std::nullopt;
    return count <= 0xFFFF ? std::optional(count) : std::nullopt;
}

// Throws input_error for a file that is not one of this command.
other_lines lines_of(const std::string &file, const std::string &name) {
    other_lines all;
    if (!std::filesystem::exists(std::filesystem::symlink_status(file))) return all;
    std::istringstream text(formats::read_file(file, most_measured_bytes));
    std::size_t number = 0;
    for (std::string line; std::getline(text, line);) {
        const auto count = count_of_line(line);
        ++number;
        if (!count) {
            throw input_error(file, number, 0,
                              "is not NAME UM COUNT TIME; remove the file, or name another one "
                              "with --file");
        }
        if (line.substr(0, line.find(' ')) == name) {
            all.count = count;
        } else {
            all.text += line + "\n";
        }
    }
    return all;
}

// Writes the file with another line of the name, whose count is one higher, and prints what it
// wrote. Throws usage_error for a bad name, and input_error for a missing folder or a file of
// another kind.
void run_measured(const measured_arguments &arguments, const cli::streams &io) {
    check_name(arguments.name);
    const auto folder = std::filesystem::path(arguments.file).parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder)) {
        throw input_error(arguments.file, 0, 0,
                          "there is no folder {}: start compboxd, or name its --measured file with "
                          "--file",
                          folder.string());
    }
    const other_lines others = lines_of(arguments.file, arguments.name);
    const unsigned count = (others.count.value_or(0) + 1) & 0xFFFF;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const auto unix_s = std::chrono::duration_cast<std::chrono::seconds>(now).count();
    formats::update_file(arguments.file, fmt::format("{}{} {:.6g} {} {}\n", others.text,
                                                     arguments.name, arguments.um, count, unix_s));
    if (arguments.as_json) {
        return cli::print_summary(
            io.out, {arguments.file},
            {{"name", arguments.name}, {"um", arguments.um}, {"count", count}}, {});
    }
    io.out << fmt::format(
        "{} {:.6g} um, measurement {}; the log of compboxd states whether the box takes it\n",
        arguments.name, arguments.um, count);
}

}  // namespace

void add_measured(cli::command &app) {
    const auto arguments = std::make_shared<measured_arguments>();
    cli::command measured =
        app.add_subcommand("measured", "Give a running box a deviation measured by hand");
    measured.footer(measured_example);
    measured.add_option("NAME", arguments->name, "Name of the measured axis or channel").required();
    measured
        .add_option("VALUE", arguments->um,
                    "Deviation of the tool from the workpiece, um, -10000 to 10000")
        .required()
        .check(cli::between(-most_um, most_um));
    measured.add_option("--file FILE", arguments->file, "File that compboxd reads, its --measured")
        .capture_default_str();
    cli::add_json(measured, arguments->as_json);
    measured.callback([arguments](const cli::streams &io) { run_measured(*arguments, io); });
}

}  // namespace compbox::live
