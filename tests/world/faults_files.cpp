// SPDX-License-Identifier: MIT
// Faults of the disk: coefficient files, state files, space, speed.
#include <fmt/core.h>

#include <cstring>

#include "tests/world/faults.h"
#include "tests/world/hostile_file.h"
#include "tests/world/run.h"
#include "tests/world/wrong_file.h"

namespace compbox::world {

namespace {

constexpr std::int64_t whole_disk_bytes = 64 << 20;

}  // namespace

void fault_injector::plan_files() {
    repeat(fault_kind::reload, 5 * second, [this] {
        dice &drawn = chance(fault_kind::reload);
        if (drawn.one_in(2)) put_another_file();
        put_unsigned_file();
        put_file_for_a_restart();
        if (drawn.one_in(4)) spoil_config_path();
        if (!drawn.one_in(2)) return;
        const std::uint64_t signals = 1 + drawn.below(drawn.one_in(3) ? 30 : 3);
        note(fault_kind::reload, fmt::format("{} SIGHUP", signals));
        const time_ns apart = drawn.time_between(0, 100 * ms);
        for (std::uint64_t i = 0; i < signals; ++i)
            later(static_cast<time_ns>(i) * apart, [this] { of_.box.send_signal(1); });
    });
    repeat(fault_kind::hostile, 2 * second, [this] { put_hostile_file(); });
    repeat(fault_kind::state, 10 * second,
           [this] { older_state_ = of_.box.files.text(run::state_path); });
}

// Another file takes the name of one that the daemon has opened.
void fault_injector::replace_what_is_read(const call_site &site) {
    if (!has(fault_kind::reload) || of_.signer || std::strcmp(site.name, "read") != 0 ||
        std::strcmp(site.path, run::config_path) != 0)
        return;
    dice own(of_.options.seed + static_cast<std::uint64_t>(of_.time.now()), "while it is read");
    if (!own.one_in(6)) return;
    const std::string text = another_file(of_.box_machine, own, of_.next_revision());
    note(fault_kind::reload, fmt::format("revision {} by rename, during a read", of_.revision));
    of_.box.files.replace(run::config_path, text);
    of_.note_file(text);
    of_.replaced_in_read_ns = of_.time.now();
}

void fault_injector::put_another_file() {
    dice &drawn = chance(fault_kind::reload);
    std::string text = another_file(of_.box_machine, drawn, of_.next_revision());
    dice own(of_.options.seed + of_.revision, "other units");
    if (of_.box_machine.pairs.empty() && of_.box_machine.profile.name != "fanuc" && own.one_in(6))
        text = with_other_units(text, own);
    file_tree &files = of_.box.files;
    of_.sign(text);
    switch (drawn.below(3)) {
        case 0:
            note(fault_kind::reload, fmt::format("revision {} by rename", of_.revision));
            files.replace(run::config_path, text);
            break;
        case 1:
            note(fault_kind::reload, fmt::format("revision {} in place", of_.revision));
            files.put(run::config_path, text);
            break;
        default: {
            note(fault_kind::reload, fmt::format("revision {} in two parts", of_.revision));
            files.put(run::config_path, text.substr(0, drawn.below(text.size())));
            later(drawn.time_between(1 * ms, 3 * second), [this, text] {
                if (active()) of_.box.files.put(run::config_path, text);
            });
        }
    }
    of_.note_file(text);
}

// A better file, but nobody vouches for it, or it is signed for another machine.
void fault_injector::put_unsigned_file() {
    dice own(of_.options.seed + of_.revision, "no signature");
    if (!of_.signer || !own.one_in(2)) return;
    std::string text = another_file(of_.box_machine, own, of_.next_revision());
    std::string words = "of another machine", signature;
    if (own.one_in(2)) spoil_key(own);
    if (!starts() && own.one_in(6)) {
        text.replace(text.find("\"world\""), 7, "\"other\"");
        signature = of_.signer->sign(text, own);
    } else {
        signature = of_.signer->no_signature(text, of_.good_file, own, words);
    }
    note(fault_kind::reload, fmt::format("revision {} {}", of_.revision, words));
    of_.wrong_revisions.insert(of_.revision);
    file_tree &files = of_.box.files;
    files.remove(run::signature_path);
    files.remove(run::new_signature_path);
    if (!signature.empty())
        files.replace(own.one_in(4) ? run::new_signature_path : run::signature_path, signature);
    files.replace(run::config_path, text);
}

// Connection, blocks and ticks are those of the daemon's start.
void fault_injector::put_file_for_a_restart() {
    dice own(of_.options.seed + of_.revision, "for a restart");
    // A daemon that could not start yet may well begin with it.
    if (starts() || of_.cycles_of_daemon == 0 || !own.one_in(4)) return;
    const std::string text =
        for_another_plc(another_file(of_.box_machine, own, of_.next_revision()), own);
    note(fault_kind::reload, fmt::format("revision {} needs a restart", of_.revision));
    of_.wrong_revisions.insert(of_.revision);
    of_.put_signed(text);
}

// A key that is no key, beside the good one or in its place: the folder vouches for nothing.
void fault_injector::spoil_key(dice &own) {
    const std::string folder = run::keys_path;
    const std::string path = folder + (own.one_in(2) ? "/factory.pub" : "/another.pub");
    const bool replaces = of_.box.files.has(path);
    if (starts()) return;
    of_.box.files.replace(path, "a word\n");
    later(own.time_between(1 * second, 8 * second), [this, path, replaces] {
        if (replaces)
            of_.box.files.replace(path, of_.signer->known_key());
        else
            of_.box.files.remove(path);
        of_.box.send_signal(1);  // only a file that changes is read by itself
    });
}

// Nothing says of what machine the file of a start has to be.
bool fault_injector::starts() const {
    return has(fault_kind::kill) || has(fault_kind::power_cut) || has(fault_kind::restart) ||
           has(fault_kind::memory) || has(fault_kind::state);
}

// For a while there is no regular file, or a link to one.
void fault_injector::spoil_config_path() {
    dice &drawn = chance(fault_kind::reload);
    file_tree &files = of_.box.files;
    const std::string path = run::config_path, before = of_.good_file;
    files.remove(path);
    of_.sign(before);
    const std::uint64_t way = drawn.below(6);
    static const char *const words[] = {
        "gone", "a folder", "a pipe", "a link to nothing", "a link to itself", "a link"};
    note(fault_kind::reload, std::string("the coefficient file is ") + words[way]);
    if (way == 1) files.make_folder(path);
    if (way == 2) files.make_fifo(path);
    if (way == 3) files.make_link(path, "/etc/compbox/none");
    if (way == 4) files.make_link(path, path);
    if (way == 5) {
        files.put("/etc/compbox/other.json", before);
        files.make_link(path, "/etc/compbox/other.json");
    }
    replace_later(drawn.time_between(1 * ms, 10 * second), before);
}

void fault_injector::put_hostile_file() {
    dice &drawn = chance(fault_kind::hostile);
    const std::string before = another_file(of_.box_machine, drawn, of_.next_revision());
    std::string text = hostile_file(before, drawn);
    dice own(of_.options.seed + of_.revision, "wrong file");
    const bool wrong = own.one_in(3);
    if (wrong) text = wrong_file(before, own);
    if (of_.knows_revision_of(text)) return;
    note(fault_kind::hostile, fmt::format("a {}file of {} bytes, from revision {}",
                                          wrong ? "wrong " : "", text.size(), of_.revision));
    if (wrong) of_.wrong_revisions.insert(of_.revision);
    of_.sign(text);
    if (drawn.one_in(2))
        of_.box.files.replace(run::config_path, text);
    else
        of_.box.files.put(run::config_path, text);
    if (!wrong) of_.note_file(text);
    if (drawn.one_in(3)) return;  // it stays
    const std::string good = another_file(of_.box_machine, drawn, of_.next_revision());
    of_.note_file(good);
    replace_later(drawn.time_between(100 * ms, 20 * second), good);
}

// Behind the last fault it would replace the newest file by an older one.
void fault_injector::replace_later(time_ns pause, const std::string &text) {
    later(pause, [this, text] {
        if (active()) of_.put_signed(text);
    });
}

// A link in the place of an output, or of the file that will take its name.
void fault_injector::plan_links() {
    repeat(fault_kind::links, 10 * second, [this] {
        dice &drawn = chance(fault_kind::links);
        static const std::vector<std::string> outputs = {run::state_path, run::stats_path,
                                                         run::snapshot_path, run::events_path};
        const std::string path = drawn.one_of(outputs) + (drawn.one_in(2) ? ".new" : "");
        note(fault_kind::links, "a link at " + path);
        file_tree &files = of_.box.files;
        files.remove(path);
        files.make_link(path, run::victim_path);
        later(drawn.time_between(100 * ms, 10 * second), [this, path] { remove_link(path); });
    });
}

void fault_injector::remove_link(const std::string &path) {
    const auto found = of_.box.files.find(path, false);
    if (found != nullptr && found->kind == node_kind::link) of_.box.files.remove(path);
}

// What the daemon finds where its state was.
void fault_injector::spoil_state() {
    dice &drawn = chance(fault_kind::state);
    file_tree &files = of_.box.files;
    const std::string path = run::state_path;
    std::string text = files.text(path);
    const std::uint64_t way = drawn.below(9);
    static const char *const words[] = {"has a flipped bit", "is cut off", "is longer",
                                        "is an older one",   "is gone",    "is empty",
                                        "is a folder",       "is a link",  "is a pipe"};
    note(fault_kind::state, std::string("the state file ") + words[way]);
    if (way == 0 && !text.empty()) {
        char &byte = text[drawn.below(text.size())];
        byte = static_cast<char>(byte ^ (1 << drawn.below(8)));
    }
    if (way == 1) text.resize(drawn.below(text.size() + 1));
    if (way == 2) text += std::string(1 + drawn.below(20000), 'x');
    if (way == 3) text = older_state_;
    if (way == 5) text.clear();
    files.remove(path);
    if (way == 4) return;
    if (way == 6) files.make_folder(path);
    if (way == 7) files.make_link(path, run::victim_path);
    if (way == 8) files.make_fifo(path);
    if (way < 6)
        files.put(path, text);
    else
        later(drawn.time_between(0, 5 * second), [this, path] { of_.box.files.remove(path); });
}

void fault_injector::starting() {
    if (has(fault_kind::state) && chance(fault_kind::state).one_in(2)) spoil_state();
    meddle_before_start();
    jump_before_start();
    of_.box.lacks_thread = false;
    const bool lacks = has(fault_kind::restart) && of_.starts() > 0 && threads_.one_in(6);
    refused_thread_ = lacks ? static_cast<int>(threads_.below(8)) : -1;
}

// in : how many bytes it still takes
void fault_injector::fill_disk(std::int64_t takes, time_ns lasts) {
    file_tree &files = of_.box.files;
    files.capacity_bytes = files.used_bytes() + takes;
    files.refuses_cuts = own_.one_in(2);  // what is torn then stays for a while
    later(lasts, [&files] {
        files.capacity_bytes = whole_disk_bytes;
        files.refuses_cuts = false;
    });
    note(fault_kind::disk, fmt::format("full for {} ms", lasts / ms));
}

// The last lines of a daemon may find no room.
void fault_injector::stopping() {
    if (!has(fault_kind::disk) || !stops_.one_in(3)) return;
    const auto takes = static_cast<std::int64_t>(stops_.log_between(100, 60e3));
    fill_disk(takes, static_cast<time_ns>(stops_.log_between(1e9, 20e9)));
}

void fault_injector::plan_disk() {
    repeat(fault_kind::disk, 10 * second, [this] {
        dice &drawn = chance(fault_kind::disk);
        file_tree &files = of_.box.files;
        const auto lasts = static_cast<time_ns>(drawn.log_between(10e6, 20e9));
        switch (drawn.below(4)) {
            case 0:
                fill_disk(drawn.time_between(0, 3000), lasts);
                break;
            case 1:
                files.read_only = true;
                later(lasts, [&files] { files.read_only = false; });
                note(fault_kind::disk, fmt::format("read-only for {} ms", lasts / ms));
                break;
            case 2:
                renames_fail_until_ = of_.time.now() + lasts;
                note(fault_kind::disk, fmt::format("renames fail for {} ms", lasts / ms));
                break;
            default: {
                // Now and then for longer than rows can wait.
                const auto longest =
                    static_cast<time_ns>(drawn.one_in(6) ? drawn.log_between(20e9, 300e9) : 0);
                files.hangs_until_ns =
                    std::max(files.hangs_until_ns, of_.time.now() + std::max(lasts, longest));
                note(fault_kind::disk,
                     fmt::format("hangs for {} ms", (files.hangs_until_ns - of_.time.now()) / ms));
            }
        }
    });
}

bool fault_injector::is_on_disk(const call_site &site) const {
    if (of_.time.now() >= of_.box.files.hangs_until_ns) return false;
    for (const char *folder : {"/etc/", "/var/", "/run/"}) {
        if (std::strncmp(site.path, folder, 5) == 0) return true;
    }
    return false;
}

// A good file again, newer than all others.
void fault_injector::heal_files() {
    file_tree &files = of_.box.files;
    files.capacity_bytes = whole_disk_bytes;
    files.read_only = files.refuses_cuts = false;
    files.hangs_until_ns = renames_fail_until_ = 0;
    const auto state = files.find(run::state_path, false);
    if (state != nullptr && state->kind != node_kind::regular) files.remove(run::state_path);
    if (of_.revision > 1) of_.put_signed(of_.good_file_of(of_.next_revision()));
}

}  // namespace compbox::world
