// SPDX-License-Identifier: MIT
#include "host-tools/simulation/tool_steps.h"

#include <sstream>
#include <utility>

#include "host-tools/formats/error.h"
#include "host-tools/simulation/instruments.h"

namespace compbox::simulation {

namespace {

std::vector<std::string> lines_of(const std::string &all) {
    std::vector<std::string> lines;
    std::istringstream text(all);
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
}

// Accepts only the instruments or the allowed commands.
void run_words(std::vector<std::string> words, const step_world &world, const cli::streams &io) {
    cli::program app{"a step", io};
    if (words.front() == "measure") {
        add_instruments(app, world.twin);
        words.erase(words.begin());
    } else {
        world.commands(app);
        if (!app.has_subcommand(words.front())) {
            throw cli::usage_error(fmt::format(
                "'{}' is not a step: a step is measure or a command that computes, such "
                "as fit or build",
                words.front()));
        }
    }
    app.parse(std::move(words));
}

}  // namespace

std::vector<std::string> run_step(const std::string &step, const step_world &world) {
    const auto fail = [&](const std::string &why) {
        throw input_error(world.file, 0, 0, "step '{}': {}", step, why);
    };
    const std::vector<std::string> words = words_of(step, world);
    if (words.empty()) fail("is empty");
    constexpr int no_input = -1;
    std::ostringstream out, err;
    try {
        run_words(words, world, {no_input, out, err});
    } catch (const cli::usage_error &error) {
        fail(error.what());
    } catch (const input_error &error) {
        fail(error.what());
    }
    return lines_of(err.str());
}

}  // namespace compbox::simulation
