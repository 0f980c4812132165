// SPDX-License-Identifier: MIT
// compbox check: loads a coefficient file with the box's own loader.
#include <map>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "host-tools/coefficients/baud_table.h"
#include "host-tools/coefficients/compare.h"
#include "host-tools/coefficients/load.h"
#include "host-tools/coefficients/profile_report.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox {

namespace {

struct check_options {
    std::string path;
    bool for_stm32f405 = false;
    bool as_json = false;
};

// out: budget of the exchange on a serial line, and the time that each baud rate needs, ms
json serial_figures(const cb_config &config) {
    json rates = json::array();
    for (const auto &row : coefficients::baud_table(config)) {
        rates.push_back({{"baud", row.baud},
                         {"fc3_fc16_ms", row.fc3_fc16_ms},
                         {"fc23_ms", row.fc23_ms},
                         {"after_loss_ms", row.after_loss_ms},
                         {"fits", row.fits}});
    }
    return {{"baud", config.plc.serial.line.baud},
            {"budget_ms", coefficients::exchange_budget_ms(config)},
            {"rates", rates}};
}

// out: a sentence for each consequence of the profile and each part that hardly belongs to another
std::vector<std::string> remarks_of(const cb_config &config,
                                    const coefficients::comparison &found) {
    auto remarks = coefficients::profile_remarks(config);
    for (const auto &refusal : found.refusals) {
        const std::string term = refusal.term.empty() ? "" : "term ";
        remarks.push_back(term + refusal.sentence);
    }
    remarks.insert(remarks.end(), found.remarks.begin(), found.remarks.end());
    return remarks;
}

// Prints what the box's loader reads from the file. Throws input_error with the loader's message.
void check(const check_options &options, const cli::streams &io) {
    std::string text;
    const cb_target &target =
        options.for_stm32f405 ? coefficients::stm32f405_target : coefficients::any_target;
    const auto config = coefficients::load_coefficients(options.path, &text, target);
    const auto memory = coefficients::memory_of(*config, text.size());
    const json file = json::parse(text, nullptr, false);  // provenance may have any number
    const auto found = coefficients::compare(*config, file.is_object() ? file : json::object());
    const auto remarks = remarks_of(*config, found);
    if (options.as_json) {
        json figures = {{"machine", config->machine},
                        {"revision", config->revision},
                        {"signals", config->signals_count},
                        {"terms", config->terms_count},
                        {"channels", config->channels_count},
                        {"demand", found.channels},
                        {"curves", found.curves},
                        {"plc", coefficients::profile_figures(*config)}};
        if (config->plc.transport == CB_TRANSPORT_RTU) figures["serial"] = serial_figures(*config);
        for (const auto &one : memory)
            figures["memory"][one.name] = {{"used", one.used}, {"most", one.most}};
        return cli::print_summary(io.out, {}, figures, remarks);
    }
    io.out << config->machine << ", revision " << config->revision << ": "
           << coefficients::summary(*config) << "\n"
           << coefficients::profile_text(*config) << coefficients::baud_table_text(*config);
    if (options.for_stm32f405) io.out << coefficients::memory_text(target, memory) << "\n";
    for (const auto &line : found.lines) io.out << line << "\n";
    for (const auto &remark : remarks) io.out << "Remark: " << remark << "\n";
}

}  // namespace

void add_check(cli::command &app) {
    auto command = app.add_subcommand("check", "Check a coefficient file as the box does");
    const auto options = std::make_shared<check_options>();
    command.add_option("FILE", options->path, "Coefficient file").required();
    command.add_choice("--target BOX", options->for_stm32f405,
                       std::map<std::string, bool>{{"any", false}, {"stm32f405", true}},
                       "Box that will run the file: any, or stm32f405, with its memory in use");
    cli::add_json(command, options->as_json);
    command.footer(
        R"(Loads the file with the box's own loader and prints what it found, the abilities of the PLC's
profile and remarks. The first mistake is reported with its place and line; the exit code is then 1.

Example:
  compbox check coefficients.json)");
    command.callback([options](const cli::streams &io) { check(*options, io); });
}

}  // namespace compbox
