// SPDX-License-Identifier: MIT
#include "host-tools/compbox/tool_steps.h"

#include <algorithm>
#include <iostream>
#include <sstream>

#include "host-tools/compbox/commands.h"
#include "host-tools/compbox/instruments.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

namespace compbox {

namespace {

// A stream goes into a text as long as this lives.
class redirected {
  public:
    explicit redirected(std::ostream &stream) : stream_(stream), before_(stream.rdbuf()) {
        stream_.rdbuf(text_.rdbuf());
    }
    ~redirected() { stream_.rdbuf(before_); }
    redirected(const redirected &) = delete;
    redirected &operator=(const redirected &) = delete;
    std::vector<std::string> lines() const {
        std::vector<std::string> lines;
        std::istringstream text(text_.str());
        for (std::string line; std::getline(text, line);) lines.push_back(line);
        return lines;
    }

  private:
    std::ostream &stream_;
    std::streambuf *before_;
    std::ostringstream text_;
};

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

void run_words(std::vector<std::string> words, const step_world &world) {
    CLI::App app{"a step"};
    if (words.front() == "measure") {
        add_instruments(app, world.twin);
        words.erase(words.begin());
    } else {
        add_commands(app);
    }
    std::reverse(words.begin(), words.end());  // as CLI11 wants them
    app.parse(words);
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

std::vector<std::string> run_step(const std::string &step, const step_world &world) {
    const auto fail = [&](const std::string &why) {
        throw input_error(world.file, 0, 0, "step '" + step + "': " + why);
    };
    const std::vector<std::string> words = words_of(step, world);
    if (words.empty()) fail("is empty");
    if (words.front() == "simulate") fail("a scenario within a scenario");
    const redirected out(std::cout), said(std::cerr);
    try {
        run_words(words, world);
    } catch (const CLI::ParseError &error) {
        fail(error.what());
    } catch (const input_error &error) {
        fail(error.what());
    }
    return said.lines();
}

}  // namespace compbox
