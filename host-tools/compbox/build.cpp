// SPDX-License-Identifier: MIT
#include "host-tools/compbox/build.h"

#include "host-tools/compbox/load.h"
#include "host-tools/compbox/merge.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

namespace compbox {

namespace {

struct entry_home {
    std::string file;  // that the entry came from; "" where the message is about none
    std::string name;  // "terms[3] is EZX"
};

// "terms[3].knots" belongs to the file that term 3 came from.
entry_home home_of(const std::string &message, const char *key,
                   const std::vector<std::string> &files, const json &entries) {
    const std::string start = std::string(key) + "[";
    if (message.compare(0, start.size(), start) != 0) return {};
    const std::size_t index = std::stoul(message.substr(start.size()));
    if (index >= files.size()) return {};
    return {files[index],
            start + std::to_string(index) + "] is " + entries[index]["name"].get<std::string>()};
}

[[noreturn]] void refuse(const merged_file &merged, const std::string &machine,
                         const std::string &message) {
    entry_home home = home_of(message, "terms", merged.term_files, merged.file["terms"]);
    if (home.file.empty()) {
        home = home_of(message, "signals", merged.signal_files, merged.file["signals"]);
    }
    if (home.file.empty()) throw input_error(machine, 0, 0, message);
    throw input_error(home.file, 0, 0, message + " (" + home.name + ")");
}

}  // namespace

std::vector<std::string> build_file(const std::string &machine,
                                    const std::vector<std::string> &terms,
                                    std::optional<unsigned> revision, const std::string &output) {
    merged_file merged = merge_files(machine, terms, revision);
    const std::string text = json_text(merged.file);
    cb_message message = {};
    const auto config = load_coefficient_text(text, &message);
    if (config == nullptr) refuse(merged, machine, message.text);
    write_file(output, text);
    merged.notes.push_back("revision " + std::to_string(config->revision) + ": " +
                           summary(*config));
    return merged.notes;
}

}  // namespace compbox
