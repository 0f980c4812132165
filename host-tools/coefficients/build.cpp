// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/build.h"

#include "host-tools/coefficients/compare.h"
#include "host-tools/coefficients/demand_plot.h"
#include "host-tools/coefficients/load.h"
#include "host-tools/coefficients/merge.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

extern "C" {
#include "firmware/config/config.h"
}

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
    if (load_coefficient_text(formats::json_text(merged.file), &message) != nullptr) return;
    refuse_entry(message.text, "terms", merged.term_homes, merged.file["terms"]);
}

// out: the file of a term, or `machine` where no term has this name
std::string home_of_term(const merged_file &merged, const std::string &term,
                         const std::string &machine) {
    for (std::size_t i = 0; i < merged.term_homes.size(); ++i) {
        if (!term.empty() && merged.file["terms"][i]["name"] == term)
            return merged.term_homes[i].file;
    }
    return machine;
}

// Throws input_error for the first refusal, or makes remarks of all where they are accepted.
void judge(const build_request &request, const merged_file &merged, comparison &found) {
    std::vector<std::string> accepted;
    for (const auto &refusal : found.refusals) {
        if (!request.accept_range) {
            const std::size_t more = found.refusals.size() - 1;
            throw input_error(home_of_term(merged, refusal.term, request.machine), 0, 0,
                              "{}{}; --accept-range builds the file nevertheless", refusal.sentence,
                              more == 0 ? "" : fmt::format(" ({} more like it)", more));
        }
        accepted.push_back("accepted by --accept-range: " + refusal.sentence);
    }
    found.remarks.insert(found.remarks.begin(), accepted.begin(), accepted.end());
}

// out: the configuration of the merged file. Throws input_error where the box would refuse it.
std::unique_ptr<cb_config> load_merged(merged_file &merged, const std::string &machine,
                                       const cb_target &target, std::string &text) {
    const merged_file as_given = merged;
    try {
        fill_in(merged, machine);
    } catch (const input_error &) {
        refuse_bad_terms(as_given);
        throw;
    }
    text = formats::json_text(merged.file);
    cb_message message = {};
    auto config = load_coefficient_text(text, &message, target);
    if (config != nullptr) return config;
    refuse_entries(merged, message.text);
    refuse_bad_terms(as_given);
    throw input_error(machine, 0, 0, message.text);
}

}  // namespace

built_file build_file(const build_request &request, std::ostream *out) {
    merged_file merged = merge_files(request.machine, request.terms, request.revision);
    formats::refuse_given(request.output, "what it writes");
    std::string text;
    const cb_target &target = request.for_stm32f405 ? stm32f405_target : any_target;
    const auto config = load_merged(merged, request.machine, target, text);
    comparison found = compare(*config, merged.file);
    judge(request, merged, found);
    built_file built;
    if (!request.plot.empty()) {
        built.files = plot_demand(*config, home_of(*config, merged.file), request.plot);
    }
    formats::write_file(request.output, text, out);
    built.files.insert(built.files.begin(), request.output);
    built.notes = std::move(merged.notes);
    built.notes.insert(built.notes.end(), found.lines.begin(), found.lines.end());
    built.notes.push_back(fmt::format("revision {}: {}{}", config->revision, summary(*config),
                                      found.refusals.empty() ? "" : ", range accepted"));
    if (request.for_stm32f405)
        built.notes.push_back(memory_text(target, memory_of(*config, text.size())));
    built.remarks = std::move(merged.remarks);
    built.remarks.insert(built.remarks.end(), found.remarks.begin(), found.remarks.end());
    built.channels = std::move(found.channels);
    built.curves = std::move(found.curves);
    return built;
}

}  // namespace compbox::coefficients
