// SPDX-License-Identifier: MIT
// fakeplc does what the PLC programs of docs/plc do: traces of it are replayed through the
// programs.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "host-tools/fakeplc/nc_handshake.h"
#include "host-tools/fakeplc/nc_setting_data.h"
#include "host-tools/fakeplc/plc.h"
#include "host-tools/fakeplc/setup.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/file.h"
#include "host-tools/twin/random.h"
#include "tests/support/temporary.h"

namespace compbox {
namespace {

const std::string folder = CB_SOURCE_DIR "/docs/plc/";

// The sizes of the replays, one for each axis; a program with other numbers is one with constants
// replaced (with_sizes).
constexpr std::array<double, 3> sizes_um = {150.0, 90.0, 200.0};

// A box that writes whatever comes to its mind, over a machine that moves; now and then it is
// silent, writes half a block, another client writes numbers of any size, or the operator presses
// something.
class restless {
  public:
    explicit restless(const std::string &map, double interpolate_s = 0.0)
        : setup_(prepared(map, interpolate_s)),
          plc_(setup_.twin, setup_.map, setup_.profile, 0),
          random_(5, map) {}

    // The ladder counts scans, so here each is as long as the other.
    static plc_setup prepared(const std::string &map, double interpolate_s) {
        plc_setup setup = prepare({"", "", folder + map, {}});
        setup.map.interpolate_s = interpolate_s;
        for (std::size_t a = 0; a < 3; ++a) setup.twin.plc.axis_size_um[a] = sizes_um[a];
        if (setup.profile.nc.way == nc_way::handshake) setup.profile.scan_jitter_s = 0.0;
        return setup;
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
        plc_.set_enable(chance() < 0.85);
        plc_.set_permit(chance() < 0.5);
        if (chance() < 0.1) plc_.press_reset();
        if (chance() < 0.03) {
            plc_.restart();
            restarted = true;
        }
    }
    void send_axes() {
        twin_step step;
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
            const double x = plc_.nc().position_mm()[c];
            const double um = 60.0 * std::sin(turn * x + static_cast<double>(c));
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
        if (!map.write.counters) return;
        set(map.write.start, count_);
        set(map.write.end() - 1, torn_ ? count_ - 1 : count_);
    }

    plc_setup setup_;
    fake_plc plc_;
    random_stream random_;
    std::int64_t now_us_ = 0;
    unsigned mode_ = 1, count_ = 0;
    int silent_ = 0;
    bool torn_ = false, foreign_ = false;
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
    for (std::size_t a = 0; a < 3; ++a) {
        to.add(std::string("in_position_") + axis_letters[a],
               static_cast<double>(std::llround(state.position_mm[a] / 1e-4)));
    }
    to.add("reg_status", of.reg(of.map().status));
    to.add("reg_box_heartbeat", of.reg(of.map().box_heartbeat));
    to.add("out_box_alive", state.box_alive ? 1 : 0);
    to.add("out_control", state.control);
    to.add("out_plc_heartbeat", state.plc_heartbeat);
    to.add("out_read_count_first", of.reg(of.map().read.start));
    to.add("out_read_count_last", of.reg(of.map().read.end() - 1));
    for (std::size_t c = 0; c < 3; ++c) {
        const std::string axis(1, axis_letters[c]);
        const plc_duties &duties = of.plc().duties();
        to.add("out_wanted_" + axis, duties.wanted()[c].um);
        to.add("out_size_acts_" + axis, duties.limited()[c] ? 1 : 0);
        to.add("out_size_alarm_" + axis, of.plc().alarms().stands("size-" + axis) ? 1 : 0);
    }
    to.add("out_size_count", of.plc().duties().times_limited());
}

double number_at(restless &of, int address) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(of.reg(address)) << 16 |
                                     of.reg(address + 1));
}

// Runs the interpreter on the trace; its words, and "" when it found a difference is a failure.
void replay(const char *interpreter, const std::string &program, const trace &rows) {
    const std::string path = compbox_test::temporary("trace.csv");
    write_file(path, rows.text());
    const std::string command =
        std::string("/usr/bin/python3 " CB_SOURCE_DIR "/tests/unit/fakeplc/computing/") +
        interpreter + " " + program + " " + path + " 2>&1";
    std::string said;
    char block[512];
    FILE *pipe = ::popen(command.c_str(), "r");
    while (const std::size_t n = std::fread(block, 1, sizeof block, pipe)) said.append(block, n);
    const int code = WEXITSTATUS(::pclose(pipe));
    EXPECT_EQ(code, 0) << said;
    std::printf("%s", said.c_str());
}

