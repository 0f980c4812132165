// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/merge.h"

#include <algorithm>
#include <map>
#include <set>

#include "host-tools/coefficients/curve_range.h"
#include "host-tools/coefficients/machine_file.h"
#include "host-tools/coefficients/term_names.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

namespace compbox::coefficients {

namespace {

// Order of the keys of a coefficient file.
constexpr const char *key_order[] = {"format", "revision", "machine", "cycle",
                                     "plc",    "can",      "signals", "sensors",
                                     "terms",  "channels", "pairs",   "safety"};

[[noreturn]] void refuse(const std::string &file, const std::string &sentence) {
    throw input_error(file, 0, 0, sentence);
}

// holder[key] as an array of objects that have names; an empty array where the key is missing.
json named_array(const json &holder, const std::string &key, const std::string &file) {
    if (!holder.contains(key)) return json::array();
    const json &array = holder.at(key);
    if (!array.is_array()) refuse(file, key + " must be an array");
    for (std::size_t i = 0; i < array.size(); ++i) {
        const std::string place = fmt::format("{}[{}]", key, i);
        if (!array[i].is_object()) refuse(file, place + " must be an object");
        if (!array[i].contains("name") || !array[i]["name"].is_string()) {
            refuse(file, place + ": name is missing or not a text");
        }
    }
    return array;
}

// Signals and terms of several files, each name once.
class collection {
  public:
    // Adds the signals and terms of a file. Throws input_error for a name that exists already and
    // for an entry that is not an object with a name.
    void add(const json &from, const std::string &file) {
        const std::size_t first_term = terms_.size();
        const json signals = named_array(from, "signals", file);
        for (std::size_t i = 0; i < signals.size(); ++i) {
            if (is_shared_lag(signals[i], file)) continue;
            claim(signal_names_, signals[i]["name"], "signal", file);
            signal_homes_.push_back({file, i});
            signals_.push_back(signals[i]);
        }
        for (const auto &term : named_array(from, "terms", file)) {
            std::set<std::string> names{term["name"].get<std::string>()};
            for (const auto &name : outputs_of(term)) names.insert(name);
            for (const auto &name : names) claim(term_names_, name, "term", file);
            term_homes_.push_back({file, terms_.size() - first_term});
            terms_.push_back(term);
        }
    }

    void move_to(merged_file &merged) {
        merged.file["signals"] = std::move(signals_);
        merged.file["terms"] = std::move(terms_);
        merged.signal_homes = std::move(signal_homes_);
        merged.term_homes = std::move(term_homes_);
    }

  private:
    using files_by_name = std::map<std::string, std::string>;

    // Equal lags in two files are one signal, because two networks may use the same lags.
    bool is_shared_lag(const json &signal, const std::string &file) const {
        const auto taken = signal_names_.find(signal["name"].get<std::string>());
        return signal.contains("lag_of") && taken != signal_names_.end() && taken->second != file &&
               std::find(signals_.begin(), signals_.end(), signal) != signals_.end();
    }

    static void claim(files_by_name &taken, const std::string &name, const char *kind,
                      const std::string &file) {
        const auto [home, is_new] = taken.insert({name, file});
        if (is_new) return;
        refuse(file,
               fmt::format(
                   "the {} {} is already in {}; give one of them another name or leave one out",
                   kind, name, home->second == file ? "this file" : home->second));
    }

