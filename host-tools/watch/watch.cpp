// SPDX-License-Identifier: MIT
#include "host-tools/watch/watch.h"

#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string_view>
#include <vector>

#include "host-tools/box_files/event_log.h"
#include "host-tools/box_files/snapshot.h"
#include "host-tools/watch/lines.h"

namespace compbox::watch {

namespace {

constexpr std::size_t events_shown = 20;
constexpr timespec between_looks = {0, 200000000};
// Another screen than the shell's, without its cursor; and back.
constexpr const char *begin_drawing = "\033[?1049h\033[?25l", *end_drawing = "\033[?25h\033[?1049l";

volatile std::sig_atomic_t interrupted = 0;

void mind_signals() {
    struct sigaction action = {};
    action.sa_handler = [](int) { interrupted = 1; };
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
    ::sigaction(SIGHUP, &action, nullptr);
}

// The two files, as far as they were read.
class watched {
  public:
    explicit watched(const watched_files &files)
        : snapshot_(files.snapshot), events_(files.events) {}

    void poll() {
        snapshot_.poll();
        events_.poll([](const std::string &) {});
    }
    std::string why_not() const { return snapshot_.why_not(box_files::unix_now_s()); }
    std::vector<line> lines(const window &into) const {
        const json all = json::parse(events_.text(events_shown));
        return lines_of(snapshot_.value(), why_not(), {all.begin(), all.end()}, into);
    }

  private:
    box_files::snapshot_file snapshot_;
    box_files::event_log events_;
};

window size_of_terminal() {
    winsize size = {};
    if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col < 2 || size.ws_row < 2) {
        return {24, 80};
    }
    return {size.ws_row, size.ws_col};
}

// From the top, each line over the old one, so that nothing flickers.
std::string frame(const std::vector<line> &lines, bool coloured) {
    std::string text = "\033[H";
    for (std::size_t i = 0; i < lines.size(); ++i) {
        text += (i > 0 ? "\n" : "") + text_of(lines[i], coloured) + "\033[K";
    }
    return text + "\033[J";
}

}  // namespace

std::string print_once(const watched_files &files, const cli::streams &io) {
    constexpr std::size_t any = std::numeric_limits<std::size_t>::max();
    watched of(files);
    of.poll();
    for (const line &one : of.lines({any, any})) io.out << text_of(one, false) << "\n";
    return of.why_not();
}

void draw_until_signal(const watched_files &files, bool coloured, const cli::streams &io) {
    watched of(files);
    mind_signals();
    io.out << begin_drawing;
    while (interrupted == 0 && io.out) {
        of.poll();
        io.out << frame(of.lines(size_of_terminal()), coloured) << std::flush;
        ::nanosleep(&between_looks, nullptr);  // a signal ends it
    }
    io.out << end_drawing << std::flush;
}

bool can_draw() {
    const char *terminal = std::getenv("TERM");
    return ::isatty(STDOUT_FILENO) == 1 && terminal != nullptr &&
           std::string_view(terminal) != "dumb";
}

}  // namespace compbox::watch
