// SPDX-License-Identifier: MIT
#include "host-tools/simulation/table.h"

#include "host-tools/formats/json.h"
#include "host-tools/twin/twin_file.h"

namespace compbox::simulation::table {

std::string percent(double value) {
    return fmt::format("{:6.1f} %", value);
}

std::string row(const std::string &name, const std::string &letters, const cell &text_of) {
    std::string line = fmt::format("  {:30}", name);
    for (const char letter : letters) {
        line +=
            fmt::format("  {:>26}", text_of(static_cast<std::size_t>(twin::axis_index(letter))));
    }
    return line + "\n";
}

std::string headings(const std::string &letters) {
    return row("", letters, [](std::size_t a) { return std::string(1, twin::axis_letters[a]); }) +
           row("", letters, [](std::size_t) { return std::string(heading); });
}

std::string percent_row(const std::string &name, const std::string &letters, const number &value) {
    return row(name, letters, [&](std::size_t a) { return percent(value(a)); });
}

double rounded(double value) {
    return std::stod(fmt::format("{:.4f}", value));
}

json by_axis(const std::string &letters, const number &value) {
    json object = json::object();
    for (const char letter : letters) {
        object[std::string(1, letter)] =
            rounded(value(static_cast<std::size_t>(twin::axis_index(letter))));
    }
    return object;
}

json intervals_by_axis(const std::string &directions,
                       const std::function<std::optional<interval>(std::size_t)> &of) {
    json object = json::object();
    for (const char letter : directions) {
        const auto found = of(static_cast<std::size_t>(twin::axis_index(letter)));
        if (!found) return nullptr;
        object[std::string(1, letter)] = {rounded(found->low), rounded(found->high)};
    }
    return object;
}

}  // namespace compbox::simulation::table
