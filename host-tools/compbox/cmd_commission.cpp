// SPDX-License-Identifier: MIT
// compbox commission: register map, signs and times, against a live PLC.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <ostream>
#include <string>

#include "host-tools/command_line/key_values.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/commission/checks.h"
#include "host-tools/commission/prompt.h"
#include "host-tools/commission/write.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

namespace compbox {

namespace {

constexpr double settling_s = 1.0;  // before a person or script reads an instrument

struct commission_options {
    std::string path, output;
    std::vector<std::string> axes, measured_text;
    std::map<std::string, double> measured_um;
    double offset_um = 20.0, rate_um_per_s = 50.0;
    int steps = 50;
    bool as_json = false;
};

class commissioning {
  public:
    commissioning(const commission_options &options, const cli::streams &io)
        : io_(io),
          options_(options),
          document_(read_json(options.path)),
          setup_(commission::make_box_setup(document_, options.path, options.rate_um_per_s)) {
        check_choice();
        commission::with_result(document_, options.path, {});  // before anything moves
    }

    void run() {
        commission::prepare_process();
        commission::live_box live(setup_);
        try {
            walk(live);
        } catch (const input_error &error) {
            const bool at_zero = live.stop();
            throw input_error(options_.path, 0, 0,
                              error.what() + std::string(at_zero ? "" : unconfirmed()));
        }
        if (!live.stop()) throw input_error(options_.path, 0, 0, unconfirmed());
        finish();
    }

  private:
    static const char *unconfirmed() {
        return "; the PLC did not confirm that the offset is zero again: its own watchdog has to "
               "take it back";
    }

    void say(const std::string &line) const {
        if (!options_.as_json) io_.out << line << std::endl;
    }

    bool is_chosen(const commission::test_axis &axis) const {
        return options_.axes.empty() ||
               std::count(options_.axes.begin(), options_.axes.end(), axis.name) > 0;
    }

    void check_choice() const {
        std::string known;
        for (const auto &axis : setup_.axes) known += (known.empty() ? "" : ", ") + axis.name;
        const auto must_be_known = [&](const std::string &option, const std::string &name) {
            for (const auto &axis : setup_.axes) {
                if (axis.name == name && is_chosen(axis)) return;
            }
            throw cli::usage_error(option,
                                   fmt::format("no axis {} to test; there is {}", name, known));
        };
        for (const auto &name : options_.axes) must_be_known("--axis", name);
        for (const auto &[name, um] : options_.measured_um) must_be_known("--measured", name);
    }

    // Registers, then the sign of each chosen axis, then times. Throws input_error at the first
    // that fails; the caller brings the offsets back to zero.
    void walk(commission::live_box &live) {
        say("1. Registers");
        result_.registers = commission::check_registers(live, setup_);
        for (const auto &[name, value] : result_.registers["signals"].items()) {
            say(fmt::format("   {} = {:.4g}", name, value.get<double>()));
        }
        const double update_ms = result_.registers["update_ms"].get<double>();
        const std::string refused = commission::read_back_remark(live);
        say(fmt::format(
            "   the heartbeat counts every {:.4g} ms, writes are accepted, {}", update_ms,
            refused.empty() ? "the write block is read back" : "its read-back is refused"));
        if (!refused.empty()) setup_.remarks.push_back(refused);
        commission::become_active(live);
        for (const auto &axis : setup_.axes) {
            if (is_chosen(axis)) test_sign(live, axis);
        }
        measure(live, update_ms);
    }

    // out: the measured displacement, µm, from --measured or from the prompt
    double measure_axis(commission::live_box &live, const commission::test_axis &axis) {
        const auto given = options_.measured_um.find(axis.name);
        const auto wait = [&live] { commission::stay_active(live, 0.0); };
        if (given == options_.measured_um.end()) {
            prompt_.ask(
                fmt::format("   {}: set the indicator to zero, + as the axis counts; then Enter: ",
                            axis.name),
                wait);
        }
        commission::go_to(live, axis, options_.offset_um);
        commission::stay_active(live, settling_s);
        if (given != options_.measured_um.end()) return given->second;
        return prompt_.ask_number(
            fmt::format("   {}: what does the indicator show, in µm? ", axis.name), wait);
    }

    void test_sign(commission::live_box &live, const commission::test_axis &axis) {
        say(fmt::format("2. Sign of {}: {:.4g} µm", axis.name, options_.offset_um));
        commission::go_to(live, axis, 0.0);
        const double measured_um = measure_axis(live, axis);
        commission::go_to(live, axis, 0.0);
        const bool reversed = commission::is_reversed(axis.name, options_.offset_um, measured_um);
        for (const std::size_t channel : axis.channels) {
            const int sign = setup_.config->channels[channel].sign * (reversed ? -1 : 1);
            result_.signs[channel] = {options_.offset_um, measured_um, sign};
        }
        say(fmt::format("   measured {:.4g} µm: sign {}{}", measured_um,
                        result_.signs[axis.channels.front()].sign,
                        reversed ? ", reversed" : ", as in the file"));
    }

