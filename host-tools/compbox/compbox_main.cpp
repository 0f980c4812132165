// SPDX-License-Identifier: MIT
// compbox: the host tools, one program. Exit 0 done, 1 the input is bad, 2 wrong usage.
#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <exception>
#include <iostream>

#include "host-tools/compbox/commands.h"
#include "host-tools/formats/error.h"

// Whether what was printed arrived. A stdout that was closed before the start is nobody's loss.
static bool printed() {
    const bool open = ::fcntl(STDOUT_FILENO, F_GETFD) >= 0;
    return std::cout.flush().good() || !open;
}

// A first word that is no command; parsing would only say that one is missing.
static bool is_unknown(const compbox::cli::command &app, const std::string &word) {
    return !word.empty() && word[0] != '-' && !app.has_subcommand(word);
}

int main(int argc, char **argv) {
    std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is told like a full disk
    compbox::cli::program app{
        "compbox: from measurements of a machine tool to the coefficients of its box"};
    app.set_version_flag("--version", "compbox " CB_VERSION);
    compbox::add_commands(app);
    if (argc > 1 && is_unknown(app, argv[1])) {
        std::cerr << "compbox: there is no command '" << argv[1]
                  << "'; compbox --help lists them\n";
        return 2;
    }
    try {
        if (const int refused = app.parse(argc, argv).value_or(0)) return refused;
    } catch (const compbox::input_error &error) {
        std::cerr << "compbox: " << error.what() << "\n";
        return 1;
    } catch (const std::exception &error) {
        std::cerr << "compbox: fault in the program itself: " << error.what() << "\n";
        return 70;
    }
    if (printed()) return 0;
    std::cerr << "compbox: standard output could not be written whole\n";
    return 1;
}
