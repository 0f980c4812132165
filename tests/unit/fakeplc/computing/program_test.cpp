// SPDX-License-Identifier: MIT
// fakeplc does what the PLC programs of compbox export do: traces of it are replayed through the
// programs.
#include "host-tools/export/program.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <regex>

#include "host-tools/coefficients/machine_file.h"
#include "host-tools/fakeplc/nc_handshake.h"
#include "host-tools/fakeplc/nc_setting_data.h"
#include "host-tools/fakeplc/plc.h"
#include "host-tools/fakeplc/setup.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/twin/random.h"
#include "tests/support/paths.h"
#include "tests/support/temporary.h"

namespace compbox::fakeplc {
namespace {

// Of one machine: its file, and the program and registers that compbox export makes of it.
struct exported {
    json file;
    std::string program, registers;
};

exported export_of(const json &file, int pmc_base = 0) {
    const auto files =
        exports::plc_program(register_map_of(file, "machine"), file, "machine.json", pmc_base);
    return {file, files.at(0).text, files.at(1).text};
}

// A machine file as compbox init writes it, with limits of its own: other sizes for each axis.
json machine_file(const std::string &axes, const std::string &profile,
                  const std::map<char, double> &limits_um, bool motor_positions = false) {
    coefficients::machine_options options;
    options.motor_positions = motor_positions;
    options.axes = axes;
    options.profile = profile;
    options.host = "10.0.0.1";
    json file = coefficients::new_machine(options);
    for (auto &channel : file["channels"])
        channel["limit_um"] = limits_um.at(channel["name"].get<std::string>()[0]);
    return file;
}

// The largest offsets in the order of the channels, as the program has them.
std::vector<double> sizes_in(const std::string &program) {
    const std::regex size("(?:SIZE_\\w+_UM := |// \\[size\\] At most \\d+ increments, )([0-9.]+)");
    std::vector<double> sizes_um;
    for (std::sregex_iterator at(program.begin(), program.end(), size), end; at != end; ++at)
        sizes_um.push_back(std::stod((*at)[1]));
    return sizes_um;
}

// A box that writes whatever comes to its mind, over a machine that moves; now and then it is
// silent, writes half a block, another client writes numbers of any size, or the operator presses
// something.
class restless {
  public:
    explicit restless(const exported &of)
        : sizes_um_(sizes_in(of.program)),
          setup_(prepared(of, sizes_um_)),
          plc_(setup_.twin, setup_.map, setup_.profile, 0),
          random_(5, setup_.map.profile) {
        for (const auto &signal : setup_.map.signals)
            if (signal.name == "T1") plc_.force_signal(signal.name, 23.4);
    }

    // The ladder counts scans, so here each is as long as the other.
    static plc_setup prepared(const exported &of, const std::vector<double> &sizes_um) {
        const std::string path = compbox_test::temporary("map.json");
        formats::write_file(path, formats::json_text(of.file));
        plc_setup setup = prepare({"", "", path, {}});
        auto &limits = setup.twin.plc;
        EXPECT_EQ(sizes_um.size(), setup.map.channels.size());
        for (std::size_t c = 0; c < sizes_um.size(); ++c) {
            const int axis = twin::axis_index(setup.map.channels[c].name[0]);
            if (axis < 0) limits.size_um = sizes_um[c];
            if (axis >= 0) limits.axis_size_um[static_cast<std::size_t>(axis)] = sizes_um[c];
        }
        setup.twin.probe.duration_s = 0.0;
        limits.ahead_mm = exports::usual_ahead_mm(sizes_um.size());
        if (setup.profile.nc.way == nc_way::handshake) setup.profile.scan_jitter_s = 0.0;
        return setup;
    }
    // The position of a channel's axis; 0 where fakeplc has none.
    double position_mm(std::size_t channel) const {
        const int axis = twin::axis_index(setup_.map.channels[channel].name[0]);
        return axis < 0 ? 0.0 : plc_.nc().position_mm()[static_cast<std::size_t>(axis)];
    }
    fake_plc &plc() { return plc_; }
    const register_map &map() const { return setup_.map; }
    std::uint16_t reg(int address) {
        const auto reply = plc_.answer({3, 0, static_cast<std::uint8_t>(address), 0, 1});
        return static_cast<std::uint16_t>(reply.at(2) << 8 | reply.at(3));
    }
    bool restarted = true;  // before the next scan; the trace resets it

