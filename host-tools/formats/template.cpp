// SPDX-License-Identifier: MIT
#include "host-tools/formats/template.h"

#include <stdexcept>
#include <utility>
#include <vector>

#include "host-tools/formats/json.h"
#include "host-tools/formats/text.h"

namespace compbox::formats {

namespace {

using lines = std::vector<std::string>;

// out: the lines that end; what is behind the last end is no line
lines lines_of(const std::string &text) {
    lines all = split(text, '\n');
    all.pop_back();
    return all;
}

const json &at(const json &values, const std::string &key) {
    if (!values.contains(key)) throw std::logic_error("a template has no value for " + key);
    return values.at(key);
}

bool truth(const json &value) {
    if (value.is_string()) return !value.get<std::string>().empty();
    return value.is_boolean() ? value.get<bool>() : !value.empty();
}

// in : a line without a directive. out: the line with its places filled in, and its end
std::string filled(const std::string &line, const json &values) {
    std::string text;
    std::size_t from = 0;
    for (std::size_t open; (open = line.find('@', from)) != std::string::npos;) {
        const std::size_t close = line.find('@', open + 1);
        if (close == std::string::npos) throw std::logic_error("a template has an odd @: " + line);
        const json &value = at(values, line.substr(open + 1, close - open - 1));
        text += line.substr(from, open - from);
        text += value.is_string() ? value.get<std::string>() : value.dump();
        from = close + 1;
    }
    return text + line.substr(from) + "\n";
}

// "@each key@" apart: {"each", "key"}; two empty texts for a line without a directive.
std::pair<std::string, std::string> directive(const std::string &line) {
    if (line == "@end@") return {"end", ""};
    for (const std::string word : {"each", "if", "not"}) {
        if (line.compare(0, word.size() + 2, "@" + word + " ") != 0) continue;
        return {word, line.substr(word.size() + 2, line.size() - word.size() - 3)};
    }
    return {};
}

// The line of the @end@ that belongs to the directive of line `begin`.
std::size_t end_of(const lines &all, std::size_t begin) {
    int depth = 0;
    for (std::size_t i = begin; i < all.size(); ++i) {
        const std::string word = directive(all[i]).first;
        if (!word.empty()) depth += word == "end" ? -1 : 1;
        if (depth == 0) return i;
    }
    throw std::logic_error("a template has no @end@ of " + all[begin]);
}

// in : lines [from, to), whose directives end within. out: as the function of the header
std::string expanded(const lines &all, std::size_t from, std::size_t to, const json &values) {
    std::string text;
    for (std::size_t i = from; i < to; ++i) {
        const auto [word, key] = directive(all[i]);
        if (word.empty()) {
            text += filled(all[i], values);
            continue;
        }
        const std::size_t end = end_of(all, i);
        const json &value = at(values, key);
        if (word == "each") {
            for (const auto &item : value) {
                json inside = values;
                inside.update(item);
                text += expanded(all, i + 1, end, inside);
            }
        } else if (truth(value) == (word == "if")) {
            text += expanded(all, i + 1, end, values);
        }
        i = end;
    }
    return text;
}

}  // namespace

std::string expanded(const std::string &text, const json &values) {
    const lines all = lines_of(text);
    return expanded(all, 0, all.size(), values);
}

}  // namespace compbox::formats
