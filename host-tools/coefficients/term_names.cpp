// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/term_names.h"

#include "host-tools/formats/json.h"

namespace compbox::coefficients {

namespace {

// Adds the key's text, or the texts of its list.
void add_texts(std::vector<std::string> &names, const json &term, const char *key) {
    const json value = term.value(key, json());
    if (value.is_string()) names.push_back(value);
    if (!value.is_array()) return;
    for (const auto &name : value) {
        if (name.is_string()) names.push_back(name);
    }
}

}  // namespace

std::vector<std::string> outputs_of(const json &term) {
    std::vector<std::string> names;
    if (!term.value("outputs", json()).is_array()) return {term["name"]};
    add_texts(names, term, "outputs");
    return names;
}

std::vector<std::string> signals_of(const json &term) {
    std::vector<std::string> names;
    for (const char *key : {"signal", "inputs", "tool_length"}) add_texts(names, term, key);
    if (term.value("bank", json()).is_object()) add_texts(names, term["bank"], "inputs");
    if (term.value("probe", json()).is_object()) {
        for (const char *key : {"value", "count"}) add_texts(names, term["probe"], key);
    }
    if (term.value("type", json()) != "volumetric") return names;
    add_texts(names, term, "positions");
    if (!term.contains("positions")) names.insert(names.end(), {"X", "Y", "Z"});
    return names;
}

std::set<std::string> consumed_outputs(const json &terms) {
    std::vector<std::string> names;
    for (const auto &term : terms) {
        add_texts(names, term, "term");
        add_texts(names, term, "errors");
        add_texts(names, term, "of");
    }
    return {names.begin(), names.end()};
}

}  // namespace compbox::coefficients
