// SPDX-License-Identifier: MIT
#include "host-tools/command_line/option_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <system_error>

#include "host-tools/formats/csv.h"

namespace compbox::cli {

namespace {

// The whole text as a number; blanks (of "1, 2") and a plus sign may come before it.
template <typename Number>
bool read_number(const std::string &text, Number &value) {
    std::size_t start = std::min(text.find_first_not_of(' '), text.size());
    if (text.compare(start, 1, "+") == 0 && text.compare(start + 1, 1, "-") != 0) ++start;
    const char *end = text.data() + text.size();
    const auto result = std::from_chars(text.data() + start, end, value);
    return result.ec == std::errc() && result.ptr == end;
}

// in : `must`, what a number for which `fits` is false must be: "must be above 0"
cli::value_check check(const std::string &must, const std::function<bool(double)> &fits) {
    return [must, fits](const std::string &text) {
        double value = 0.0;
        if (!read_number(text, value) || !std::isfinite(value)) {
            return fmt::format("'{}' is not a finite number", text);
        }
        return fits(value) ? std::string() : fmt::format("{}, not {}", must, text);
    };
}

}  // namespace

void different_files(const std::vector<std::pair<std::string, std::string>> &outputs) {
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
            if (outputs[i].second.empty() || outputs[i].second != outputs[k].second) continue;
            throw cli::usage_error(outputs[i].first, "names the same file as " + outputs[k].first);
        }
    }
}

cli::value_check one_of(const std::vector<std::string> &words) {
    return [words](const std::string &text) {
        const bool there = std::count(words.begin(), words.end(), text) > 0;
        return there ? std::string()
                     : fmt::format("must be one of {}, not {}", fmt::join(words, ", "), text);
    };
}

cli::value_check any_number() {
    return check("", [](double) { return true; });
}

cli::value_check above_zero() {
    return check("must be above 0", [](double value) { return value > 0.0; });
}

cli::value_check zero_or_more() {
    return check("must be 0 or more", [](double value) { return value >= 0.0; });
}

cli::value_check between(double least, double most) {
    return check(fmt::format("must be from {:.10g} to {:.10g}", least, most),
                 [=](double value) { return value >= least && value <= most; });
}

cli::value_check whole_between(long least, long most) {
    const std::string must = fmt::format("must be a whole number from {} to {}, not ", least, most);
    return [=](const std::string &text) {
        long value = 0;
        const bool fits = read_number(text, value) && value >= least && value <= most;
        return fits ? std::string() : must + text;
    };
}

}  // namespace compbox::cli
