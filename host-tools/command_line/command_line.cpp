// SPDX-License-Identifier: MIT
#include "host-tools/command_line/command_line.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>

namespace compbox::cli {

streams standard_streams() {
    return {STDIN_FILENO, std::cout, std::cerr, ::isatty(STDERR_FILENO) == 1};
}

value_check one_of_numbers(std::initializer_list<int> numbers) {
    return [check = CLI::IsMember(numbers)](const std::string &text) { return check(text); };
}

value_check in_range(int least, int most) {
    return [check = CLI::Range(least, most)](const std::string &text) { return check(text); };
}

option option::required() {
    return option(is_->required());
}

option option::check(const value_check &fault, const std::string &shown_in_help) {
    return option(is_->check(fault, shown_in_help));
}

option option::option_text(const std::string &instead_of_type) {
    return option(is_->option_text(instead_of_type));
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

option option::type_name(const std::string &name) {
    return option(is_->type_name(name));
}

template <typename Value>
option command::add_option(const std::string &names, Value &variable,
                           const std::string &description) {
    return option(is_->add_option(names, variable, description));
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
    return option(is_->add_option_function<std::string>(names, take, description));
}

option command::add_flag(const std::string &names, bool &variable, const std::string &description) {
    // else --flag=text is read as a number, and a long one ends in an exception of no kind of usage
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
    : command(nullptr, nullptr), owned_(std::make_unique<CLI::App>(description)), streams_(io) {
    is_ = owned_.get();
    io_ = &streams_;
}

program::~program() = default;

void program::set_version_flag(const std::string &name, const std::string &version) {
    owned_->set_version_flag(name, version);
}

std::optional<int> program::parse(int argc, const char *const *argv) {
    try {
        owned_->parse(argc, argv);
        return std::nullopt;
    } catch (const CLI::ParseError &error) {
        return owned_->exit(error, streams_.out, streams_.err) == 0 ? 0 : 2;
    } catch (const usage_error &error) {
        owned_->exit(CLI::ValidationError(error.what()), streams_.out, streams_.err);
        return 2;
    }
}

void program::parse(std::vector<std::string> words) {
    std::reverse(words.begin(), words.end());  // as CLI11 wants them
    try {
        owned_->parse(std::move(words));
    } catch (const CLI::ParseError &error) {
        throw usage_error(error.what());
    }
}

}  // namespace compbox::cli