    // Calls on_scan after each scan.
    void run(double duration_s, const std::function<void(const plc_state &)> &on_scan) {
        const auto cycles = static_cast<int>(duration_s / 0.03);
        for (int i = 0; i < cycles; ++i) {
            if (i % 40 == 0) change_mind();
            if (!plc_.moving()) send_axes();
            if (silent_ == 0) write();
            silent_ = std::max(silent_ - 1, 0);
            now_us_ += 30000;
            plc_.run_to(now_us_, on_scan);
        }
    }

  private:
    double chance() { return random_.uniform(); }
    void change_mind() {
        mode_ = chance() < 0.8 ? 1u : static_cast<unsigned>(random_.next() % 6);
        torn_ = setup_.map.write.counters && chance() < 0.1;
        foreign_ = chance() < 0.2;
        if (chance() < 0.15) silent_ = 12;
        for (const auto &probe : setup_.map.probes)
            if (chance() < 0.5) plc_.probe(probe.axis, random_.symmetric(80.0));
        ask_ = !setup_.map.probes.empty() && chance() < 0.3;
        plc_.set_enable(chance() < 0.85);
        plc_.set_permit(chance() < 0.5);
        if (chance() < 0.1) plc_.press_reset();
        if (chance() < 0.03) {
            plc_.restart();
            restarted = true;
        }
    }
    void send_axes() {
        twin::twin_step step;
        for (auto &target : step.target_mm) target = std::round(chance() * 1e7) * 1e-4;
        step.feed_mm_per_s = 5.0 + 200.0 * chance();
        plc_.move(step);
    }
    void put(int address, const number_format &format, double raw) {
        const auto words = format.encode(raw);
        for (std::size_t i = 0; i < words.size(); ++i) set(address + static_cast<int>(i), words[i]);
    }
    // The box's number, or while a foreign client writes now and then any other, up to what the
    // register holds.
    double any_or(double number) {
        if (!foreign_ || chance() < 0.5) return number;
        return number * (chance() < 0.5 ? 10.0 * chance() : random_.symmetric(1e8));
    }
    void set(int address, unsigned word) {
        plc_.answer({16, 0, static_cast<std::uint8_t>(address), 0, 1, 2,
                     static_cast<std::uint8_t>(word >> 8), static_cast<std::uint8_t>(word)});
    }
    void write() {
        const register_map &map = setup_.map;
        const double turn = 0.02;  // of the curve, per mm
        ++count_;
        for (std::size_t c = 0; c < map.channels.size(); ++c) {
            const auto &channel = map.channels[c];
            const double x = position_mm(c);
            const double um = 0.4 * sizes_um_[c] * std::sin(turn * x + static_cast<double>(c));
            put(channel.address, channel.format, any_or(um) / channel.scale_um);
            if (!channel.tangent) continue;
            const auto &tangent = *channel.tangent;
            const double slope = 0.03 * turn * std::cos(turn * x + static_cast<double>(c));
            // Steeper ones show that the program's positions are whole 0.0001 mm.
            put(tangent.slope_address, tangent.slope_format,
                std::clamp(any_or(slope), -0.01, 0.01) / tangent.slope_scale);
            put(tangent.reference_address, tangent.reference_format,
                any_or(x) / tangent.reference_scale_mm);
        }
        set(map.status, mode_);
        set(map.box_heartbeat, count_);
        if (map.request) set(*map.request, ask_ ? 3 : 2);
        if (!map.write.counters) return;
        set(map.write.start, count_);
        set(map.write.end() - 1, torn_ ? count_ - 1 : count_);
    }

