// SPDX-License-Identifier: MIT
// compbox: the host tools, one program. Exit 0 done, 1 the input is bad, 2 wrong usage.
#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <ostream>

#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/live/commands.h"

// out: whether all output was written; true if stdout was closed before the start
static bool is_printed(std::ostream &out) {
    const bool open = ::fcntl(STDOUT_FILENO, F_GETFD) >= 0;
    return out.flush().good() || !open;
}

// out: whether the first word is an unknown command, which the parser would report as missing
static bool is_unknown(const compbox::cli::command &app, const std::string &word) {
    return !word.empty() && word[0] != '-' && !app.has_subcommand(word);
}

constexpr const char *overview =
    R"(The usual order is init, fit, build, check and, at the machine, commission; then compboxd runs the
coefficient file. compbox COMMAND --help prints the options of a command.

Exit codes: 0 done, 1 the input is bad, 2 wrong usage.

Example:
  compbox init --axes X,Y,Z --profile sinumerik-840d --host 192.168.0.10 -o machine.json
  compbox fit EZX.csv --name EZX --signal X -o EZX.json
  compbox build machine.json EZX.json -o coefficients.json
  compbox check coefficients.json)";

// out: 0 done, 1 the input is bad, 2 wrong usage, 70 a fault of the program
int main(int argc, char **argv) {
    const auto io = compbox::cli::standard_streams();
    std::signal(SIGXFSZ, SIG_IGN);  // report a file at its size limit like a full disk
    if (compbox::live::is_for_fleet(argc, argv)) return compbox::live::run_fleet(argv, io);
    compbox::cli::program app{
        "compbox: from measurements of a machine tool to the coefficients of its box", io};
    app.set_version_flag("--version", "compbox " CB_VERSION);
    app.footer(overview);
    compbox::add_commands(app);
    if (argc > 1 && is_unknown(app, argv[1])) {
        io.err << "compbox: there is no command '" << argv[1] << "'; compbox --help lists them\n";
        return 2;
    }
    if (const int refused = app.run(argc, argv, [] {})) return refused;
    if (is_printed(io.out)) return 0;
    io.err << "compbox: standard output could not be written whole\n";
    return 1;
}
