// SPDX-License-Identifier: MIT
#include "host-tools/commission/statements.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "host-tools/command_line/command_line.h"
#include "host-tools/command_line/prompt.h"
#include "host-tools/formats/text.h"

namespace compbox::commission {

namespace {

// in : "NAME=…". out: the name and the text behind it
std::pair<std::string, std::string> split_option(const std::string &option, const std::string &text,
                                                 const char *example) {
    const std::size_t equals = text.rfind('=');
    if (equals == 0 || equals == std::string::npos) {
        throw cli::usage_error(option, fmt::format("'{}' must read {}", text, example));
    }
    return {text.substr(0, equals), text.substr(equals + 1)};
}

cli::typed_number number_of(const std::string &option, const std::string &text,
                            const std::string &whole, const char *example) {
    if (const auto number = cli::number_in(text)) return *number;
    throw cli::usage_error(option, fmt::format("'{}' must read {}", whole, example));
}

}  // namespace

std::map<std::string, double> measured_of(const std::vector<std::string> &texts) {
    std::map<std::string, double> measured;
    for (const std::string &text : texts) {
        const auto [name, value] = split_option("--measured", text, "NAME=number");
        const double um = number_of("--measured", value, text, "NAME=number").value;
        if (!measured.insert({name, um}).second) {
            throw cli::usage_error("--measured", "one number for each axis, please: " + text);
        }
    }
    return measured;
}

statements shows_of(const std::vector<std::string> &texts) {
    statements shows;
    for (const std::string &text : texts) {
        const auto [name, values] = split_option("--shows", text, "NAME=number or NAME=from:to");
        if (shows.count(name) > 0) {
            throw cli::usage_error("--shows", "once for each signal, please: " + text);
        }
        for (const auto &value : formats::split(values, ':')) {
            const auto number = number_of("--shows", value, text, "NAME=number or NAME=from:to");
            shows[name].push_back(shown_as(number.value, number.decimals));
        }
    }
    return shows;
}

void must_be_known(const std::string &option, const std::string &kind, const std::string &name,
                   const std::vector<std::string> &known) {
    if (std::count(known.begin(), known.end(), name) > 0) return;
    throw cli::usage_error(
        option, fmt::format("no {} {} to test; there is {}", kind, name, fmt::join(known, ", ")));
}

void check_statements(const position_options &options,
                      const std::vector<const map_row *> &signals) {
    std::vector<std::string> names;
    for (const auto *row : signals) {
        names.push_back(row->name);
        const auto shown = options.shows.find(row->name);
        const std::size_t needed = is_position(*row) ? 2 : 1;
        if (shown == options.shows.end() || shown->second.size() == needed) continue;
        throw cli::usage_error(
            "--shows",
            needed == 2
                ? fmt::format("two values of a position, before and after the jog: {}=0:12.5",
                              row->name)
                : fmt::format("one value, please: {}=23.4", row->name));
    }
    for (const auto &[name, values] : options.shows)
        must_be_known("--shows", "signal", name, names);
    for (const auto &stage : options.together) {
        if (stage.size() < 2)
            throw cli::usage_error("--together", "two positions of one stage, please: Y1+Y2");
        for (const auto &name : stage) must_be_known("--together", "signal", name, names);
    }
}

}  // namespace compbox::commission
