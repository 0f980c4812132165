// SPDX-License-Identifier: MIT
// fakept100: Pt100 modules on a serial line, as a box reads them from its own bus.
#include <fmt/core.h>
#include <poll.h>

#include <ostream>

#include "host-tools/command_line/command_line.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/fakeplc/live.h"
#include "host-tools/fakeplc/pt100.h"
#include "host-tools/formats/input_lines.h"

namespace compbox::fakeplc {
namespace {

// Answers polls and commands until a signal or the command quit.
void serve(serial_server &line, pt100_modules &modules, const sigset_t &in_poll,
           const cli::streams &io) {
    formats::input_lines input(io.in);
    bool open = true, quit = false;
    std::vector<pollfd> set;
    while (!quit && !stop_requested()) {
        set.clear();
        line.append_poll_set(set);
        if (open) set.push_back({io.in, POLLIN, 0});
        const timespec wait = time_until(line.next_due_us());
        if (::ppoll(set.data(), set.size(), &wait, &in_poll) < 0) continue;
        line.process_units(set, now_us(), [&](int unit, const byte_string &request, bool) {
            return modules.answer(unit, request);
        });
        if (open && set.back().revents != 0) open = input.read_more();
        while (const auto command = input.next()) {
            quit = quit || *command == "quit";
            io.out << (*command == "quit" ? "ok" : modules.run(*command)) << std::endl;
        }
    }
}

void run(const std::string &listen, const std::vector<std::string> &texts,
         const serial_options &options, const cli::streams &io) {
    pt100_modules modules;
    for (const auto &text : texts) modules.add(text);
    const sigset_t in_poll = mind_signals();
    serial_server line(listen, options);
    io.out << "fakept100: listening on " << line.address() << std::endl;
    serve(line, modules, in_poll, io);
}

}  // namespace
}  // namespace compbox::fakeplc

// out: 0 after quit or a signal, 1 for bad input, 2 for wrong usage, 70 for a fault of the program
int main(int argc, char **argv) {
    const auto io = compbox::cli::standard_streams();
    compbox::cli::program app{"fakept100: Pt100 modules on a serial line", io};
    app.set_version_flag("--version", "fakept100 " CB_VERSION);
    std::string listen;
    std::vector<std::string> modules;
    compbox::fakeplc::serial_options options;
    options.delay_us = 2000;
    app.add_option("--listen ADDRESS", listen,
                   "rtu:/LINK: a new pseudo-terminal with a link there; unix:/PATH: a socket")
        .required()
        .check([](const std::string &address) {
            return compbox::fakeplc::serial_server::takes(address)
                       ? ""
                       : fmt::format("'{}' is neither rtu:/LINK nor unix:/PATH", address);
        });
    app.add_option("--module UNIT=T,…", modules, "UNIT=DEGC[,DEGC…]: register 0 first, 0.1 °C each")
        .required();
    app.add_option("--baud N", options.baud,
                   "Simulated baud rate, up to 921600; 0: replies take no time")
        .capture_default_str()
        .check(compbox::cli::whole_between(0, 921600));
    app.footer(
        "Commands on stdin, each answered by one line:\n"
        "  set UNIT REGISTER DEGC, silent UNIT 0|1, late UNIT MS, quit\n"
        "Example:\n"
        "  fakept100 --listen rtu:/tmp/bus --module 5=20.1,21.5 --module 6=19.8");
    return app.run(argc, argv, [&] { compbox::fakeplc::run(listen, modules, options, io); });
}
