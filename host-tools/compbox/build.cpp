// SPDX-License-Identifier: MIT
#include "host-tools/compbox/build.h"

#include "host-tools/compbox/load.h"
#include "host-tools/compbox/merge.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

namespace compbox {

namespace {

// Says in the words of the file that an entry came from what the loader says of the merged one:
// "terms[3].knots[7]: …" becomes "terms[0].knots[7]: … (EZX)". Returns where nothing fits.
void refuse_entry(const std::string &message, const std::string &key,
                  const std::vector<entry_home> &homes, const json &entries) {
    const std::string start = key + "[";
    if (message.compare(0, start.size(), start) != 0) return;
    const std::size_t index = std::stoul(message.substr(start.size()));
    if (index >= homes.size()) return;
    throw input_error(homes[index].file, 0, 0,
                      start + std::to_string(homes[index].index) +
                          message.substr(message.find(']')) + " (" +
                          entries[index]["name"].get<std::string>() + ")");
}

[[noreturn]] void refuse(const merged_file &merged, const std::string &machine,
                         const std::string &message) {
    refuse_entry(message, "terms", merged.term_homes, merged.file["terms"]);
    refuse_entry(message, "signals", merged.signal_homes, merged.file["signals"]);
    throw input_error(machine, 0, 0, message);
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
