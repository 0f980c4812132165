// SPDX-License-Identifier: MIT
#include "host-tools/view/columns.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <map>

#include "host-tools/formats/json.h"

namespace compbox::view {

namespace {

// A float by the fewest digits that read back as it.
void put(fmt::memory_buffer &out, float value) {
    if (std::isfinite(value)) {
        fmt::format_to(std::back_inserter(out), "{}", value);
    } else {
        out.append(std::string_view("null"));
    }
}

void put(fmt::memory_buffer &out, double unix_s) {
    fmt::format_to(std::back_inserter(out), "{:.3f}", unix_s);
}

void put(fmt::memory_buffer &out, const std::string &word) {
    out.append(word.empty() ? "null" : formats::json_line(word));
}

template <typename Value>
void put_list(fmt::memory_buffer &out, const std::vector<Value> &values) {
    const char *between = "";
    out.push_back('[');
    for (const auto &value : values) {
        out.append(std::string_view(between));
        put(out, value);
        between = ",";
    }
    out.push_back(']');
}

// Appends ,"key":[…] or, without `follows`, "key":[…].
template <typename Value>
void put_member(fmt::memory_buffer &out, const std::string &key, const std::vector<Value> &values,
                bool follows) {
    if (follows) out.push_back(',');
    out.append(formats::json_line(key) + ":");
    put_list(out, values);
}

using column_list = std::vector<const column *>;

// Appends the columns of one group; those of a channel are one object.
void put_group(fmt::memory_buffer &out, const std::string &group, const column_list &list) {
    fmt::format_to(std::back_inserter(out), ",\"{}\":{{", group);
    const std::string *object = nullptr;
    for (const column *one : list) {
        const bool first = one == list.front();
        const column_key &key = one->key;
        if (key.quantity.empty()) {
            put_member(out, key.name, one->values, !first);
            continue;
        }
        const bool follows = object != nullptr && *object == key.name;
        if (!follows) {
            if (object != nullptr) out.push_back('}');
            if (!first) out.push_back(',');
            out.append(formats::json_line(key.name) + ":{");
        }
        put_member(out, key.quantity, one->values, follows);
        object = &key.name;
    }
    if (object != nullptr) out.push_back('}');
    out.push_back('}');
}

}  // namespace

std::string columns_text(const columns &table) {
    fmt::memory_buffer out;
    out.append(std::string_view("{\"version\":1"));
    put_member(out, "unix_s", table.unix_s, true);
    put_member(out, "mode", table.mode, true);
    put_member(out, "reason", table.reason, true);
    std::map<std::string, column_list> groups;
    for (const auto &one : table.all) groups[one.key.group].push_back(&one);
    for (const char *group : {"channels", "signals", "terms"}) put_group(out, group, groups[group]);
    out.push_back('}');
    return fmt::to_string(out);
}

}  // namespace compbox::view
