// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/build.h"

#include "host-tools/coefficients/load.h"
#include "host-tools/coefficients/merge.h"
#include "host-tools/coefficients/pair_remarks.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

namespace compbox::coefficients {

namespace {

// Throws the loader's error about the merged file with the place in the source file:
// "terms[3].knots[7]: …" becomes "terms[0].knots[7]: … (EZX)". Returns if no entry matches.
void refuse_entry(const std::string &message, const std::string &key,
                  const std::vector<entry_home> &homes, const json &entries) {
    const std::string start = key + "[";
    if (message.compare(0, start.size(), start) != 0) return;
    const std::size_t index = std::stoul(message.substr(start.size()));
    if (index >= homes.size()) return;
    throw input_error(homes[index].file, 0, 0, "{}{}{} ({})", start, homes[index].index,
                      message.substr(message.find(']')), entries[index]["name"].get<std::string>());
}

void refuse_entries(const merged_file &merged, const std::string &message) {
    refuse_entry(message, "terms", merged.term_homes, merged.file["terms"]);
    refuse_entry(message, "signals", merged.signal_homes, merged.file["signals"]);
}

// Throws input_error for an invalid term. It runs before ranges are filled in, because an invalid
// term can hide its range; the loader gets any range.
void refuse_bad_terms(merged_file merged) {
    for (auto &signal : merged.file["signals"]) {
        for (const auto &[key, value] : {std::pair("min", 0), std::pair("max", 1)}) {
            if (signal.contains(key) && signal[key].is_null()) signal[key] = value;
        }
    }
    cb_message message = {};
    if (load_coefficient_text(json_text(merged.file), &message) != nullptr) return;
    refuse_entry(message.text, "terms", merged.term_homes, merged.file["terms"]);
}

}  // namespace

std::vector<std::string> build_file(const std::string &machine,
                                    const std::vector<std::string> &terms,
                                    std::optional<unsigned> revision, const std::string &output,
                                    std::ostream *out) {
    const merged_file as_given = merge_files(machine, terms, revision);
    merged_file merged = as_given;
    try {
        fill_in(merged, machine);
    } catch (const input_error &) {
        refuse_bad_terms(as_given);
        throw;
    }
    const std::string text = json_text(merged.file);
    cb_message message = {};
    const auto config = load_coefficient_text(text, &message);
    if (config == nullptr) {
        refuse_entries(merged, message.text);
        refuse_bad_terms(as_given);
        throw input_error(machine, 0, 0, message.text);
    }
    // The output may replace a coefficient file, but not a term.
    if (output == machine)
        update_file(output, text, out);
    else
        write_file(output, text, out);
    for (const auto &remark : pair_remarks(*config)) merged.notes.push_back(remark);
    merged.notes.push_back(fmt::format("revision {}: {}", config->revision, summary(*config)));
    return merged.notes;
}

}  // namespace compbox::coefficients
