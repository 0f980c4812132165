// SPDX-License-Identifier: MIT
// Who may read: any program of this computer, or whoever has the password.
#pragma once

#include <optional>
#include <string>

namespace compbox::view {

struct listen_address {
    std::string host;  // numeric, or localhost; without brackets
    int port = 0;      // 0: any free one

    // out: from "127.0.0.1:8090", "[::1]:8090" or "localhost:8090"; nothing for another text
    static std::optional<listen_address> parse(const std::string &text);

    bool is_loopback() const;
};

// out: whether both texts are equal; the time depends on the length of `given` alone
bool equal_in_constant_time(const std::string &given, const std::string &secret);

class access_rule {
  public:
    // in : password: nothing: none is asked for, which needs a loopback address
    access_rule(const listen_address &address, std::optional<std::string> password)
        : address_(address), password_(std::move(password)) {}

    // A page of another site can reach a loopback address under a name of its own (DNS rebinding).
    // in : the header Host; nothing: it is missing
    bool accepts_host(const std::optional<std::string> &host) const;

    // in : of HTTP basic authentication
    bool accepts_login(const std::string &user, const std::string &password) const;

    bool needs_login() const { return password_.has_value(); }

  private:
    listen_address address_;
    std::optional<std::string> password_;
};

}  // namespace compbox::view
