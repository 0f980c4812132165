// SPDX-License-Identifier: MIT
// compbox fleet: hands its arguments to the Python package host-tools/fleet.
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <ostream>
#include <vector>

#include "host-tools/compbox/live/commands.h"

namespace compbox::live {

namespace {

constexpr const char *python = "/usr/bin/python3";

constexpr const char *fleet_example =
    R"(Commands, each with its own --help:
  add       Add a machine to the registry
  record    Add records of the box, oldest first
  snapshot  Keep a snapshot of the box
  status    Show which machines drift
  plan      Show the training jobs that are due
  train     Train the models that are due
  run-job   Run one task of a Slurm array
  collect   Take the results of a Slurm array into the registry
  running   Keep the file that a box runs, to return to
  rollout   Bring better models to the boxes, in stages
  receive   On a box: take signed files that arrive
  report    Write a page about the fleet, with pictures
  bridge    Bring what boxes publish into a time-series database
  demo      Start a site with simulated boxes on this computer, until Ctrl-C

Example:
  compbox fleet status --registry plant)";

}  // namespace

void add_fleet(cli::command &app) {
    cli::command fleet = app.add_subcommand("fleet", "Keep the models of many machines good");
    fleet.footer(fleet_example);
    fleet.callback([](const cli::streams &) {
        throw cli::usage_error("fleet", "needs a command, as in: compbox fleet status");
    });
}

bool is_for_fleet(int argc, char **argv) {
    return argc > 2 && std::strcmp(argv[1], "fleet") == 0 && argv[2][0] != '-';
}

int run_fleet(char **argv, const cli::streams &io) {
    std::error_code failed;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", failed);
    const auto package = program.parent_path().parent_path() / "share/compbox";
    ::setenv("PYTHONPATH", package.c_str(), 1);
    ::setenv("PYTHONDONTWRITEBYTECODE", "1", 1);
    ::setenv("COMPBOX_PROGRAM", program.c_str(), 1);
    std::vector<const char *> words = {python, "-P", "-s", "-m", "fleet"};
    for (char **word = argv + 2; *word != nullptr; ++word) words.push_back(*word);
    words.push_back(nullptr);
    ::execv(python, const_cast<char *const *>(words.data()));
    io.err << "compbox: " << python << ": " << std::strerror(errno)
           << "; install the package python3\n";
    return 1;
}

}  // namespace compbox::live
