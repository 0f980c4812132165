// SPDX-License-Identifier: MIT
#include "host-tools/simulation/step_words.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

namespace compbox::simulation {

namespace {

bool is_name(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

[[noreturn]] void refuse(const std::string &step, const step_world &world, const std::string &why) {
    constexpr std::size_t shown = 60;
    throw input_error(world.file, 0, 0, "step '{}{}': {}", step.substr(0, shown),
                      step.size() > shown ? "…" : "", why);
}

// The parts of a word with their choices: a{b,c}d is (a)(b c)(d).
using places = std::vector<std::vector<std::string>>;

// Splits a word at its braces. Throws input_error for braces within braces.
places places_of(const std::string &word, const std::string &step, const step_world &world) {
    places all;
    std::size_t at = 0;
    for (;;) {
        const auto open = word.find('{', at), close = word.find('}', open);
        if (open == std::string::npos || close == std::string::npos) break;
        const std::string inside = word.substr(open + 1, close - open - 1);
        if (inside.find('{') != std::string::npos) refuse(step, world, "braces within braces");
        all.push_back({word.substr(at, open - at)});
        all.emplace_back();
        std::istringstream choices(inside);
        for (std::string one; std::getline(choices, one, ',');) all.back().push_back(one);
        at = close + 1;
    }
    all.push_back({word.substr(at)});
    return all;
}

// out: number of words of the places, at most most_words + 1
std::size_t count_of(const places &all) {
    std::size_t count = 1;
    for (const auto &place : all) count = std::min(count * place.size(), most_words + 1);
    return count;
}

// out: the words; the last place changes first
std::vector<std::string> choices_of(const places &all) {
    std::vector<std::string> words{""};
    for (const auto &place : all) {
        std::vector<std::string> longer;
        for (const auto &word : words) {
            for (const auto &one : place) longer.push_back(word + one);
        }
        words = std::move(longer);
    }
    return words;
}

// out: the word with each $NAME replaced; throws input_error for an unknown name
std::string with_names(const std::string &word, const step_world &world) {
    std::string result;
    for (std::size_t i = 0; i < word.size();) {
        if (word[i] != '$' || i + 1 >= word.size() || !is_name(word[i + 1])) {
            result += word[i++];
            continue;
        }
        const std::size_t start = ++i;
        while (i < word.size() && is_name(word[i])) ++i;
        const std::string name = word.substr(start, i - start);
        const auto found = world.names.find(name);
        if (found == world.names.end()) {
            throw input_error(world.file, 0, 0, "steps: there is no '${}'", name);
        }
        result += found->second;
    }
    return result;
}

std::string with_files(const std::string &word) {
    const auto open = word.find("$("), close = word.find(')', open);
    if (open == std::string::npos || close == std::string::npos) return word;
    std::string text = formats::read_file(word.substr(open + 2, close - open - 2), 1u << 16);
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
    return word.substr(0, open) + text + word.substr(close + 1);
}

}  // namespace

std::vector<std::string> words_of(const std::string &step, const step_world &world) {
    if (step.size() > longest_step) {
        refuse(step, world, fmt::format("is longer than {} characters", longest_step));
    }
    std::vector<std::string> words;
    std::istringstream text(step);
    for (std::string word; text >> word;) {
        const places choices = places_of(word, step, world);
        if (words.size() + count_of(choices) > most_words) {
            refuse(
                step, world,
                fmt::format("its braces make more than {} words: write fewer choices", most_words));
        }
        for (const auto &one : choices_of(choices)) {
            words.push_back(with_files(with_names(one, world)));
        }
    }
    return words;
}

}  // namespace compbox::simulation
