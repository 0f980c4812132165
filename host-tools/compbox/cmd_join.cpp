// SPDX-License-Identifier: MIT
// compbox join: what the box recorded and what was probed, to the rows that `train` reads.
#include <fmt/core.h>

#include <memory>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/csv_reading.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/metrology/probed_record.h"

namespace compbox {

namespace {

struct join_arguments {
    std::string record, probe, output;
    std::vector<std::string> probes;  // "X=probe_x,probe_x_n"
    metrology::join_options options;
    bool as_json = false;
};

constexpr const char *join_example =
    R"(RECORD is a file of compboxd --record. PROBE has time_s or positions (X,Y,Z), and error_X_um … for
the channels X …, probed while the box compensates. The result is the machine's own error:
comp_X_um is subtracted from the probed error. Without PROBE the record's own probe columns are taken:
each new count of probe_x_n is a measurement with the value probe_x.

Example:
  compbox join record.csv probe.csv -o data.csv)";

// in : "X=probe_x,probe_x_n". Throws usage_error for another form.
metrology::probe_columns probe_of(const std::string &text) {
    const std::size_t equals = text.find('='), comma = text.find(',');
    metrology::probe_columns probe;
    if (equals != std::string::npos && comma != std::string::npos && equals < comma) {
        probe = {text.substr(0, equals), text.substr(equals + 1, comma - equals - 1),
                 text.substr(comma + 1)};
    }
    if (probe.channel.empty() || probe.value.empty() || probe.count.empty()) {
        throw cli::usage_error("--probe", "'" + text + "' is not CHANNEL=VALUE,COUNT");
    }
    return probe;
}

// Rows from the probe columns of the record itself.
metrology::joined_rows join_own_probes(const formats::csv_table &record,
                                       const join_arguments &arguments) {
    std::vector<metrology::probe_columns> probes;
    for (const auto &text : arguments.probes) probes.push_back(probe_of(text));
    if (probes.empty()) probes = metrology::find_probes(record);
    if (probes.empty()) {
        throw input_error(record.file, 0, 0,
                          "has no columns probe_NAME and probe_NAME_n: name the probe's with "
                          "--probe CHANNEL=VALUE,COUNT, or give a PROBE.csv");
    }
    return metrology::join_probed_record(record, probes, arguments.options);
}

// "error_X [mm]" -> error_X_um; else the unit of the machine.
formats::wanted_column unit_of_probe(const std::string &name, const formats::measuring_unit &is) {
    const bool error = name.compare(0, 6, "error_") == 0 && is.of == formats::quantity::length;
    return error ? formats::wanted_column{name + "_um", formats::find_unit("um")}
                 : formats::machine_unit(name, is);
}

// Rows from the record and a table of probed errors.
metrology::joined_rows join_table(const formats::csv_table &record,
                                  const join_arguments &arguments) {
    std::vector<std::vector<std::string>> words;  // by column
    formats::csv_reading of_probe;
    of_probe.words = {"run"};
    of_probe.units = unit_of_probe;
    const formats::csv_table probe = formats::read_csv(arguments.probe, of_probe, &words);
    const int run = probe.find("run");
    return metrology::join_rows(
        record, probe, run < 0 ? std::vector<std::string>() : words[static_cast<std::size_t>(run)],
        arguments.options);
}

// Joins recording and probed errors row by row, writes the table, and prints remarks.
void run_join(const join_arguments &arguments, const cli::streams &io) {
    formats::csv_reading with_gaps;
    with_gaps.gaps = true;
    const formats::csv_table record = formats::read_csv(arguments.record, with_gaps);
    const bool own = arguments.probe.empty();
    const metrology::joined_rows joined =
        own ? join_own_probes(record, arguments) : join_table(record, arguments);
    const std::string by = own ? "count" : joined.by_time ? "time" : "position";
    formats::write_file(arguments.output, metrology::joined_text(joined), &io.out);
    if (cli::on_stdout({arguments.output})) return;
    if (arguments.as_json) {
        json report;
        report["rows"] = joined.rows.size();
        report["matched_by"] = by;
        report["columns"] = joined.names;
        report["remarks"] = joined.remarks;
        io.out << formats::json_text(report);
        return;
    }
    io.out << fmt::format("{} rows, matched by {}: {}\n", joined.rows.size(), by, arguments.output);
    for (const auto &remark : joined.remarks) io.out << remark << "\n";
}

}  // namespace

void add_join(cli::command &app) {
    const auto arguments = std::make_shared<join_arguments>();
    metrology::join_options &options = arguments->options;
    cli::command join =
        app.add_subcommand("join", "The box's recording and probed errors to one table");
    join.footer(join_example);
    join.add_option("RECORD", arguments->record, "Recording of compboxd, RECORD.csv").required();
    join.add_option("PROBE", arguments->probe,
                    "Probed errors, PROBE.csv (else the record's own probe columns)");
    join.add_option("--probe X=VALUE,COUNT", arguments->probes,
                    "Channel and columns of a probe in the record, once for each (else "
                    "probe_NAME and probe_NAME_n)");
    join.add_option("--together-s S", options.together_s,
                    "Probes of one record within this time are one row (120)")
        .check(cli::above_zero());
    join.add_option("--time-offset-s S", options.time_offset_s,
                    "What to add to the probe's time to get the record's (0)")
        .check(cli::any_number());
    join.add_option("--longest-gap-s S", options.longest_gap_s,
                    "Refuse a probed time in a longer gap of the recording (1)")
        .check(cli::above_zero());
    join.add_option("--tolerance-mm T", options.tolerance_mm, "By position: as near as this (0.05)")
        .check(cli::above_zero());
    join.add_option("--signals X,T1,…", options.signals,
                    "Columns of the record to take (else all but outputs: comp_…, EXX … ECZ)")
        .delimiter(',');
    join.add_flag("!--keep-compensated", options.add_back,
                  "Leave the errors as probed: the compensation was not applied");
    join.add_flag("--json", arguments->as_json, "Print what was done as JSON");
    join.add_option("-o,--output DATA.csv", arguments->output, "Table to write, DATA.csv")
        .required();
    join.callback([arguments](const cli::streams &io) { run_join(*arguments, io); });
}

}  // namespace compbox