trace trace_of_840d(double interpolate_s) {
    restless box("sinumerik-840d.json", interpolate_s);
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
        for (const auto &channel : box.map().channels) {
            rows.add("reg_value_" + channel.name, number_at(box, channel.address));
            rows.add("reg_slope_" + channel.name, number_at(box, channel.tangent->slope_address));
            rows.add("reg_reference_" + channel.name,
                     number_at(box, channel.tangent->reference_address));
        }
        rows.add("reg_write_count_first", box.reg(box.map().write.start));
        rows.add("reg_write_count_last", box.reg(box.map().write.end() - 1));
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

// The program with other constants: each text has to be there exactly once.
std::string with_constants(const std::string &name,
                           const std::vector<std::array<std::string, 2>> &constants) {
    std::string program = read_file(folder + name);
    for (const auto &[from, to] : constants) {
        const auto at = program.find(from);
        EXPECT_TRUE(at != std::string::npos && program.find(from, at + 1) == std::string::npos)
            << from;
        if (at != std::string::npos) program.replace(at, from.size(), to);
    }
    const std::string path = compbox_test::temporary(name);
    write_file(path, program);
    return path;
}

std::string scl_of(const char *interpolate_s) {
    return with_constants(
        "sinumerik-840d.scl",
        {{"SIZE_X_UM := 500.0;", "SIZE_X_UM := 150.0;"},
         {"SIZE_Y_UM := 500.0;", "SIZE_Y_UM := 90.0;"},
         {"SIZE_Z_UM := 500.0;", "SIZE_Z_UM := 200.0;"},
         {"INTERPOLATE_S := 0.0;", std::string("INTERPOLATE_S := ") + interpolate_s + ";"}});
}

TEST(PlcProgram, OfThe840DIsWhatFakeplcDoes) {
    replay("scl_replay.py", scl_of("0.0"), trace_of_840d(0.0));
}

TEST(PlcProgram, OfThe840DGoesInLinesAsFakeplcDoes) {
    replay("scl_replay.py", scl_of("0.03"), trace_of_840d(0.03));
}

// The ladder has the sizes in the lines behind [take-over] of each axis, four times each.
std::string ladder() {
    std::string program = read_file(folder + "fanuc.txt");
    const auto begin = [&](char axis) {
        return program.find(std::string("// [take-over] ") + axis);
    };
    for (std::size_t a = 0; a < 3; ++a) {
        const std::string size = std::to_string(std::lround(10.0 * sizes_um[a]));
        int found = 0;
        for (auto at = program.find("5000", begin(axis_letters[a]));
             at < (a < 2 ? begin(axis_letters[a + 1]) : program.size());
             at = program.find("5000", at + size.size()), ++found) {
            program.replace(at, 4, size);
        }
        EXPECT_GE(found, 4);
    }
    const std::string path = compbox_test::temporary("fanuc.txt");
    write_file(path, program);
    return path;
}

TEST(PlcProgram, OfTheFanucIsWhatFakeplcDoes) {
    restless box("fanuc.json");
    trace rows;
    std::uint16_t heartbeat = 0;
    box.run(30.0, [&](const plc_state &state) {
        const auto &side = dynamic_cast<const nc_handshake &>(box.plc().side());
        add_common(rows, box, state, 0.008, state.plc_heartbeat != heartbeat);
        heartbeat = state.plc_heartbeat;
        rows.add("in_erend", state.handshake >> 9 & 1);
        rows.add("out_handshake", state.handshake);
        for (std::size_t c = 0; c < 3; ++c) {
            const auto &channel = box.map().channels[c];
            rows.add("reg_value_" + channel.name,
                     static_cast<std::int16_t>(box.reg(channel.address)));
            rows.add("out_applied_" + channel.name, state.applied_um[c]);
            rows.add("out_data_" + channel.name, static_cast<double>(side.data()[c]));
        }
        rows.end_row();
        box.restarted = false;
    });
    replay("ladder_replay.py", ladder(), rows);
}

}  // namespace
}  // namespace compbox