    // Measures times on the first chosen channel with `applied`.
    void measure(commission::live_box &live, double update_ms) {
        for (const auto &axis : setup_.axes) {
            const bool alone = axis.channels.size() == 1;
            const std::size_t channel = axis.channels.front();
            if (!alone || !is_chosen(axis) || !setup_.config->channels[channel].has_applied) {
                continue;
            }
            say("3. Times, on " + axis.name);
            result_.times = commission::measure_times(live, channel, options_.steps, update_ms);
            return say_times(*result_.times);
        }
        setup_.remarks.push_back(
            "no times were measured: that takes a channel with applied that is in no pair");
    }

    void say_times(const commission::loop_times &times) {
        say(fmt::format("   exchange {:.4g} ms, 99 % below {:.4g} ms", times.exchange.p50_ms,
                        times.exchange.p99_ms));
        say(fmt::format("   from write to applied {:.4g} ms, 99 % below {:.4g} ms",
                        times.taken_over.p50_ms, times.taken_over.p99_ms));
        say(fmt::format(
            "   lead {:.4g} ms; the period must be at least {:.4g} ms, the file has {:.4g}",
            commission::lead_of(times), commission::shortest_period_ms(times), times.period_ms));
        if (times.period_ms < commission::shortest_period_ms(times)) {
            setup_.remarks.push_back(
                fmt::format("period_ms is too short for this PLC: take {:.4g} or more",
                            commission::shortest_period_ms(times)));
        }
    }

    // Writes the file with signs, lead and provenance, and prints remarks or the summary.
    void finish() {
        const std::string &output = options_.output.empty() ? options_.path : options_.output;
        const json changed = commission::with_result(document_, options_.path, result_);
        update_file(output, json_text(changed), &io_.out);
        if (options_.as_json) {
            json figures = commission::figures_of(document_, result_);
            figures["registers"] = result_.registers;
            return print_summary(io_.out, {output}, figures, setup_.remarks);
        }
        if (output == "-") return;
        for (const auto &remark : setup_.remarks) say("Remark: " + remark);
        say(fmt::format(
            "Written to {}: sign of each tested channel{}, provenance.commissioning", output,
            result_.times && changed["cycle"]["lead_ms"].is_number()
                ? fmt::format(", lead_ms {:.4g}", changed["cycle"]["lead_ms"].get<double>())
                : ""));
    }

    const cli::streams &io_;
    commission::prompt prompt_{io_.in, io_.err};
    commission_options options_;
    json document_;
    commission::box_setup setup_;
    commission::findings result_;
};

// in : "X=+19.8", several in one or more options. out: µm by axis
std::map<std::string, double> measured_of(const std::vector<std::string> &texts) {
    std::map<std::string, double> measured;
    for (std::string text : texts) {
        const std::size_t plus = text.find("=+");
        if (plus != std::string::npos) text.erase(plus + 1, 1);
        const key_values pair = parse_key_values("--measured", text);
        if (pair.values.size() != 1 || !measured.insert({pair.key, pair.values[0]}).second) {
            throw cli::usage_error("--measured", "one number for each axis, please: " + text);
        }
    }
    return measured;
}

}  // namespace

void add_commission(cli::command &app) {
    auto command = app.add_subcommand(
        "commission", "Check registers, find signs and times on the machine, with its PLC");
    const auto options = std::make_shared<commission_options>();
    command.add_option("FILE", options->path, "Machine or coefficient file").required();
    command.add_option("--axis AXIS", options->axes,
                       "Only this channel (X) or pair (X1+X2); repeatable");
    command.add_option(
        "--measured X=D", options->measured_text,
        "Reading of the instrument at the offset, um: X=+19.8 (else the command asks)");
    command.add_option("--offset-um D", options->offset_um, "Offset of the sign test, 1 to 200")
        .capture_default_str()
        .check(between(1, 200));
    command
        .add_option("--rate-um-per-s V", options->rate_um_per_s,
                    "Maximum rate of the offset, 1 to 1000")
        .capture_default_str()
        .check(between(1, 1000));
    command.add_option("--steps N", options->steps, "Small steps for the times, 5 to 1000")
        .capture_default_str()
        .check(whole_between(5, 1000));
    command.add_option("-o,--output F.json", options->output,
                       "File to write (default: FILE itself)");
    add_json(command, options->as_json);
    command.footer(R"(Ctrl-C brings the offset back to zero and writes nothing.

Example:
  compbox commission machine.json --axis X --measured X=+19.8)");
    command.callback([options](const cli::streams &io) {
        options->measured_um = measured_of(options->measured_text);
        commissioning(*options, io).run();
    });
}

}  // namespace compbox
