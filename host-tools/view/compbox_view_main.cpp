// SPDX-License-Identifier: MIT
// compbox-view: the box in a browser, and its figures for Prometheus.
#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <ostream>

#include "host-tools/command_line/command_line.h"
#include "host-tools/command_line/login.h"
#include "host-tools/uplink/options.h"
#include "host-tools/view/server.h"
#include "host-tools/view/site.h"

namespace compbox::view {
namespace {

constexpr std::int64_t poll_ms = 100, beat_ms = 10000;
constexpr std::size_t least_password = 8;

std::int64_t now_ms() {
    timespec now;
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1000 + now.tv_nsec / 1000000;
}

// out: a descriptor that is readable when SIGTERM or SIGINT arrived
int stop_descriptor() {
    sigset_t stops;
    ::sigemptyset(&stops);
    ::sigaddset(&stops, SIGTERM);
    ::sigaddset(&stops, SIGINT);
    ::sigprocmask(SIG_BLOCK, &stops, nullptr);
    ::signal(SIGPIPE, SIG_IGN);
    return ::signalfd(-1, &stops, SFD_CLOEXEC | SFD_NONBLOCK);
}

// Serves until SIGTERM or SIGINT. All work is on this thread, in short pieces.
// in : plant: null: none
void serve(site &from, server &to, uplink::uplink *plant, std::ostream &log) {
    pollfd set[2] = {{to.descriptor(), POLLIN, 0}, {stop_descriptor(), POLLIN, 0}};
    std::int64_t poll_due = now_ms(), beat_due = poll_due + beat_ms;
    while (set[1].revents == 0) {
        const std::int64_t left = std::clamp<std::int64_t>(poll_due - now_ms(), 0, poll_ms);
        ::poll(set, 2, to.timeout_ms(static_cast<int>(left)));
        to.run();
        const std::int64_t now = now_ms();
        if (now < poll_due) continue;
        poll_due = now + poll_ms;
        const bool beats = now >= beat_due;
        if (beats) {
            from.news().beat();
            beat_due = now + beat_ms;
        }
        if (from.poll(box_files::unix_now_s()) || beats) to.wake();
        if (plant == nullptr) continue;
        const double unix_s = box_files::unix_now_s();
        plant->take(from.box().value(), from.box().why_not(unix_s), unix_s,
                    1e-3 * static_cast<double>(now));
        const std::string news = plant->news(1e-3 * static_cast<double>(now));
        if (!news.empty()) log << "compbox-view: " << news << std::endl;
    }
    ::close(set[1].fd);
}

struct options {
    site_files files;
    uplink::options plant;
    std::string listen = "127.0.0.1:8090", password_file;
};

access_rule rule_of(const options &chosen, const listen_address &address) {
    if (!chosen.password_file.empty())
        return {address, cli::read_password(chosen.password_file, least_password)};
    if (address.is_loopback()) return {address, std::nullopt};
    throw cli::usage_error("--listen", "an address that others can reach needs --password-file F");
}

// Adds the options to app, which sets `chosen` when it parses.
void add_options(cli::command &app, options &chosen) {
    app.add_option("--snapshot F.json", chosen.files.snapshot,
                   "The file that compboxd writes with --snapshot")
        .required();
    app.add_option("--events F.jsonl", chosen.files.events, "That of compboxd --events");
    app.add_option("--record F.csv", chosen.files.record,
                   "That of compboxd --record, for the curves of the last days");
    app.add_option("--listen ADDRESS", chosen.listen,
                   "HOST:PORT (port 0: any free one). Another host than 127.0.0.1, [::1] or "
                   "localhost needs --password-file")
        .capture_default_str()
        .check([](const std::string &text) {
            return listen_address::parse(text) ? std::string()
                                               : "needs HOST:PORT with a numeric host, not " + text;
        });
    app.add_option("--password-file F", chosen.password_file,
                   "Its first line is the password of the user compbox; no other user may read it");
    uplink::add_options(app, chosen.plant);
    app.footer(
        "Example:\n"
        "  compboxd --config coefficients.json --snapshot box.json --events events.jsonl\n"
        "  compbox-view --snapshot box.json --events events.jsonl\n"
        "Then open http://127.0.0.1:8090/ in a browser of this computer.");
}

void run(const options &chosen, const cli::streams &io) {
    const auto address = *listen_address::parse(chosen.listen);
    site from(chosen.files, rule_of(chosen, address));
    server to(address, from);
    std::optional<uplink::uplink> plant;
    if (const auto settings = uplink::settings_of(chosen.plant)) plant.emplace(*settings);
    if (plant) {
        from.on_event = [&](const std::string &line) { plant->add_event(line); };
        from.plant = [&] { return plant->so_far(); };
    }
    io.out << "compbox-view: listening on " << to.url() << std::endl;
    serve(from, to, plant ? &*plant : nullptr, io.err);
}

}  // namespace
}  // namespace compbox::view

// out: 0 after a signal, 1 for bad input, 2 for wrong usage, 70 for a fault of the program
int main(int argc, char **argv) {
    const auto io = compbox::cli::standard_streams();
    compbox::cli::program app{"compbox-view: the box in a browser, and its figures for Prometheus",
                              io};
    app.set_version_flag("--version", "compbox-view " CB_VERSION);
    compbox::view::options chosen;
    compbox::view::add_options(app, chosen);
    return app.run(argc, argv, [&] { compbox::view::run(chosen, io); });
}
