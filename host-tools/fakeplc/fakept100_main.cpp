// SPDX-License-Identifier: MIT
// fakept100: Pt100 modules on a serial line, as a box reads them from its own bus.
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <iostream>

#include "host-tools/command_line/command_line.h"
#include "host-tools/fakeplc/live.h"
#include "host-tools/fakeplc/pt100.h"
#include "host-tools/formats/error.h"

namespace compbox {
namespace {

// Runs the commands that a read of stdin brings. false: its end.
bool read_commands(pt100_modules &modules, std::string &text, bool &quit) {
    char block[1024];
    const ssize_t n = ::read(STDIN_FILENO, block, sizeof block);
    if (n <= 0) return n < 0 && errno == EINTR;
    text.append(block, static_cast<std::size_t>(n));
    for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
        const std::string line = text.substr(0, end);
        text.erase(0, end + 1);
        quit = quit || line == "quit";
        std::cout << (line == "quit" ? "ok" : modules.run(line)) << std::endl;
    }
    return true;
}

void serve(serial_server &line, pt100_modules &modules, const sigset_t &in_poll) {
    std::string text;
    bool open = true, quit = false;
    std::vector<pollfd> set;
    while (!quit && !stop_requested()) {
        set.clear();
        line.append_poll_set(set);
        if (open) set.push_back({STDIN_FILENO, POLLIN, 0});
        const timespec wait = time_until(line.next_due_us());
        if (::ppoll(set.data(), set.size(), &wait, &in_poll) < 0) continue;
        line.process_units(set, now_us(), [&](int unit, const byte_string &request, bool) {
            return modules.answer(unit, request);
        });
        if (open && set.back().revents != 0) open = read_commands(modules, text, quit);
    }
}

void run(const std::string &listen, const std::vector<std::string> &texts,
         const serial_options &options) {
    pt100_modules modules;
    for (const auto &text : texts) modules.add(text);
    const sigset_t in_poll = mind_signals();
    serial_server line(listen, options);
    std::cout << "fakept100: listening on " << line.address() << std::endl;
    serve(line, modules, in_poll);
}

}  // namespace
}  // namespace compbox

int main(int argc, char **argv) {
    compbox::cli::program app{"fakept100: Pt100 modules on a serial line"};
    app.set_version_flag("--version", "fakept100 " CB_VERSION);
    std::string listen;
    std::vector<std::string> modules;
    compbox::serial_options options;
    options.delay_us = 2000;
    app.add_option("--listen", listen,
                   "rtu:/LINK: a new pseudo-terminal with a link there; unix:/PATH: a socket")
        .required()
        .check([](const std::string &address) {
            return compbox::serial_server::takes(address)
                       ? ""
                       : fmt::format("'{}' is neither rtu:/LINK nor unix:/PATH", address);
        });
    app.add_option("--module", modules, "UNIT=DEGC[,DEGC…]: register 0 first, 0.1 °C each")
        .required();
    app.add_option("--baud", options.baud, "Bytes take the time of this rate; 0: none")
        .capture_default_str()
        .check(compbox::cli::in_range(0, 921600), "INT in [0 - 921600]");
    app.footer(
        "Commands on stdin, each answered by one line:\n"
        "  set UNIT REGISTER DEGC, silent UNIT 0|1, late UNIT MS, quit\n"
        "Example: fakept100 --listen rtu:/tmp/bus --module 5=20.1,21.5 --module 6=19.8");
    try {
        if (const auto end = app.parse(argc, argv)) return *end;
        compbox::run(listen, modules, options);
    } catch (const compbox::input_error &error) {
        std::cerr << "fakept100: " << error.what() << "\n";
        return 1;
    }
    return 0;
}
