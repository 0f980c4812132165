// SPDX-License-Identifier: MIT
#include "host-tools/simulation/tool_steps.h"

#include <iostream>
#include <sstream>
#include <utility>

#include "host-tools/formats/error.h"
#include "host-tools/simulation/instruments.h"

namespace compbox::simulation {

namespace {

// A stream goes into a text as long as this lives.
class redirected {
  public:
    explicit redirected(std::ostream &stream) : stream_(stream), before_(stream.rdbuf()) {
        stream_.rdbuf(text_.rdbuf());
    }
    ~redirected() { stream_.rdbuf(before_); }
    redirected(const redirected &) = delete;
    redirected &operator=(const redirected &) = delete;
    std::vector<std::string> lines() const {
        std::vector<std::string> lines;
        std::istringstream text(text_.str());
        for (std::string line; std::getline(text, line);) lines.push_back(line);
        return lines;
    }

  private:
    std::ostream &stream_;
    std::streambuf *before_;
    std::ostringstream text_;
};

// The parser of a step knows the instruments or the allowed commands, and nothing else.
void run_words(std::vector<std::string> words, const step_world &world) {
    cli::program app{"a step"};
    if (words.front() == "measure") {
        add_instruments(app, world.twin);
        words.erase(words.begin());
    } else {
        world.commands(app);
        if (!app.has_subcommand(words.front())) {
            throw cli::usage_error("'" + words.front() +
                                   "' is not a step: a step is measure or a command that computes, "
                                   "such as fit or build");
        }
    }
    app.parse(std::move(words));
}

}  // namespace

std::vector<std::string> run_step(const std::string &step, const step_world &world) {
    const auto fail = [&](const std::string &why) {
        throw input_error(world.file, 0, 0, "step '" + step + "': " + why);
    };
    const std::vector<std::string> words = words_of(step, world);
    if (words.empty()) fail("is empty");
    const redirected out(std::cout), said(std::cerr);
    try {
        run_words(words, world);
    } catch (const cli::usage_error &error) {
        fail(error.what());
    } catch (const input_error &error) {
        fail(error.what());
    }
    return said.lines();
}

}  // namespace compbox::simulation
