// SPDX-License-Identifier: MIT
// compbox: the host tools, one program. Exit 0 done, 1 the input is bad, 2 wrong usage.
#include <fcntl.h>
#include <unistd.h>

#include <exception>
#include <iostream>

#include "host-tools/compbox/commands.h"
#include "host-tools/formats/error.h"

// Whether what was printed arrived. A stdout that was closed before the start is nobody's loss.
static bool printed() {
    const bool open = ::fcntl(STDOUT_FILENO, F_GETFD) >= 0;
    return std::cout.flush().good() || !open;
}

int main(int argc, char **argv) {
    CLI::App app{"compbox: from measurements of a machine tool to the coefficients of its box"};
    app.require_subcommand(1);
    app.set_help_all_flag("--help-all", "Help of every command");
    compbox::add_init(app);
    compbox::add_fit(app);
    compbox::add_report(app);
    compbox::add_plan(app);
    compbox::add_assemble(app);
    compbox::add_identify(app);
    compbox::add_squareness(app);
    compbox::add_volumetric(app);
    compbox::add_select_inputs(app);
    compbox::add_train(app);
    compbox::add_build(app);
    compbox::add_pack(app);
    compbox::add_check(app);
    compbox::add_eval(app);
    compbox::add_export(app);
    compbox::add_join(app);
    compbox::add_simulate(app);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError &error) {
        return app.exit(error) == 0 ? 0 : 2;
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
