// SPDX-License-Identifier: MIT
#include "host-tools/command_line/summary.h"

#include <algorithm>
#include <ostream>

#include "host-tools/formats/json.h"

namespace compbox::cli {

void add_json(cli::command &command, bool &as_json) {
    command.add_flag("--json", as_json, "Print the result as JSON");
}

void print_summary(std::ostream &out, const std::vector<std::string> &files, const json &figures,
                   const std::vector<std::string> &remarks) {
    for (const char *name : {"-", "/dev/stdout"}) {
        if (std::count(files.begin(), files.end(), name) > 0) return;
    }
    json summary;
    summary["files"] = files;
    summary.update(figures);
    summary["remarks"] = remarks;
    out << formats::json_text(summary);
}

}  // namespace compbox::cli
