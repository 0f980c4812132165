// SPDX-License-Identifier: MIT
#include "host-tools/command_line/command_line.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>

#include "host-tools/formats/error.h"

namespace compbox::cli {

streams standard_streams() {
    return {STDIN_FILENO, std::cout, std::cerr, ::isatty(STDERR_FILENO) == 1};
}

namespace {

// "-o,--output F.json" are the names "-o,--output" and the placeholder "F.json".
std::string names_of(const std::string &text) {
    return text.substr(0, text.find(' '));
}
std::string placeholder_of(const std::string &text) {
    return text.substr(std::min(text.find(' '), text.size()));
}

// Shows "--degree N", "--port N=1502" or "--name NAME REQUIRED", without CLI11's type names.
class formatter : public CLI::Formatter {
    std::string make_option_name(const CLI::Option *one, bool positional) const override {
        const std::string name = CLI::Formatter::make_option_name(one, positional);
        return name.substr(0, name.find('{'));
    }
    std::string make_option_opts(const CLI::Option *one) const override {
        const std::string initial = one->get_default_str();
        return one->get_option_text() + (initial.empty() ? "" : "=" + initial) +
               (one->get_required() ? " REQUIRED" : "");
    }
};

// in : text "X: 3 required TEXT missing" or "X: At least 3 required but received 2"
std::string mismatch_of(const std::string &text) {
    const std::size_t colon = text.find(": "), received = text.find("received ");
    if (colon == std::string::npos) return "--" + names_of(text) + " takes no value";
    const std::string count = names_of(text.substr(text.find_first_of("0123456789", colon)));
    return text.substr(0, colon) + " needs " + count + (count == "1" ? " value" : " values") +
           (received == std::string::npos ? "" : ", not " + text.substr(received + 9));
}

// out: what is wrong and where, in place of CLI11's own sentence
std::string sentence_of(const CLI::ParseError &error) {
    const std::string text = error.what(), kind = error.get_name();
    const auto replaced = [&text](const std::string &from, const std::string &to) {
        const std::size_t at = text.find(from);
        return at == std::string::npos ? text : std::string(text).replace(at, from.size(), to);
    };
    if (text == "A subcommand is required") return "a command is missing";
    if (kind == "RequiredError") return replaced(" is required", " is missing");
    if (kind == "RequiresError") return replaced(" requires ", " needs ");
    if (kind == "ExcludesError") return replaced(" excludes ", " cannot be combined with ");
    if (text.rfind("The following argument", 0) == 0) {
        return "unknown argument " + text.substr(text.find(": ") + 2);
    }
    if (kind == "ConversionError") return replaced("Could not convert: ", "not a number: ");
    return kind == "ArgumentMismatch" ? mismatch_of(text) : text;
}

}  // namespace

option option::required() {
    return option(is_->required());
}

option option::check(const value_check &fault) {
    return option(is_->check(fault));
}

option option::delimiter(char between_values) {
    return option(is_->delimiter(between_values));
}

option option::expected(int values) {
    return option(is_->expected(values));
}

option option::needs(option other) {
    return option(is_->needs(other.is_));
}

option option::excludes(option other) {
    return option(is_->excludes(other.is_));
}

option option::capture_default_str() {
    return option(is_->capture_default_str());
}

template <typename Value>
option command::add_option(const std::string &names, Value &variable,
                           const std::string &description) {
    const auto is = is_->add_option(names_of(names), variable, description);
    return option(is->option_text(placeholder_of(names)));
}

using phrase = const std::string &;
template option command::add_option(phrase, std::string &, phrase);
template option command::add_option(phrase, int &, phrase);
template option command::add_option(phrase, unsigned &, phrase);
template option command::add_option(phrase, std::size_t &, phrase);
template option command::add_option(phrase, double &, phrase);
template option command::add_option(phrase, std::optional<unsigned> &, phrase);
template option command::add_option(phrase, std::optional<std::size_t> &, phrase);
template option command::add_option(phrase, std::optional<double> &, phrase);
template option command::add_option(phrase, std::vector<std::string> &, phrase);
template option command::add_option(phrase, std::vector<double> &, phrase);

option command::add_option_function(const std::string &names,
                                    const std::function<void(const std::string &)> &take,
                                    const std::string &description) {
    const auto is = is_->add_option_function<std::string>(names_of(names), take, description);
    return option(is->option_text(placeholder_of(names)));
}

option command::add_flag(const std::string &names, bool &variable, const std::string &description) {
    // Without this, CLI11 reads --flag=text as a number; a long one throws an unrelated exception.
    return option(is_->add_flag(names, variable, description)->disable_flag_override());
}

command command::add_subcommand(const std::string &name, const std::string &description) {
    return command(is_->add_subcommand(name, description), io_);
}

bool command::has_subcommand(const std::string &name) const {
    const auto is_it = [&name](const CLI::App *one) { return one->get_name() == name; };
    return !is_->get_subcommands(is_it).empty();
}

void command::require_subcommand() {
    is_->require_subcommand(1);
}

void command::footer(const std::string &text) {
    is_->footer(text);
}

void command::set_help_all_flag(const std::string &name, const std::string &description) {
    is_->set_help_all_flag(name, description);
}

void command::callback(const std::function<void(const streams &)> &run) {
    is_->callback([run, io = io_] { run(*io); });
}

program::program(const std::string &description, const streams &io)
    : command(nullptr, nullptr),
      owned_(std::make_unique<CLI::App>(description, description.substr(0, description.find(':')))),
      streams_(io) {
    is_ = owned_.get();
    is_->formatter(std::make_shared<formatter>());
    io_ = &streams_;
}

program::~program() = default;

void program::set_version_flag(const std::string &name, const std::string &version) {
    owned_->set_version_flag(name, version);
}

std::optional<int> program::parse(int argc, const char *const *argv) {
    std::string sentence;
    try {
        owned_->parse(argc, argv);
        return std::nullopt;
    } catch (const CLI::Success &printed) {
        return owned_->exit(printed, streams_.out, streams_.err);
    } catch (const CLI::ParseError &error) {
        sentence = sentence_of(error);
    } catch (const usage_error &error) {
        sentence = error.what();
    }
    streams_.err << owned_->get_name() << ": " << sentence
                 << "\nRun with --help for more information.\n";
    return 2;
}

int program::run(int argc, const char *const *argv, const std::function<void()> &work) {
    const auto failed = [this](int code, const std::string &sentence) {
        streams_.err << owned_->get_name() << ": " << sentence << "\n";
        return code;
    };
    try {
        if (const auto end = parse(argc, argv)) return *end;
        work();
        return 0;
    } catch (const usage_error &error) {
        return failed(2, error.what());
    } catch (const input_error &error) {
        return failed(1, error.what());
    } catch (const std::exception &error) {
        return failed(70, std::string("fault in the program itself: ") + error.what());
    }
}

void program::parse(std::vector<std::string> words) {
    std::reverse(words.begin(), words.end());  // CLI11 takes the last word first
    try {
        owned_->parse(std::move(words));
    } catch (const CLI::ParseError &error) {
        throw usage_error(sentence_of(error));
    }
}

}  // namespace compbox::cli
