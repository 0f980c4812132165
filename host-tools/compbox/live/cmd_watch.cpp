// SPDX-License-Identifier: MIT
// compbox watch: what the box does, on a terminal.
#include <cstdlib>
#include <memory>

#include "host-tools/compbox/live/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/watch/watch.h"

namespace compbox::live {

namespace {

constexpr const char *example = R"(Example:
  compbox watch --snapshot box.json --events events.jsonl
At the cabinet or over ssh no option is needed. Ctrl-C ends it.)";

struct watch_arguments {
    watch::watched_files files = {"/run/compboxd/snapshot.json", "/var/lib/compboxd/events.jsonl"};
    bool once = false;
};

void run_watch(const watch_arguments &arguments, const cli::streams &io) {
    if (!arguments.once && watch::can_draw()) {
        const char *without = std::getenv("NO_COLOR");  // https://no-color.org
        return watch::draw_until_signal(arguments.files, without == nullptr || *without == '\0',
                                        io);
    }
    const std::string why_not = watch::print_once(arguments.files, io);
    if (!why_not.empty()) throw input_error(why_not);
}

}  // namespace

void add_watch(cli::command &app) {
    const auto arguments = std::make_shared<watch_arguments>();
    cli::command watch = app.add_subcommand("watch", "What a running box does, on a terminal");
    watch.footer(example);
    watch
        .add_option("--snapshot F.json", arguments->files.snapshot,
                    "The file that compboxd --snapshot writes")
        .capture_default_str();
    watch
        .add_option("--events F.jsonl", arguments->files.events,
                    "The file that compboxd --events writes; it may be missing")
        .capture_default_str();
    watch.add_flag(
        "--once", arguments->once,
        "Print it once, without colours, as without a terminal; exit code 1: no box runs");
    watch.callback([arguments](const cli::streams &io) { run_watch(*arguments, io); });
}

}  // namespace compbox::live
