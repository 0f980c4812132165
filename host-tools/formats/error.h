// SPDX-License-Identifier: MIT
// Errors that the user can correct; every tool prints one sentence and exits with 1. Includes
// libfmt for the sentences. Numbers: "{:.4g}" for reading, "{}" for an exact value.
#pragma once

#include <fmt/core.h>

#include <stdexcept>
#include <string>
#include <utility>

#include "host-tools/formats/text.h"

namespace compbox {

// Fault, place and remedy. `what()` is the whole sentence, without a full stop and printable
// (text.h).
class input_error : public std::runtime_error {
  public:
    explicit input_error(const std::string &sentence)
        : std::runtime_error(formats::printable(sentence)) {}
    // "FILE:LINE:COLUMN: sentence"; a line or column of 0 is left out.
    input_error(const std::string &file, long line, long column, const std::string &sentence)
        : input_error(fmt::format("{}{}{}: {}", file, line > 0 ? fmt::format(":{}", line) : "",
                                  line > 0 && column > 0 ? fmt::format(":{}", column) : "",
                                  sentence)) {}
    // The values replace the {} of the sentence.
    template <typename Value, typename... Values>
    input_error(const std::string &file, long line, long column,
                fmt::format_string<Value, Values...> sentence, Value &&value, Values &&...values)
        : input_error(
              file, line, column,
              fmt::format(sentence, std::forward<Value>(value), std::forward<Values>(values)...)) {}
};

}  // namespace compbox