    std::vector<double> sizes_um_;
    plc_setup setup_;
    fake_plc plc_;
    twin::random_stream random_;
    std::int64_t now_us_ = 0;
    unsigned mode_ = 1, count_ = 0;
    int silent_ = 0;
    bool torn_ = false, foreign_ = false, ask_ = false;
};

// A CSV in the making: names once, values row by row.
class trace {
  public:
    void add(const std::string &name, double value) {
        if (!named_) names_ += (names_.empty() ? "" : ",") + name;
        row_ += (row_.empty() ? "" : ",") + fmt::format("{}", value);
    }
    void end_row() {
        rows_ += row_ + "\n";
        row_.clear();
        named_ = true;
    }
    std::string text() const { return names_ + "\n" + rows_; }

  private:
    std::string names_, row_, rows_;
    bool named_ = false;
};

// What both programs see and what fakeplc made of it.
void add_common(trace &to, restless &of, const plc_state &state, double dt_s, bool fresh) {
    to.add("in_first_scan", of.restarted ? 1 : 0);
    to.add("in_dt_s", dt_s);
    to.add("in_enable_key", state.control & 1 ? 1 : 0);
    to.add("in_referenced", state.control & 2 ? 1 : 0);
    to.add("in_reset_key", state.control & 4 ? 1 : 0);
    to.add("in_permit_key", state.control & 8 ? 1 : 0);
    to.add("in_nc_fresh", fresh ? 1 : 0);
    const register_map &map = of.map();
    for (std::size_t s = 0; s < map.signals.size(); ++s) {
        const auto &signal = map.signals[s];
        std::vector<std::uint16_t> words;
        for (int r = 0; r < signal.format.registers; ++r)
            words.push_back(of.reg(signal.address + r));
        to.add("in_signal_" + std::to_string(s), signal.format.decode(words.data()));
    }
    for (int r = map.read.start; r < map.read.end(); ++r)
        to.add("r" + std::to_string(r), of.reg(r));
    for (int r = map.write.start; r < map.write.end(); ++r)
        to.add("w" + std::to_string(r), of.reg(r));
    to.add("out_box_alive", state.box_alive ? 1 : 0);
    const plc_duties &duties = of.plc().duties();
    for (std::size_t c = 0; c < map.channels.size(); ++c) {
        const std::string i = std::to_string(c + 1);
        to.add("in_position_" + i, static_cast<double>(std::llround(of.position_mm(c) / 1e-4)));
        to.add("out_wanted_" + i, duties.wanted()[c].um);
        to.add("out_size_acts_" + i, duties.limited()[c] ? 1 : 0);
        to.add("out_size_alarm_" + i,
               of.plc().alarms().stands("size-" + map.channels[c].name) ? 1 : 0);
    }
    to.add("out_size_count", duties.times_limited());
    for (const auto &probe : map.probes)
        to.add("in_" + probe.value + "_done", of.plc().probes().measured(probe.value) ? 1 : 0);
    if (map.request && !map.probes.empty())
        to.add("out_probe_again", state.box_alive && (of.reg(*map.request) & 1) != 0 ? 1 : 0);
}

// Runs the interpreter on the trace; its words, and "" when it found a difference is a failure.
void replay(const char *interpreter, const exported &of, const trace &rows) {
    std::string command =
        "/usr/bin/python3 " + from_source("tests/unit/fakeplc/computing/") + interpreter;
    int file = 0;
    for (const std::string &text : {of.program, of.registers, rows.text()}) {
        const std::string path = compbox_test::temporary("replay" + std::to_string(file++));
        formats::write_file(path, text);
        command += " " + path;
    }
    command += " 2>&1";
    std::string printed;
    char block[512];
    FILE *pipe = ::popen(command.c_str(), "r");
    while (const std::size_t n = std::fread(block, 1, sizeof block, pipe)) printed.append(block, n);
    const int code = WEXITSTATUS(::pclose(pipe));
    EXPECT_EQ(code, 0) << printed;
    std::printf("%s", printed.c_str());
}

trace trace_of_840d(const exported &of) {
    restless box(of);
    trace rows;
    double before_s = -0.008;
    std::uint16_t heartbeat = 0;
    bool running = false;
    box.run(30.0, [&](const plc_state &state) {
        const auto &side = dynamic_cast<const nc_setting_data &>(box.plc().side());
        const auto &job = side.running();
        add_common(rows, box, state, state.time_s - before_s, state.plc_heartbeat != heartbeat);
        before_s = state.time_s;
        heartbeat = state.plc_heartbeat;
        rows.add("put_done", running && !job && !box.restarted ? 1 : 0);
        running = job.has_value();
        rows.add("out_torn", box.plc().alarms().stands("box-torn") ? 1 : 0);
        rows.add("out_put_axis", job ? static_cast<double>(job->channel + 1) : 0);
        rows.add("out_set_um", job ? job->set.um : 0);
        rows.add("out_set_slope", job ? 1e6 * job->set.slope : 0);
        rows.add("out_set_reference", job ? job->set.reference_mm : 0);
        rows.end_row();
        box.restarted = false;
    });
    return rows;
}

trace trace_of_fanuc(const exported &of) {
    restless box(of);
    trace rows;
    std::uint16_t heartbeat = 0;
    box.run(30.0, [&](const plc_state &state) {
        const auto &side = dynamic_cast<const nc_handshake &>(box.plc().side());
        add_common(rows, box, state, 0.008, state.plc_heartbeat != heartbeat);
        heartbeat = state.plc_heartbeat;
        rows.add("in_erend", state.handshake >> 9 & 1);
        for (std::size_t c = 0; c < box.map().channels.size(); ++c)
            rows.add("out_data_" + std::to_string(c + 1), static_cast<double>(side.data()[c]));
        rows.end_row();
        box.restarted = false;
    });
    return rows;
}

void replay_840d(const json &file) {
    const exported of = export_of(file);
    replay("scl_replay.py", of, trace_of_840d(of));
}

void replay_fanuc(const json &file, int pmc_base) {
    const exported of = export_of(file, pmc_base);
    replay("ladder_replay.py", of, trace_of_fanuc(of));
}

const std::map<char, double> limits_um = {{'X', 100.0}, {'Y', 45.0}, {'Z', 150.0}, {'W', 80.0}};

TEST(PlcProgram, OfThe840DIsWhatFakeplcDoes) {
    replay_840d(machine_file("XYZ", "sinumerik-840d", limits_um));
}

TEST(PlcProgram, OfThe840DGoesInLinesAsFakeplcDoes) {
    json file = machine_file("XYZ", "sinumerik-840d", limits_um);
    file["plc"]["interpolate_ms"] = 30;
    replay_840d(file);
}

TEST(PlcProgram, OfALatheWithAThermometer) {
    json file = machine_file("X,Z", "sinumerik-840d", {{'X', 6.0}, {'Z', 2500.0}});
    file["signals"].push_back({{"name", "T1"}, {"plc", 20}, {"type", "int16"}, {"scale", 0.1}});
    replay_840d(file);
    file = machine_file("X,Z", "fanuc", {{'X', 6.0}, {'Z', 900.0}});
    file["signals"].push_back({{"name", "T1"}, {"plc", 20}, {"type", "int16"}, {"scale", 0.1}});
    file["signals"][1]["type"] = "int32";  // the high word first, as a file by hand may have it
    replay_fanuc(file, 0);
}

// A machine file with touch probes.
json probed(const std::string &profile, const std::string &axes) {
    coefficients::machine_options options;
    options.axes = "XYZ";
    options.profile = profile;
    options.host = "10.0.0.1";
    options.probe = axes;
    json file = coefficients::new_machine(options);
    for (auto &channel : file["channels"]) channel["limit_um"] = 100.0;
    return file;
}

TEST(PlcProgram, HandsOverTheProbeCycleAsFakeplcDoes) {
    replay_840d(probed("sinumerik-840d", "X,Z"));
    replay_fanuc(probed("fanuc", "Z,X"), 500);
    json none = probed("sinumerik-840d", "Y");
    none["plc"].erase("request");
    replay_840d(none);
}

TEST(PlcProgram, RefusesNumbersOfAProbeThatItCannotWrite) {
    json file = probed("sinumerik-840d", "X");
    file["signals"][3]["type"] = "float32";
    EXPECT_THROW(export_of(file), input_error);
    file = probed("sinumerik-840d", "X");
    file["signals"][4]["scale"] = 2;
    EXPECT_THROW(export_of(file), input_error);
    file = probed("fanuc", "X");
    file["signals"][3]["type"] = "int32cdab";
    EXPECT_THROW(export_of(file), input_error);
}

TEST(PlcProgram, OfStagesWithTwoMotors) {
    replay_840d(machine_file("X,Y1+Y2,Z1+Z2", "sinumerik-840d", limits_um));
    replay_840d(machine_file("X,Y1+Y2", "sinumerik-840d", limits_um, true));
    replay_fanuc(machine_file("X,Y1+Y2,Z,W", "fanuc", limits_um), 1000);
}

TEST(PlcProgram, OfThe840DWithoutTangents) {
    json file = machine_file("X,Y1+Y2,Z", "sinumerik-840d", limits_um);
    for (auto &channel : file["channels"]) channel.erase("tangent");
    file["plc"]["write"].erase("counters");
    file["plc"]["read"].erase("counters");
    replay_840d(file);
    for (const char *gone : {"commanded_slope[1] := INT", "TEMP_COMP_SLOPE", "read_count"})
        EXPECT_EQ(export_of(file).program.find(gone), std::string::npos) << gone;
}

TEST(PlcProgram, OfTheFanucIsWhatFakeplcDoes) {
    replay_fanuc(machine_file("XYZ", "fanuc", limits_um), 0);
}

// The programs of docs/plc are those of the files beside them.
TEST(PlcProgram, OfTheDocumentsIsMadeByExport) {
    const std::string folder = from_source("docs/plc/");
    for (const char *name : {"sinumerik-840d", "fanuc"}) {
        const json file = formats::read_json(folder + name + ".json");
        const auto made =
            exports::plc_program(register_map_of(file, name), file, name + std::string(".json"), 0);
        EXPECT_TRUE(made[0].text == formats::read_file(folder + made[0].name))
            << "run: compbox export docs/plc/" << name << ".json --format plc-program -o docs/plc";
    }
}

// The sizes are defaults; a comment in the file that has them names who sets them.
TEST(PlcProgram, NamesWhoSetsTheLargestOffsets) {
    for (const char *profile : {"sinumerik-840d", "fanuc", "linuxcnc"}) {
        const std::string text = export_of(machine_file("XYZ", profile, limits_um)).program;
        EXPECT_NE(text.find("The builder of the machine sets"), std::string::npos) << profile;
        EXPECT_NE(text.find("1.1 times the least"), std::string::npos) << profile;
    }
}

std::string refusal(json file, const std::function<void(json &)> &change) {
    change(file);
    try {
        export_of(file);
    } catch (const input_error &error) {
        return error.what();
    }
    return "";
}

TEST(PlcProgram, RefusesWhatItCannotHave) {
    const json siemens = machine_file("XYZ", "sinumerik-840d", limits_um);
    const json ladder = machine_file("XYZ", "fanuc", limits_um);
    const auto channel = [](const char *key, const json &value) {
        return [=](json &file) { file["channels"][1][key] = value; };
    };
    EXPECT_EQ(refusal(siemens, channel("scale", 0.1)),
              "machine: channel Y has another type or scale than channel X; the program has one "
              "for all offsets");
    EXPECT_EQ(refusal(siemens, channel("limit_um", nullptr)),
              "machine: channels[1].limit_um: the program needs a number above 0 for its largest "
              "offset");
    EXPECT_EQ(refusal(ladder, channel("limit_um", 950)),
              "machine: channel Y: its largest offset, 1100 um, is beyond 9999 increments of 0.1 "
              "um");
    EXPECT_EQ(refusal(siemens, [](json &file) { file["signals"][0]["scale"] = 0.001; }),
              "machine: channel X: the program needs the position and the reference of its tangent "
              "as int32 in the scale of all others, without zero");
    EXPECT_EQ(refusal(ladder, [](json &file) { file["plc"]["axes_at_once"] = true; }),
              "machine: plc.axes_at_once: the ladder hands over one axis after the other");
    EXPECT_EQ(refusal(siemens, [](json &file) { file["plc"]["profile"] = "generic"; }),
              "machine: channel X: LinuxCNC has no slope; leave out its tangent");
}

}  // namespace
}  // namespace compbox::fakeplc
