// SPDX-License-Identifier: MIT
#include "host-tools/view/status_words.h"

#include <algorithm>
#include <iterator>

#include "firmware/box/mode.h"

namespace compbox::view {

namespace {

struct code {
    int number;
    const char *word;
};

constexpr code modes[] = {
#define CB_X(name, value, text) {value, text},
    CB_MODES(CB_X)
#undef CB_X
};

constexpr code reasons[] = {
#define CB_X(name, value, text) {value, text},
    CB_REASONS(CB_X)
#undef CB_X
};

template <std::size_t Count>
std::optional<int> number_of(const code (&codes)[Count], const std::string &word) {
    const auto found = std::find_if(std::begin(codes), std::end(codes),
                                    [&word](const code &one) { return word == one.word; });
    return found == std::end(codes) ? std::nullopt : std::optional<int>(found->number);
}

template <std::size_t Count>
std::string word_of(const code (&codes)[Count], int number) {
    const auto found = std::find_if(std::begin(codes), std::end(codes),
                                    [number](const code &one) { return number == one.number; });
    return found == std::end(codes) ? "" : found->word;
}

}  // namespace

std::optional<int> mode_number(const std::string &word) {
    return number_of(modes, word);
}

std::optional<int> reason_number(const std::string &word) {
    return number_of(reasons, word);
}

std::string mode_word(int number) {
    return word_of(modes, number);
}

std::string reason_word(int number) {
    return word_of(reasons, number);
}

int mode_severity(int number) {
    constexpr int from_least[] = {CB_MODE_ACTIVE, CB_MODE_STANDBY, CB_MODE_STOPPED,
                                  CB_MODE_RAMP,   CB_MODE_HOLD,    CB_MODE_FAULT};
    const auto found = std::find(std::begin(from_least), std::end(from_least), number);
    return found == std::end(from_least)
               ? -1
               : static_cast<int>(std::distance(std::begin(from_least), found));
}

}  // namespace compbox::view
