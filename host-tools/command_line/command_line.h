// SPDX-License-Identifier: MIT
// Options, sub-commands, help and usage errors of the programs. Only command_line.cpp includes
// CLI11, because its headers are slow to compile.
#pragma once

#include <functional>
#include <iosfwd>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace compbox::cli {

// Wrong usage; the sentence names the option and the remedy.
struct usage_error : std::runtime_error {
    explicit usage_error(const std::string &sentence) : std::runtime_error(sentence) {}
    usage_error(const std::string &option, const std::string &sentence)
        : usage_error(option + ": " + sentence) {}
};

// Input and outputs of a program. No other code writes to a stream of the process.
struct streams {
    int in;  // a descriptor, because `commission` polls it while the box's cycle runs
    std::ostream &out, &err;
    bool shows_progress = false;  // err is a terminal
};
streams standard_streams();

// in : one value as typed. out: what is wrong with it in a few words, "" for a valid one.
// option_checks.h has the usual ones.
using value_check = std::function<std::string(const std::string &)>;

// A handle; the program owns the option. Each call returns the same option.
class option {
  public:
    option required();
    option check(const value_check &fault);
    option delimiter(char between_values);
    option expected(int values);
    option needs(option other);
    option excludes(option other);
    option capture_default_str();  // help shows the variable's present value

  private:
    friend class command;
    explicit option(CLI::Option *is) : is_(is) {}
    CLI::Option *is_;
};

// A handle; the program owns the command. Variables must live until the program has parsed.
class command {
  public:
    // in : names "-o,--output F.json" with the placeholder for help, or "FILE" for a positional;
    // a variable of std::string, int, unsigned, std::size_t, double, std::optional of the last
    // three, std::vector of std::string or double.
    template <typename Value>
    option add_option(const std::string &names, Value &variable,
                      const std::string &description = "");

    // Calls `take` with the text.
    option add_option_function(const std::string &names,
                               const std::function<void(const std::string &)> &take,
                               const std::string &description);

    // Sets the variable to the choice with the given name. The usage error lists the names.
    template <typename Choice>
    option add_choice(const std::string &names, Choice &variable,
                      const std::map<std::string, Choice> &choices, const std::string &description);

    // in : names "--json"; "!--apart" makes the variable false; it takes no value.
    option add_flag(const std::string &names, bool &variable, const std::string &description);

    command add_subcommand(const std::string &name, const std::string &description);
    bool has_subcommand(const std::string &name) const;
    void require_subcommand();

    void footer(const std::string &text);
    void set_help_all_flag(const std::string &name, const std::string &description);

    // Runs if all options are valid. It may throw usage_error for an invalid combination.
    void callback(const std::function<void(const streams &)> &run);

  protected:
    command(CLI::App *is, const streams *io) : is_(is), io_(io) {}
    CLI::App *is_;
    const streams *io_;  // the program's
};

class program : public command {
  public:
    // in : description "NAME: what it does"; NAME begins each usage error
    program(const std::string &description, const streams &io);
    ~program();
    program(const program &) = delete;
    program &operator=(const program &) = delete;

    void set_version_flag(const std::string &name, const std::string &version);

    // Sets the variables, then runs the commands' callbacks.
    // out: nothing: the program goes on; else its exit code: 0 after help or the version, 2 after
    // a usage error, which is printed to streams.err. Other exceptions of callbacks pass through.
    std::optional<int> parse(int argc, const char *const *argv);

    // Parses, then does the work. Errors of both are printed to streams.err.
    // out: exit code: 0 done, 1 the input is bad, 2 wrong usage, 70 a fault of the program
    int run(int argc, const char *const *argv, const std::function<void()> &work);

    // in : the words in order, without the program's name. Prints nothing; throws usage_error for
    // wrong usage and for --help.
    void parse(std::vector<std::string> words);

  private:
    std::unique_ptr<CLI::App> owned_;
    const streams streams_;
};

template <typename Choice>
option command::add_choice(const std::string &names, Choice &variable,
                           const std::map<std::string, Choice> &choices,
                           const std::string &description) {
    const auto take = [&variable, choices](const std::string &text) {
        variable = choices.at(text);
    };
    const auto fault = [choices](const std::string &text) {
        if (choices.count(text) > 0) return std::string();
        std::string all;
        for (const auto &choice : choices) all += (all.empty() ? "" : ", ") + choice.first;
        return "must be one of " + all + ", not " + text;
    };
    return add_option_function(names, take, description).check(fault);
}

}  // namespace compbox::cli
