// SPDX-License-Identifier: MIT
// What a request asks and gets; server.h does the rest.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "host-tools/view/body.h"

namespace compbox::view {

struct login {
    std::string user, password;
};

struct request {
    std::string path;  // without arguments
    std::optional<std::string> host, accept, if_none_match;
    std::optional<login> by;
    std::string from;       // of the reader: IPv4 address, or network of an IPv6 address; bytes
    double steady_s = 0.0;  // when it came, by a clock that nobody sets
    // out: the value of an argument behind '?', such as "hours"
    std::function<std::optional<std::string>(const char *)> argument;
};

struct answer {
    unsigned status = 200;
    std::string type = "text/plain; charset=utf-8";
    body text;               // null: `fixed`
    std::string_view fixed;  // lives as long as the program
    std::string_view etag;   // "": none, and nobody may keep the reply
    bool is_stream = false;  // the events of feed.h
};

}  // namespace compbox::view
