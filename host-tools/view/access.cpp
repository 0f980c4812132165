// SPDX-License-Identifier: MIT
#include "host-tools/view/access.h"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>
#include <cstdint>

#include "host-tools/command_line/login.h"

namespace compbox::view {

namespace {

bool is_number_below(const std::string &text, long end) {
    return !text.empty() && text.size() <= 5 &&
           std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c); }) &&
           std::stol(text) < end;
}

struct name_and_port {
    std::string name, port;  // the port with its colon, or ""
};

// in : HOST, HOST:PORT, [IPV6] or [IPV6]:PORT
name_and_port cut(const std::string &text) {
    if (!text.empty() && text[0] == '[') {
        const std::size_t end = text.find(']');
        if (end == std::string::npos) return {text, ""};
        return {text.substr(1, end - 1), text.substr(end + 1)};
    }
    const std::size_t colon = std::min(text.rfind(':'), text.size());
    return {text.substr(0, colon), text.substr(colon)};
}

}  // namespace

std::optional<listen_address> listen_address::parse(const std::string &text) {
    const name_and_port parts = cut(text);
    unsigned char bytes[16];
    const bool has_brackets = text.rfind('[', 0) == 0;
    const bool is_host = has_brackets ? ::inet_pton(AF_INET6, parts.name.c_str(), bytes) == 1
                                      : parts.name == "localhost" ||
                                            ::inet_pton(AF_INET, parts.name.c_str(), bytes) == 1;
    if (!is_host || parts.port.empty() || parts.port[0] != ':') return std::nullopt;
    if (!is_number_below(parts.port.substr(1), 65536)) return std::nullopt;
    return listen_address{parts.name, std::stoi(parts.port.substr(1))};
}

bool listen_address::is_loopback() const {
    return cli::is_loopback(host);
}

bool equal_in_constant_time(const std::string &given, const std::string &secret) {
    unsigned difference = given.size() == secret.size() ? 0 : 1;
    for (std::size_t i = 0; i < given.size(); ++i) {
        const char other = secret[i % std::max<std::size_t>(secret.size(), 1)];
        difference |= static_cast<unsigned char>(given[i] ^ other);
    }
    // The compiler must not end the loop early.
    volatile unsigned all = difference;
    return all == 0;
}

bool access_rule::accepts_host(const std::optional<std::string> &host) const {
    if (!address_.is_loopback()) return true;
    if (!host) return false;
    const name_and_port parts = cut(*host);
    if (!parts.port.empty() &&
        !(parts.port[0] == ':' && is_number_below(parts.port.substr(1), 65536))) {
        return false;
    }
    return parts.name == address_.host || parts.name == "localhost" || parts.name == "127.0.0.1" ||
           parts.name == "::1";
}

bool access_rule::accepts_login(const std::string &user, const std::string &password) const {
    const bool same_user = equal_in_constant_time(user, "compbox");
    const bool same_password = equal_in_constant_time(password, password_.value_or(""));
    return !password_ || (same_user && same_password);
}

}  // namespace compbox::view