    json signals_ = json::array(), terms_ = json::array();
    std::vector<entry_home> signal_homes_, term_homes_;
    files_by_name signal_names_, term_names_;
};

bool is_null(const json &object, const char *key) {
    return object.contains(key) && object[key].is_null();
}

bool is_automatic(const json &channel) {
    if (!channel.contains("sum")) return true;
    const json &sum = channel["sum"];
    return sum.is_null() || (sum.is_array() && sum.empty()) || sum == "auto";
}

// out: whether the name is error_X_um or error_X_um_by_Y of a channel, as `compbox join` and
// `compbox train` write it
bool is_error_of(const std::string &channel, const std::string &output) {
    const std::string own = fmt::format("error_{}_um", channel);
    return output == own || output.compare(0, own.size() + 4, own + "_by_") == 0;
}

// ISO 230-1: E, direction of the error, moving axis. 0 for a name of another kind.
char direction_of(const std::string &output) {
    const bool iso = output.size() == 3 && output[0] == 'E' &&
                     std::string("XYZUVW").find(output[1]) != std::string::npos &&
                     std::string("XYZUVWABC").find(output[2]) != std::string::npos;
    return iso ? output[1] : '\0';
}

// out: the name by which an output acts in a channel: its own, or that of the adapted one
std::string acting_name(const json &term, const std::string &output) {
    const json of = term.value("type", json()) == "adapt" ? term.value("of", json()) : json();
    return of.is_string() ? of.get<std::string>() : output;
}

// out: direction of output k of a term: by its ISO name; X, Y, Z for a volumetric term
char direction_of(const json &term, std::size_t k, const std::string &name) {
    const bool volumetric = term.value("type", json()) == "volumetric" && k < 3;
    return volumetric ? "XYZ"[k] : direction_of(name);
}

// The term outputs that act in the direction a channel is named after; what another term works on
// acts through that one.
json outputs_in(const json &terms, const std::string &channel) {
    const auto consumed = consumed_outputs(terms);
    json sum = json::array();
    for (const auto &term : terms) {
        const auto names = outputs_of(term);
        for (std::size_t k = 0; k < names.size(); ++k) {
            const std::string name = acting_name(term, names[k]);
            const char direction = direction_of(term, k, name);
            const bool acts = is_error_of(channel, name) ||
                              (direction != '\0' && direction == linear_letter(channel));
            if (!acts) continue;
            if (consumed.count(names[k]) == 0) sum.push_back(names[k]);
        }
    }
    return sum;
}

std::string listed(const json &names, const char *separator) {
    std::string text;
    for (const auto &name : names)
        text += (text.empty() ? "" : separator) + name.get<std::string>();
    return text;
}

// A slope over an axis whose signal was left out, because no curve is over it, is always 0.
void drop_tangent(json &channel, const std::set<std::string> &left_out, merged_file &merged) {
    const json signal = channel.value("tangent", json::object()).value("signal", json());
    if (!signal.is_string() || left_out.count(signal.get<std::string>()) == 0) return;
    channel.erase("tangent");
    merged.notes.push_back(
        fmt::format("channel {}: no term works on signal {}; its tangent left out",
                    channel["name"].get<std::string>(), signal.get<std::string>()));
}

// in : names of the channels that were left out. out: without the pairs of only such channels
void drop_pairs(merged_file &merged, const std::set<std::string> &left_out) {
    if (!merged.file.contains("pairs") || !merged.file["pairs"].is_array()) return;
    json kept = json::array();
    for (auto &pair : merged.file["pairs"]) {
        const json names = pair.is_object() ? pair.value("channels", json()) : json();
        const bool gone =
            names.is_array() && !names.empty() &&
            std::all_of(names.begin(), names.end(), [&](const json &name) {
                return name.is_string() && left_out.count(name.get<std::string>()) > 0;
            });
        if (!gone) kept.push_back(std::move(pair));
    }
    merged.file["pairs"] = std::move(kept);
}

// Fills in the sum of each channel that leaves it to the tool, and drops channels without a term,
// their pairs, and tangents over no_signals, the signals that were left out. Throws input_error
// where no channel is left.
void fill_sums(merged_file &merged, const std::string &machine_path,
               const std::set<std::string> &no_signals) {
    std::set<std::string> no_channels;
    json kept = json::array();
    for (json channel : named_array(merged.file, "channels", machine_path)) {
        const std::string name = channel["name"];
        if (is_automatic(channel)) {
            channel["sum"] = outputs_in(merged.file["terms"], name);
            if (channel["sum"].empty()) {
                merged.notes.push_back(
                    fmt::format("channel {}: no term acts in {}; left out", name, name));
                no_channels.insert(name);
                continue;
            }
            merged.notes.push_back(
                fmt::format("channel {} = -({})", name, listed(channel["sum"], " + ")));
        }
        drop_tangent(channel, no_signals, merged);
        kept.push_back(std::move(channel));
    }
    drop_pairs(merged, no_channels);
    if (kept.empty() && !named_array(merged.file, "channels", machine_path).empty()) {
        refuse(machine_path,
               "no term acts in any channel; write the channels' sums, or name the terms as ISO "
               "230-1 does (EZX: towards Z, by X)");
    }
    merged.file["channels"] = std::move(kept);
}

// Adds a remark for each output of a term that no channel sums and no term uses.
void remark_unused(merged_file &merged) {
    std::set<std::string> used = consumed_outputs(merged.file["terms"]);
    for (const auto &channel : merged.file["channels"]) {
        if (!channel["sum"].is_array()) continue;
        for (const auto &name : channel["sum"]) {
            if (name.is_string()) used.insert(name);
        }
    }
    for (const auto &term : merged.file["terms"]) {
        for (const auto &name : outputs_of(term)) {
            if (used.count(name) == 0)
                merged.remarks.push_back(fmt::format(
                    "term {}: no channel sums it, so the box does not correct it; write "
                    "it into sum of its channel in the machine file, or leave it out",
                    name));
        }
    }
}

bool mentions(const json &value, const std::string &name) {
    if (value.is_string()) return value == name;
    return value.is_structured() && std::any_of(value.begin(), value.end(), [&](const json &item) {
               return mentions(item, name);
           });
}

// Whether a term or another signal names it, or a term takes it without naming it.
bool is_used(const json &file, const std::string &signal) {
    for (const char *key : {"terms", "signals"}) {
        for (const auto &user : file[key]) {
            for (const auto &[name, value] : user.items()) {
                if (name != "name" && mentions(value, signal)) return true;
            }
        }
    }
    return std::any_of(file["terms"].begin(), file["terms"].end(), [&](const json &term) {
        const auto names = signals_of(term);
        return std::find(names.begin(), names.end(), signal) != names.end();
    });
}

// Throws input_error for a signal that a term needs and no file has. Call it before signals are
// dropped or filled in.
void check_signals(const merged_file &merged, const std::string &machine_path) {
    std::set<std::string> known;
    for (const auto &signal : merged.file["signals"])
        known.insert(signal["name"].get<std::string>());
    for (std::size_t i = 0; i < merged.term_homes.size(); ++i) {
        const json &term = merged.file["terms"][i];
        for (const auto &name : signals_of(term)) {
            if (known.count(name) > 0) continue;
            refuse(merged.term_homes[i].file,
                   fmt::format("the term {} works on the signal {}, which no file has; add it to "
                               "the signals of {}, or make the term on one that is there ({})",
                               term["name"].get<std::string>(), name, machine_path,
                               listed(json(known), ", ")));
        }
    }
}

// out: min and max of a signal from the curves over it; throws input_error without a curve
void take_range(json &signal, const merged_file &merged, const std::string &file) {
    const auto range = range_of_curves(merged.file["terms"], signal["name"].get<std::string>());
    const std::string name = signal["name"];
    if (!range) {
        refuse(file, fmt::format("signal {}: set min and max (no curve gives its range)", name));
    }
    const travel_range plausible = plausible_around(*range);
    if (is_null(signal, "min")) signal["min"] = plausible.from_mm;
    if (is_null(signal, "max")) signal["max"] = plausible.to_mm;
}

std::string json_number(const json &value) {
    return value.is_number() ? fmt::format("{}", value.get<double>()) : value.dump();
}

// Fills in min and max, in the signal's unit, from the curves that use it, and drops signals that
// no term uses; out: their names. Throws input_error where no curve gives a range.
std::set<std::string> fill_ranges(merged_file &merged) {
    std::set<std::string> left_out;
    json kept = json::array();
    std::vector<entry_home> homes;
    const json signals = merged.file["signals"];
    for (std::size_t i = 0; i < signals.size(); ++i) {
        json signal = signals[i];
        const std::string name = signal["name"];
        if (is_null(signal, "min") || is_null(signal, "max")) {
            if (!is_used(merged.file, name)) {
                merged.notes.push_back(fmt::format("signal {}: used by no term; left out", name));
                left_out.insert(name);
                continue;
            }
            take_range(signal, merged, merged.signal_homes[i].file);
            merged.notes.push_back(fmt::format("signal {}: plausible from {} to {}", name,
                                               json_number(signal["min"]),
                                               json_number(signal["max"])));
        }
        kept.push_back(std::move(signal));
        homes.push_back(merged.signal_homes[i]);
    }
    merged.file["signals"] = std::move(kept);
    merged.signal_homes = std::move(homes);
    return left_out;
}

void add_provenance(json &all, const json &fragment, const std::string &file) {
    if (!fragment.contains("provenance")) return;
    const json &own = fragment["provenance"];
    if (!own.is_object()) refuse(file, "provenance must be an object");
    for (const auto &[key, value] : own.items()) {
        if (all.contains(key) && all[key] != value) {
            refuse(file, fmt::format("provenance.{} differs from another file's", key));
        }
        all[key] = value;
    }
}

// Sensors check each other in one section.
void add_sensors(json &all, const json &section, const std::string &file) {
    if (all.contains("sensors")) refuse(file, "has sensors, and so has another file");
    all["sensors"] = section;
}

// The same object with its keys in the usual order; unknown keys stay, for the loader to refuse.
json in_order(const json &file) {
    json result = json::object();
    for (const char *key : key_order) {
        if (file.contains(key)) result[key] = file[key];
    }
    for (const auto &[key, value] : file.items()) result[key] = value;
    return result;
}

json read_object(const std::string &path) {
    json value = formats::read_json(path);
    if (!value.is_object()) refuse(path, "must be a JSON object");
    return value;
}

}  // namespace

merged_file merge_files(const std::string &machine_path, const std::vector<std::string> &fragments,
                        std::optional<unsigned> revision) {
    merged_file merged;
    merged.file = read_object(machine_path);
    if (!merged.file.contains("format")) {
        refuse(machine_path, "is not a machine file (format is missing; see compbox init)");
    }
    collection entries;
    entries.add(merged.file, machine_path);
    json provenance = json::object();
    add_provenance(provenance, merged.file, machine_path);
    for (const auto &path : fragments) {
        if (std::count(fragments.begin(), fragments.end(), path) > 1) {
            refuse(path, "is given more than once");
        }
        const json fragment = read_object(path);
        formats::only_keys(fragment, {"signals", "sensors", "terms", "provenance"}, path,
                           "a term file");
        if (fragment.contains("sensors"))
            add_sensors(merged.file, fragment["sensors"], path);
        else if (!fragment.contains("terms"))
            refuse(path, "has no terms");
        entries.add(fragment, path);
        add_provenance(provenance, fragment, path);
    }
    entries.move_to(merged);
    merged.file["provenance"] = std::move(provenance);
    if (revision) merged.file["revision"] = *revision;
    check_signals(merged, machine_path);
    return merged;
}

void fill_in(merged_file &merged, const std::string &machine_path) {
    const auto left_out = fill_ranges(merged);
    fill_sums(merged, machine_path, left_out);
    remark_unused(merged);
    merged.file = in_order(merged.file);
}

}  // namespace compbox::coefficients
