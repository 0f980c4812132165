// SPDX-License-Identifier: MIT
// compbox commission: register map, signs and times, against a live PLC.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <ostream>
#include <string>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/commission/checks.h"
#include "host-tools/commission/event_note.h"
#include "host-tools/commission/questions.h"
#include "host-tools/commission/second_opinion.h"
#include "host-tools/commission/statements.h"
#include "host-tools/commission/write.h"
#include "host-tools/compbox/live/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::live {

namespace {

constexpr double settling_s = 1.0;  // before a person or script reads an instrument

struct commission_options {
    std::string path, output, events;
    std::vector<std::string> axes, measured_text, shows_text, together_text;
    std::map<std::string, double> measured_um;
    commission::position_options positions;
    double offset_um = 20.0, rate_um_per_s = 50.0;
    int steps = 50;
    bool as_json = false, watch = false, only_registers = false;
};

class commissioning {
  public:
    commissioning(const commission_options &options, const cli::streams &io)
        : io_(io),
          questions_(io, options.watch),
          options_(options),
          document_(formats::read_json(options.path)),
          setup_(commission::make_box_setup(document_, options.path, options.rate_um_per_s)),
          map_(setup_) {
        check_choice();
        check_output();
        if (!options.events.empty()) commission::check_events_file(options.events);
        check_positions();
        commission::with_result(document_, options.path, {});  // before anything moves
    }

