// SPDX-License-Identifier: MIT
// fakeplc: a control, its PLC and a machine in real time, with a Modbus server.
#include <fcntl.h>
#include <poll.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <ostream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/fakeplc/console.h"
#include "host-tools/fakeplc/live.h"
#include "host-tools/fakeplc/log.h"
#include "host-tools/fakeplc/serial_server.h"
#include "host-tools/fakeplc/server.h"
#include "host-tools/fakeplc/setup.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/input_lines.h"

namespace compbox::fakeplc {
namespace {

// Writes one log row for each scan and flushes once a second, so that other programs can follow it.
class scan_log {
  public:
    scan_log(const std::string &path, const register_map &map) {
        if (!path.empty()) log_.emplace(path, map);
    }
    void add(const plc_state &state) {
        if (!log_) return;
        log_->add(state);
        if (state.time_s - flushed_s_ < 1.0) return;
        log_->flush();
        flushed_s_ = state.time_s;
    }
    bool finish() { return !log_ || log_->flush(); }

  private:
    std::optional<plc_log> log_;
    double flushed_s_ = 0.0;
};

// Runs PLC, wire and commands until a signal or the command quit. The end of the commands' input
// does not end the program.
// in : in_poll: the mask of signals while it waits
void serve(fake_plc &plc, wire_server &server, scan_log &log, const sigset_t &in_poll,
           const cli::streams &io) {
    console commands{plc, server};
    formats::input_lines input(io.in);
    bool open = true;
    const auto answer = [&plc](const byte_string &request, bool torn) {
        return plc.answer(request, torn);
    };
    std::vector<pollfd> set;
    while (!stop_requested() && !commands.quit) {
        set.clear();
        server.append_poll_set(set);
        if (open) set.push_back({io.in, POLLIN, 0});
        const timespec wait = time_until(std::min(plc.next_due_us(), server.next_due_us()));
        if (::ppoll(set.data(), set.size(), &wait, &in_poll) < 0) {
            for (auto &entry : set) entry.revents = 0;
        }
        plc.forget_standstill(now_us());
        plc.run_to(now_us(), [&log](const plc_state &state) { log.add(state); });
        const std::size_t clients = server.clients();
        server.process(set, now_us(), answer);
        if (server.clients() != clients) {
            plc.note(fmt::format("{} client{} connected", server.clients(),
                                 server.clients() == 1 ? "" : "s"));
        }
        if (open && set.back().revents != 0) open = input.read_more();
        while (const auto line = input.next()) io.out << commands.run(*line) << std::endl;
    }
}

struct options {
    plc_options plc;
    serial_options serial;
    std::string listen = "127.0.0.1:1502", log;
};

std::unique_ptr<wire_server> open_wire(const options &chosen, const plc_setup &setup) {
    if (serial_server::takes(chosen.listen))
        return std::make_unique<serial_server>(chosen.listen, chosen.serial);
    return std::make_unique<modbus_server>(chosen.listen, setup.profile.max_clients);
}

void run(const options &chosen, const cli::streams &io) {
    const plc_setup setup = prepare(chosen.plc);
    formats::refuse_given(chosen.log, "the log");
    const sigset_t in_poll = mind_signals();
    // Open the log after the port, because a second fakeplc must not empty the log of the first.
    const auto server = open_wire(chosen, setup);
    scan_log log(chosen.log, setup.map);
    fake_plc plc(setup.twin, setup.map, setup.profile, now_us());
    io.out << "fakeplc: listening on " << server->address() << std::endl;
    serve(plc, *server, log, in_poll, io);
    if (!log.finish()) throw input_error(chosen.log, 0, 0, "the log could not be written whole");
}

// Adds the options to app, which sets `chosen` when it parses.
void add_options(cli::command &app, options &chosen) {
    app.add_option("--profile KIND", chosen.plc.profile,
                   "Kind of control: generic, sinumerik-840d or fanuc (default: the map's)")
        .check(cli::one_of(plc_profile::names()));
    app.add_option("--listen ADDRESS", chosen.listen,
                   "HOST:PORT (port 0: any free one); rtu:/LINK: Modbus RTU on a new "
                   "pseudo-terminal, to which LINK points; unix:/PATH: RTU on a socket")
        .capture_default_str()
        .check([](const std::string &address) {
            return serial_server::takes(address) ? "" : modbus_server::fault_in(address);
        });
    app.add_option("--unit N", chosen.serial.unit, "RTU: own unit id, 1 to 247")
        .capture_default_str()
        .check(cli::whole_between(1, 247));
    app.add_option(
           "--baud N", chosen.serial.baud,
           "RTU: simulated baud rate, 11 bits a character, up to 921600; 0: replies take no time")
        .capture_default_str()
        .check(cli::whole_between(0, 921600));
    app.add_option("--machine TWIN.json", chosen.plc.machine,
                   "Twin file (default: X, Y, Z without errors, with the ranges of the map's "
                   "signals or 0 to 1000 mm)");
    app.add_option("--map F.json", chosen.plc.map,
                   "Coefficient or machine file with the registers (default: the one the twin "
                   "file names, or the map that compbox init lays out)");
    app.add_option("--seed K", chosen.plc.seed, "Seed (else the twin file's)");
    app.add_option("--size-um D", chosen.plc.size_um,
                   "Largest offset, um, that the PLC program applies to an axis, 0 to 1000000 "
                   "(default: plc.size_um of the twin file, or 500)")
        .check(cli::between(0.0, 1e6));
    app.add_option("--log F.csv", chosen.log, "CSV file with one row for each PLC scan");
    app.footer(std::string(console_help()) +
               "Example:\n"
               "  fakeplc --profile generic --listen 127.0.0.1:1502\n"
               "  fakeplc --profile generic --listen 127.0.0.1:1502 "
               "--machine machine_twin.json --map coefficients.json --log plc.csv");
}

}  // namespace
}  // namespace compbox::fakeplc

// out: 0 after quit or a signal, 1 for bad input, 2 for wrong usage, 70 for a fault of the program
int main(int argc, char **argv) {
    const auto io = compbox::cli::standard_streams();
    compbox::cli::program app{
        "fakeplc: a machine-tool control with its PLC and a simulated machine", io};
    app.set_version_flag("--version", "fakeplc " CB_VERSION);
    compbox::fakeplc::options chosen;
    compbox::fakeplc::add_options(app, chosen);
    return app.run(argc, argv, [&] { compbox::fakeplc::run(chosen, io); });
}
