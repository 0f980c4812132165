// SPDX-License-Identifier: MIT
#include "host-tools/uplink/options.h"

#include <limits.h>
#include <unistd.h>

#include <charconv>

#include "host-tools/command_line/login.h"
#include "host-tools/command_line/option_checks.h"
#include "host-tools/uplink/texts.h"

namespace compbox::uplink {

namespace {

constexpr int plain_port = 1883, tls_port = 8883;  // registered with IANA
constexpr int most_port = 65535;

struct address {
    std::string host;
    std::optional<int> port;
};

// out: nothing for a text that is no address
std::optional<address> address_in(const std::string &text) {
    const bool brackets = !text.empty() && text[0] == '[';
    const std::size_t end = brackets ? text.find(']') : text.find(':');
    const std::string host = text.substr(brackets ? 1 : 0, end - (brackets ? 1 : 0));
    if (host.empty() || (brackets && end == std::string::npos)) return std::nullopt;
    const std::string rest = end == std::string::npos ? "" : text.substr(end + (brackets ? 1 : 0));
    if (rest.empty()) return address{host, std::nullopt};
    int port = 0;
    const auto read = std::from_chars(rest.data() + 1, rest.data() + rest.size(), port);
    const bool whole = read.ec == std::errc() && read.ptr == rest.data() + rest.size();
    if (rest[0] != ':' || !whole || port < 1 || port > most_port) return std::nullopt;
    return address{host, port};
}

std::string default_topic() {
    char name[HOST_NAME_MAX + 1] = "";
    ::gethostname(name, sizeof name - 1);
    return "compbox/" + topic_level(name);
}

// Throws usage_error.
void check_together(const options &chosen, const address &to) {
    if (chosen.user.empty() != chosen.password_file.empty())
        throw cli::usage_error("--mqtt-user and --mqtt-password-file belong together");
    if (!chosen.user.empty() && chosen.ca_file.empty() && !cli::is_loopback(to.host))
        throw cli::usage_error("--mqtt-user",
                               "a password for another computer needs --mqtt-ca F.pem, which "
                               "encrypts the connection");
    if (chosen.topic.find_first_of("+#") != std::string::npos)
        throw cli::usage_error("--mqtt-topic", "a topic has neither + nor #");
}

}  // namespace

// Sets `chosen` when the program parses.
void add_options(cli::command &app, options &chosen) {
    app.add_option("--mqtt HOST:PORT", chosen.broker,
                   "Also publish state, values and events to this MQTT broker (port 1883, with "
                   "--mqtt-ca 8883)")
        .check([](const std::string &text) {
            return address_in(text) ? std::string() : "needs HOST or HOST:PORT, not " + text;
        });
    app.add_option("--mqtt-topic TOPIC", chosen.topic,
                   "Begin of all topics (else compbox/ and the name of this computer)");
    app.add_option("--mqtt-every S", chosen.every_s, "Interval of the values, s")
        .capture_default_str()
        .check(cli::between(0.2, 3600));
    app.add_option("--mqtt-buffer MB", chosen.buffer_mb,
                   "Keep at most this while the broker is away; the oldest values go first")
        .capture_default_str()
        .check(cli::whole_between(1, 1024));
    app.add_option("--mqtt-user NAME", chosen.user, "User of the broker");
    app.add_option(
        "--mqtt-password-file F", chosen.password_file,
        "Its first line is that user's password; no other user of this computer may read it");
    app.add_option("--mqtt-ca F.pem", chosen.ca_file,
                   "TLS: certificate of the authority that signed the broker's");
}

std::optional<settings> settings_of(const options &chosen) {
    if (chosen.broker.empty()) return std::nullopt;
    const address to = *address_in(chosen.broker);
    check_together(chosen, to);
    settings made;
    made.broker.host = to.host;
    made.broker.port = to.port.value_or(chosen.ca_file.empty() ? plain_port : tls_port);
    made.broker.user = chosen.user;
    if (!chosen.password_file.empty())
        made.broker.password = cli::read_password(chosen.password_file, 1);
    made.broker.ca_file = chosen.ca_file;
    made.topic = chosen.topic.empty() ? default_topic() : chosen.topic;
    made.values_every_s = chosen.every_s;
    made.buffer_bytes = std::size_t{chosen.buffer_mb} << 20;
    return made;
}

}  // namespace compbox::uplink
