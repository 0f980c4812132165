// SPDX-License-Identifier: MIT
// Options, sub-commands, help and wrong usage of the programs. CLI11 does the work, in
// command_line.cpp alone: its headers take a compiler longer than a command of ours.
#pragma once

#include <functional>
#include <initializer_list>
#include <iosfwd>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace compbox::cli {

// What was typed makes no sense: the sentence names the option and the remedy.
struct usage_error : std::runtime_error {
    explicit usage_error(const std::string &sentence) : std::runtime_error(sentence) {}
    usage_error(const std::string &option, const std::string &sentence)
        : usage_error(option + ": " + sentence) {}
};

// What a program reads and prints. Nothing else writes to a stream of the process.
struct streams {
    int in;  // a descriptor: commands ask questions while the cycle of a box goes on
    std::ostream &out, &err;
    bool shows_progress = false;  // err is a terminal
};
streams standard_streams();

// in : one value as typed. out: what is wrong with it in a few words, "" for nothing.
using value_check = std::function<std::string(const std::string &)>;

// Whole numbers, as CLI11 reads them (0x10 is one too). More checks: option_checks.h.
value_check one_of_numbers(std::initializer_list<int> numbers);
value_check in_range(int least, int most);  // both included

// A handle; the program owns the option. Each call returns the same option.
class option {
  public:
    option required();
    option check(const value_check &fault, const std::string &shown_in_help = "");
    option option_text(const std::string &instead_of_type);  // in help
    option delimiter(char between_values);
    option expected(int values);
    option needs(option other);
    option excludes(option other);
    option capture_default_str();  // help shows the variable's value of now

  private:
    friend class command;
    explicit option(CLI::Option *is) : is_(is) {}
    option type_name(const std::string &name);
    CLI::Option *is_;
};

// A handle; the program owns the command. Variables must live until the program has parsed.
class command {
  public:
    // in : names "-o,--output", or "file" for a value by its place. Kinds of variables:
    // std::string, int, unsigned, std::size_t, double; std::optional of the last three;
    // std::vector of std::string or double.
    template <typename Value>
    option add_option(const std::string &names, Value &variable,
                      const std::string &description = "");

    // Calls `take` with the text.
    option add_option_function(const std::string &names,
                               const std::function<void(const std::string &)> &take,
                               const std::string &description);

    // The value whose name was given; wrong usage lists the names.
    template <typename Choice>
    option add_choice(const std::string &names, Choice &variable,
                      const std::map<std::string, Choice> &choices, const std::string &description);

    // in : names "--json"; "!--apart" makes the variable false; it takes no value
    option add_flag(const std::string &names, bool &variable, const std::string &description);

    command add_subcommand(const std::string &name, const std::string &description);
    bool has_subcommand(const std::string &name) const;
    void require_subcommand();

    void footer(const std::string &text);
    void set_help_all_flag(const std::string &name, const std::string &description);

    // What to do where all options are right. It may throw usage_error for what they mean together.
    void callback(const std::function<void(const streams &)> &run);

  protected:
    command(CLI::App *is, const streams *io) : is_(is), io_(io) {}
    CLI::App *is_;
    const streams *io_;  // the program's
};

class program : public command {
  public:
    program(const std::string &description, const streams &io);
    ~program();
    program(const program &) = delete;
    program &operator=(const program &) = delete;

    void set_version_flag(const std::string &name, const std::string &version);

    // Sets the variables, then runs the commands' callbacks. out: nothing where the program may go
    // on; else its exit code: 0 where help or the version was printed, 2 for wrong usage, printed
    // to streams.err. What callbacks throw beside usage_error comes out.
    std::optional<int> parse(int argc, const char *const *argv);

    // The same of words, in order and without the program's name. Prints nothing of its own: wrong
    // usage and calls for help throw usage_error.
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
    return add_option_function(names, take, description)
        .type_name(std::is_enum_v<Choice> ? "ENUM" : "BOOLEAN")
        .check(fault);
}

}  // namespace compbox::cli
