// SPDX-License-Identifier: MIT
#include "host-tools/uplink/texts.h"

#include <fmt/core.h>

#include "host-tools/formats/json.h"

namespace compbox::uplink {

using formats::json_line;
using formats::member_or_null;

namespace {

// out: {name: value} of a list of named objects
json by_name(const json &list, const char *key) {
    json made = json::object();
    for (const json &one : list) made[one["name"].get<std::string>()] = member_or_null(one, key);
    return made;
}

}  // namespace

std::string topic_level(const std::string &name) {
    std::string level = name.empty() ? "box" : name;
    for (char &byte : level) {
        const bool is_control = static_cast<unsigned char>(byte) < 0x20 || byte == 0x7F;
        if (is_control || byte == '/' || byte == '+' || byte == '#') byte = '_';
    }
    return level;
}

std::string state_text(const json &box, const std::string &why_not) {
    json state;
    state["state"] = 1;
    state["runs"] = why_not.empty();
    state["why_not"] = why_not;
    if (box.is_null()) return json_line(state);
    for (const char *key : {"machine", "version", "revision", "crc", "mode", "reason"})
        state[key] = member_or_null(box, key);
    const json cause = member_or_null(box, "cause");
    state["cause"] = cause.is_object() ? member_or_null(cause, "text") : json();
    return json_line(state);
}

std::string with_time(const std::string &object, double unix_s) {
    return object.substr(0, object.size() - 1) + fmt::format(R"(,"unix_s":{:.3f}}})", unix_s);
}

std::string values_text(const json &box) {
    json values;
    values["values"] = 1;
    for (const char *key : {"unix_s", "revision", "mode"}) values[key] = member_or_null(box, key);
    values["signals"] = by_name(box["signals"], "value");
    values["terms"] = by_name(box["terms"], "value");
    json channels = json::object();
    for (const json &channel : box["channels"]) {
        json &one = channels[channel["name"].get<std::string>()];
        for (const char *key : {"demand_um", "output_um", "applied_um", "limit_um"})
            one[key] = member_or_null(channel, key);
    }
    values["channels"] = channels;
    return json_line(values);
}

}  // namespace compbox::uplink
