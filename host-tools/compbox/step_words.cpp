// SPDX-License-Identifier: MIT
#include "host-tools/compbox/step_words.h"

#include <sstream>

#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

namespace compbox {

namespace {

bool is_name(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

// The first pair of braces of a word for each of its choices, and so on.
std::vector<std::string> choices_of(const std::string &word) {
    const auto open = word.find('{'), close = word.find('}', open);
    if (open == std::string::npos || close == std::string::npos) return {word};
    std::vector<std::string> all;
    std::istringstream choices(word.substr(open + 1, close - open - 1));
    for (std::string one; std::getline(choices, one, ',');) {
        const auto more = choices_of(word.substr(0, open) + one + word.substr(close + 1));
        all.insert(all.end(), more.begin(), more.end());
    }
    return all;
}

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
            throw input_error(world.file, 0, 0, "steps: there is no '$" + name + "'");
        }
        result += found->second;
    }
    return result;
}

std::string with_files(const std::string &word) {
    const auto open = word.find("$("), close = word.find(')', open);
    if (open == std::string::npos || close == std::string::npos) return word;
    std::string text = read_file(word.substr(open + 2, close - open - 2), 1u << 16);
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
    return word.substr(0, open) + text + word.substr(close + 1);
}

}  // namespace

std::vector<std::string> words_of(const std::string &step, const step_world &world) {
    std::vector<std::string> words;
    std::istringstream text(step);
    for (std::string word; text >> word;) {
        for (const auto &one : choices_of(word)) {
            words.push_back(with_files(with_names(one, world)));
        }
    }
    return words;
}

}  // namespace compbox
