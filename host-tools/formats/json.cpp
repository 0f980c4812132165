// SPDX-License-Identifier: MIT
#include "host-tools/formats/json.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/text.h"

namespace compbox::formats {

namespace {

struct line_column {
    long line, column;
};

line_column place_of(const std::string &text, std::size_t byte) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(byte, text.size()));
    const long line = 1 + static_cast<long>(std::count(text.begin(), end, '\n'));
    const std::size_t start = text.rfind(
        '\n', end == text.begin() ? 0 : static_cast<std::size_t>(end - text.begin()) - 1);
    const std::size_t column =
        static_cast<std::size_t>(end - text.begin()) - (line == 1 ? 0 : start + 1);
    return {line, static_cast<long>(std::max<std::size_t>(column, 1))};
}

// in : any text
// out: index of the first bracket beyond json_max_depth; npos: none. Brackets within strings do not
// count.
std::size_t too_deep_at(const std::string &text) {
    int depth = 0;
    bool quoted = false;
    for (std::size_t at = 0; at < text.size(); ++at) {
        const char c = text[at];
        if (quoted && c == '\\') ++at;
        if (c == '"') quoted = !quoted;
        if (quoted) continue;
        if ((c == '[' || c == '{') && ++depth > json_max_depth) return at;
        if (c == ']' || c == '}') --depth;
    }
    return std::string::npos;
}

// Limits the depth before parsing, because copying and writing a value recurse.
void refuse_deep(const std::string &path, const std::string &text) {
    const std::size_t at = too_deep_at(text);
    if (at == std::string::npos) return;
    const auto place = place_of(text, at + 1);
    throw input_error(path, place.line, place.column, "brackets are nested deeper than {}",
                      json_max_depth);
}

bool is_flat(const json &value) {
    return std::none_of(value.begin(), value.end(),
                        [](const json &v) { return v.is_structured(); });
}

// out: a JSON string. Names of files and machines may have another encoding than UTF-8.
std::string quoted(const std::string &text) {
    try {
        return json(text).dump();
    } catch (const json::type_error &) {
        return json(to_utf8(text)).dump();
    }
}

void append(std::string &out, const json &value, int depth);

void append_items(std::string &out, const json &value, int depth, char open, char close) {
    const bool one_line = is_flat(value) && (value.is_array() || value.size() <= 4);
    const std::string pad(static_cast<std::size_t>(depth + 1) * 2, ' ');
    out += open;
    bool first = true;
    for (const auto &[key, item] : value.items()) {
        if (!first) out += one_line ? ", " : ",";
        first = false;
        if (!one_line) out += "\n" + pad;
        if (value.is_object()) out += quoted(key) + ": ";
        append(out, item, depth + 1);
    }
    if (!one_line && !value.empty()) out += "\n" + pad.substr(2);
    out += close;
}

void append(std::string &out, const json &value, int depth) {
    if (value.is_object()) {
        append_items(out, value, depth, '{', '}');
    } else if (value.is_array()) {
        append_items(out, value, depth, '[', ']');
    } else if (value.is_number_float()) {
        const double number = value.get<double>();
        if (!std::isfinite(number)) throw std::logic_error("a number to be written is not finite");
        out += fmt::format("{}", number);
    } else if (value.is_string()) {
        out += quoted(value.get<std::string>());
    } else {
        out += value.dump();
    }
}

}  // namespace

std::string remedy_of_json(const std::string &text) {
    const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
    const bool brackets = first == std::string::npos || text[first] == '{' || text[first] == '[';
    return brackets ? "" : "; compbox fit makes such a file of a measurement";
}

json read_json(const std::string &path) {
    const std::string text = read_file(path);
    refuse_deep(path, text);
    std::vector<std::set<std::string>> keys;
    std::string duplicate;
    const auto callback = [&](int, json::parse_event_t event, json &parsed) {
        if (event == json::parse_event_t::object_start) keys.emplace_back();
        if (event == json::parse_event_t::object_end) keys.pop_back();
        if (event == json::parse_event_t::key &&
            !keys.back().insert(parsed.get<std::string>()).second) {
            if (duplicate.empty()) duplicate = parsed.get<std::string>();
        }
        return true;
    };
    try {
        json value = json::parse(text, callback);
        if (!duplicate.empty()) {
            throw input_error(path, 0, 0, "the key '{}' is given twice in one object", duplicate);
        }
        return value;
    } catch (const json::parse_error &error) {
        const auto at = place_of(text, error.byte == 0 ? 0 : error.byte);
        throw input_error(path, at.line, at.column, "is not valid JSON here{}",
                          remedy_of_json(text));
    } catch (const json::exception &) {
        throw input_error(path, 0, 0, "holds a number or text that cannot be read");
    }
}

std::string json_text(const json &value) {
    std::string out;
    append(out, value, 0);
    out += '\n';
    return out;
}

std::string json_line(const json &value) {
    return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

json member_or_null(const json &value, const char *key) {
    return value.is_object() ? value.value(key, json()) : json();
}

void only_keys(const json &value, std::initializer_list<const char *> allowed,
               const std::string &file, const std::string &path) {
    if (!value.is_object()) throw input_error(file, 0, 0, path + " must be an object");
    for (const auto &[key, item] : value.items()) {
        const bool known =
            std::any_of(allowed.begin(), allowed.end(),
                        [&wanted = key](const char *name) { return wanted == name; });
        if (!known) throw input_error(file, 0, 0, "{}: the key '{}' is unknown", path, key);
    }
}

}  // namespace compbox::formats
