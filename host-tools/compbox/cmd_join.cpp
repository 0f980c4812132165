// SPDX-License-Identifier: MIT
// compbox join: what the box recorded and what was probed, to the rows that `train` reads.
#include <fmt/core.h>

#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/metrology/join.h"

namespace compbox {

namespace {

struct join_arguments {
    std::string record, probe, output;
    join_options options;
    bool as_json = false;
};

constexpr const char *join_example =
    "Example:\n"
    "  compbox join record.csv probe.csv -o data.csv\n"
    "record.csv is what compboxd --record wrote; probe.csv has time_s or positions (X,Y,Z), and\n"
    "error_X_um … for the channels X …, as probed with the box at work: error = machine's error +\n"
    "compensation, so comp_X_um is taken off it again.";

// Joins recording and probed errors row by row, writes the table, and prints remarks.
void run_join(const join_arguments &arguments, const cli::streams &io) {
    csv_reading with_gaps;
    with_gaps.gaps = true;
    std::vector<std::vector<std::string>> words;  // by column
    const csv_table record = read_csv(arguments.record, with_gaps);
    const csv_table probe = read_csv(arguments.probe, {"run"}, &words);
    const int run = probe.find("run");
    const joined_rows joined = join_rows(
        record, probe, run < 0 ? std::vector<std::string>() : words[static_cast<std::size_t>(run)],
        arguments.options);
    write_file(arguments.output, joined_text(joined), &io.out);
    if (arguments.output == "-") return;
    if (arguments.as_json) {
        json report;
        report["rows"] = joined.rows.size();
        report["matched_by"] = joined.by_time ? "time" : "position";
        report["columns"] = joined.names;
        report["remarks"] = joined.remarks;
        io.out << json_text(report);
        return;
    }
    io.out << fmt::format("{} rows, matched by {}: {}\n", joined.rows.size(),
                          joined.by_time ? "time" : "position", arguments.output);
    for (const auto &remark : joined.remarks) io.out << remark << "\n";
}

}  // namespace

void add_join(cli::command &app) {
    const auto arguments = std::make_shared<join_arguments>();
    join_options &options = arguments->options;
    cli::command join =
        app.add_subcommand("join", "The box's recording and probed errors to one table");
    join.footer(join_example);
    join.add_option("record", arguments->record, "Recording of compboxd, RECORD.csv").required();
    join.add_option("probe", arguments->probe, "Probed errors, PROBE.csv").required();
    join.add_option("--time-offset-s", options.time_offset_s,
                    "What to add to the probe's time to get the record's (0)")
        .check(any_number())
        .option_text("S");
    join.add_option("--longest-gap-s", options.longest_gap_s,
                    "Refuse a probed time in a longer gap of the recording (1)")
        .check(above_zero())
        .option_text("S");
    join.add_option("--tolerance-mm", options.tolerance_mm, "By position: as near as this (0.05)")
        .check(above_zero())
        .option_text("T");
    join.add_option("--signals", options.signals,
                    "Columns of the record to take (else all but outputs: comp_…, EXX … ECZ)")
        .delimiter(',')
        .option_text("X,T1,…");
    join.add_flag("!--keep-compensated", options.add_back,
                  "Leave the errors as probed: the compensation was not applied");
    join.add_flag("--json", arguments->as_json, "Print what was done as JSON");
    join.add_option("-o,--output", arguments->output, "Table to write, DATA.csv").required();
    join.callback([arguments](const cli::streams &io) { run_join(*arguments, io); });
}

}  // namespace compbox