    void run() {
        commission::prepare_process();
        commission::second_opinion by_libmodbus(setup_.config->plc);
        commission::live_box live(setup_);
        try {
            walk(live, by_libmodbus);
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

    std::string channel_name(std::size_t channel) const {
        return setup_.config->channels[channel].name;
    }

    void check_choice() const {
        if (options_.only_registers && !options_.measured_um.empty())
            throw cli::usage_error("--measured", "--registers ends before the signs are tested");
        std::vector<std::string> axes, tests;
        for (const auto &axis : setup_.axes) {
            axes.push_back(axis.name);
            if (!is_chosen(axis)) continue;
            tests.push_back(axis.name);
            if (axis.channels.size() == 1) continue;
            for (const std::size_t channel : axis.channels) tests.push_back(channel_name(channel));
        }
        for (const auto &name : options_.axes)
            commission::must_be_known("--axis", "axis", name, axes);
        for (const auto &[name, um] : options_.measured_um)
            commission::must_be_known("--measured", "axis", name, tests);
    }

    const std::string &output() const {
        return options_.output.empty() ? options_.path : options_.output;
    }

    // Throws input_error if the result could not be written after the walk.
    void check_output() const {
        const auto folder = std::filesystem::path(output()).parent_path();
        if (output() == "-" || ::access(folder.empty() ? "." : folder.c_str(), W_OK) == 0) return;
        throw input_error(output(), 0, 0, "cannot create a file there ({})", std::strerror(errno));
    }

    // Checks --shows, --together and the ranges, adds the motors of pairs, and finds what an
    // earlier run saw.
    void check_positions() {
        commission::position_options &positions = options_.positions;
        commission::check_statements(positions, map_.signals());
        for (const auto &axis : setup_.axes) {
            std::vector<std::string> motors;
            for (const std::size_t channel : axis.channels) motors.push_back(channel_name(channel));
            positions.together.push_back(motors);
        }
        if (!options_.axes.empty()) {
            positions.seen_before =
                commission::earlier_figures(document_).value("positions", json());
        }
        try {
            commission::check_ranges(setup_, map_.signals());
        } catch (const input_error &error) {
            throw input_error(options_.path, 0, 0, error.what());
        }
    }

    // Registers, then the sign of each chosen axis, then times. Throws input_error at the first
    // that fails; the caller brings the offsets back to zero.
    void walk(commission::live_box &live, commission::second_opinion &by_libmodbus) {
        say("1. Registers");
        by_libmodbus.observe(live);
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
        add_second_opinion(by_libmodbus.compare(live));
        compare(live);
        if (options_.only_registers) return;
        commission::become_active(live);
        for (const auto &axis : setup_.axes) {
            if (is_chosen(axis)) test_sign(live, axis);
        }
        measure(live, update_ms);
    }

    // Compares the signals with the control's display, each position before and after a jog.
    void compare(commission::live_box &live) {
        map_.observe(live);
        std::ostream &requests = options_.as_json ? io_.err : io_.out;
        const auto dialog = questions_.about_positions(
            live, map_, [&requests](const auto &line) { requests << line << std::endl; });
        result_.positions = commission::check_positions(live, map_, dialog, options_.positions);
    }

    // in : the box's readings beside libmodbus', or null
    void add_second_opinion(const json &readings) {
        if (readings.is_null()) return;
        result_.registers["libmodbus"] = readings;
        const std::string text = commission::comparison_text(readings);
        const std::string remark = commission::comparison_remark(readings);
        if (!text.empty()) say(text);
        if (!remark.empty()) setup_.remarks.push_back(remark);
    }

    // Displacement of the tool by an offset; reversed: it is against it
    struct motion {
        double measured_um;
        bool reversed;
    };

    // in : the channels are at the offset. out: the reading of the instrument, from --measured or
    // from the prompt. Throws input_error for one that is no sign, unless a person can read again.
    motion read_instrument(const commission::test_axis &axis, double offset_um,
                           const std::function<void()> &wait) {
        const auto given = options_.measured_um.find(axis.name);
        for (;;) {
            const double measured_um =
                given != options_.measured_um.end()
                    ? given->second
                    : questions_.micrometres(
                          fmt::format("   {}: what does the indicator show, in µm? ", axis.name),
                          measured_option(axis), wait);
            try {
                return {measured_um, commission::is_reversed(axis.name, offset_um, measured_um)};
            } catch (const input_error &error) {
                if (given != options_.measured_um.end()) throw;
                questions_.again(error.what());
            }
        }
    }

    static std::string measured_option(const commission::test_axis &axis) {
        return fmt::format("--measured {}=UM", axis.name);
    }

    motion test_motion(commission::live_box &live, const commission::test_axis &axis,
                       double offset_um) {
        const auto wait = [&live] { commission::stay_active(live, 0.0); };
        say(fmt::format("2. Sign of {}: {:.4g} µm", axis.name, offset_um));
        commission::go_to(live, axis, 0.0);
        if (options_.measured_um.count(axis.name) == 0) {
            questions_.line(
                fmt::format("   {}: set the indicator to zero, + as the axis counts; then Enter: ",
                            axis.name),
                measured_option(axis), wait);
        }
        commission::go_to(live, axis, offset_um);
        commission::stay_active(live, settling_s);
        const motion found = read_instrument(axis, offset_um, wait);
        commission::go_to(live, axis, 0.0);
        return found;
    }

    // Each motor of a pair by itself, within the pair's difference. Throws input_error if one does
    // not move, or if both do not move the same way: together they would twist the stage.
    std::vector<motion> test_motors(commission::live_box &live, const commission::test_axis &axis) {
        std::vector<motion> all;
        if (axis.channels.size() == 1) return all;
        const double offset_um = std::min(options_.offset_um, axis.max_difference_um);
        say(fmt::format("   the motors of {} one after the other: put the indicator at the motor",
                        axis.name));
        for (const std::size_t channel : axis.channels) {
            all.push_back(test_motion(live, {channel_name(channel), {channel}, 0.0}, offset_um));
        }
        if (all[0].reversed == all[1].reversed) return all;
        const std::string other = channel_name(axis.channels[all[0].reversed ? 0 : 1]);
        throw input_error(fmt::format(
            "axis {}: {} moves the tool the other way than its partner; invert channels.{}.sign in "
            "the file and begin again",
            axis.name, other, other));
    }

    // Finds the sign of the channels of an axis and prints it. Throws input_error where its motors
    // together move otherwise than each alone.
    void test_sign(commission::live_box &live, const commission::test_axis &axis) {
        const auto motors = test_motors(live, axis);
        const motion whole = test_motion(live, axis, options_.offset_um);
        if (!motors.empty() && motors[0].reversed != whole.reversed) {
            throw input_error(fmt::format(
                "axis {}: both motors together move the tool the other way than each by itself; "
                "measure again",
                axis.name));
        }
        for (std::size_t i = 0; i < axis.channels.size(); ++i) {
            const std::size_t channel = axis.channels[i];
            const int sign = setup_.config->channels[channel].sign * (whole.reversed ? -1 : 1);
            auto &found = result_.signs[channel];
            found = {options_.offset_um, whole.measured_um, sign};
            if (!motors.empty()) found.alone_um = motors[i].measured_um;
        }
        say(fmt::format("   measured {:.4g} µm: sign {}{}", whole.measured_um,
                        result_.signs[axis.channels.front()].sign,
                        whole.reversed ? ", reversed" : ", as in the file"));
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
        const std::string &path = output();
        const json changed = commission::with_result(document_, options_.path, result_);
        const std::string text = formats::json_text(changed);
        formats::update_file(path, text, &io_.out);
        note(changed, text);
        if (options_.as_json) {
            json figures = commission::figures_of(document_, result_);
            figures["registers"] = result_.registers;
            return cli::print_summary(io_.out, {path}, figures, setup_.remarks);
        }
        if (path == "-") return;
        for (const auto &remark : setup_.remarks) say("Remark: " + remark);
        say(fmt::format("Written to {}: {}{}provenance.commissioning", path,
                        options_.only_registers ? "" : "sign of each tested channel, ",
                        lead_in_words(changed)));
    }

    // in : the file as it is written. out: "" where no lead was measured
    std::string lead_in_words(const json &changed) const {
        if (!result_.times || !changed["cycle"]["lead_ms"].is_number()) return "";
        return fmt::format("lead_ms {:.4g}, ", changed["cycle"]["lead_ms"].get<double>());
    }

    // in : the file as it is written, and its text
    void note(const json &changed, const std::string &text) const {
        if (options_.events.empty()) return;
        const std::string at = output() == "-" ? "" : ", written to " + output();
        commission::note_event(options_.events,
                               fmt::format("commissioned {}{}: {}", setup_.config->machine, at,
                                           found_in_words(changed)),
                               text, changed.value("revision", setup_.config->revision));
    }

    std::string found_in_words(const json &changed) const {
        std::string signs;
        for (const auto &[channel, found] : result_.signs) {
            signs += fmt::format("sign of {} {}, ", channel_name(channel), found.sign);
        }
        return signs + lead_in_words(changed) + "registers agree";
    }

    const cli::streams &io_;
    commission::questions questions_;
    commission_options options_;
    json document_;
    commission::box_setup setup_;
    commission::register_map map_;
    commission::findings result_;
};

// Completes the options from the texts that they came as.
void take_texts(commission_options &options) {
    options.measured_um = commission::measured_of(options.measured_text);
    options.positions.shows = commission::shows_of(options.shows_text);
    for (const auto &text : options.together_text)
        options.positions.together.push_back(formats::split(text, '+'));
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
    command.add_flag("--watch", options->watch,
                     "Show all registers in a live table; Enter where it agrees with the control");
    command.add_option("--shows X=A:B", options->shows_text,
                       "Display of the control before and after the jog: X=0:12.5; of another "
                       "signal T1=23.4 (else the command asks)");
    command
        .add_option("--wait-s S", options->positions.wait_s,
                    "Time for each jog of --shows, 1 to 3600")
        .capture_default_str()
        .check(cli::between(1, 3600));
    command.add_option("--together A+B", options->together_text,
                       "Positions that move together: two motors of one stage");
    command.add_flag("--registers", options->only_registers,
                     "Only compare registers and signals; move nothing");
    command.add_option("--offset-um D", options->offset_um, "Offset of the sign test, 1 to 200")
        .capture_default_str()
        .check(cli::between(1, 200));
    command
        .add_option("--rate-um-per-s V", options->rate_um_per_s,
                    "Maximum rate of the offset, 1 to 1000")
        .capture_default_str()
        .check(cli::between(1, 1000));
    command.add_option("--steps N", options->steps, "Small steps for the times, 5 to 1000")
        .capture_default_str()
        .check(cli::whole_between(5, 1000));
    command.add_option("-o,--output F.json", options->output,
                       "File to write (default: FILE itself)");
    command.add_option("--events F.jsonl", options->events,
                       "Append the result to the events of the box, with hash and user");
    cli::add_json(command, options->as_json);
    command.footer(R"(Ctrl-C brings the offset back to zero and writes nothing.

Example:
  compbox commission --watch machine.json)");
    command.callback([options](const cli::streams &io) {
        take_texts(*options);
        commissioning(*options, io).run();
    });
}

}  // namespace compbox::live
