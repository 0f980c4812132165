// SPDX-License-Identifier: MIT
#include "host-tools/command_line/summary.h"

#include <algorithm>
#include <ostream>

#include "host-tools/formats/json.h"

namespace compbox::cli {

void add_json(cli::command &command, bool &as_json) {
    command.add_flag("--json", as_json, "Print the result as JSON");
}

bool on_stdout(const std::vector<std::string> &files) {
    return std::any_of(files.begin(), files.end(), [](const std::string &file) {
        return file == "-" || file == "/dev/stdout";
    });
}

void print_summary(std::ostream &out, const std::vector<std::string> &files, const json &figures,
                   const std::vector<std::string> &remarks) {
    if (on_stdout(files)) return;
    json summary;
    summary["files"] = files;
    summary.update(figures);
    summary["remarks"] = remarks;
    out << formats::json_text(summary);
}

}  // namespace compbox::cli
