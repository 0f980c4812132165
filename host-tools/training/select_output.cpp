// SPDX-License-Identifier: MIT
// Output of the selection of inputs.
#include <fmt/format.h>

#include <algorithm>

#include "host-tools/formats/json.h"
#include "host-tools/formats/numbers.h"
#include "host-tools/training/select_inputs.h"

namespace compbox::training {

namespace {

bool is_chosen(const selection &result, std::size_t candidate) {
    return std::find(result.chosen.begin(), result.chosen.end(), candidate) != result.chosen.end();
}

const char *index_name(const selection &result) {
    if (result.options.method == cluster_method::c_means) return "Xie-Beni index";
    return result.options.count > 0 ? "similarity of the cut" : "F statistic";
}

// The choice, then what is kept.
std::vector<std::string> inputs_of_model(const selection &result) {
    std::vector<std::string> names;
    for (const std::size_t c : result.chosen) names.push_back(result.data.inputs[c]);
    names.insert(names.end(), result.options.keep.begin(), result.options.keep.end());
    return names;
}

json check_json(const selection &result, const checked_choice &checked) {
    json one;
    one["inputs"] = checked.inputs;
    one["mean_rms_percent_of_largest"] = formats::five_digits(100.0 * checked.merit);
    for (std::size_t k = 0; k < result.data.outputs.size(); ++k) {
        const auto at = static_cast<Eigen::Index>(k);
        one["left_out"][result.data.outputs[k]] = {
            {"rms", formats::five_digits(checked.left_out.rms[at])},
            {"worst", formats::five_digits(checked.left_out.worst[at])}};
    }
    return one;
}

// Candidates removed by a step: those of `from` that are not in `to`; many only by their number.
std::string left_away(const checked_choice &from, const checked_choice &to) {
    constexpr std::size_t most_names = 12;
    std::vector<std::string> names;
    for (const auto &name : from.inputs) {
        if (std::find(to.inputs.begin(), to.inputs.end(), name) != to.inputs.end()) continue;
        names.push_back(name);
    }
    if (names.size() > most_names) return fmt::format("{} of them", names.size());
    return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

// out: choice, clusters and grades by candidate, with five digits
json selection_json(const selection &result) {
    json all;
    for (std::size_t c : result.chosen) all["chosen"].push_back(result.data.inputs[c]);
    all["inputs"] = inputs_of_model(result);
    all["clusters"] = result.clusters.count;
    all["validity_index"] = index_name(result);
    all["validity"] = formats::five_digits(result.clusters.validity);
    for (std::size_t c = 0; c < result.candidates; ++c) {
        json one{{"name", result.data.inputs[c]},
                 {"cluster", result.clusters.cluster[c] + 1},
                 {"grade", formats::five_digits(result.grade[c])},
                 {"chosen", is_chosen(result, c)}};
        for (std::size_t k = 0; k < result.data.outputs.size(); ++k) {
            one["grades"][result.data.outputs[k]] = formats::five_digits(
                result.grades(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(k)));
        }
        all["candidates"].push_back(one);
    }
    if (!result.data.note.empty()) all["note"] = result.data.note;
    for (const auto &checked : result.checks) all["checks"].push_back(check_json(result, checked));
    return all;
}

std::vector<std::string> inputs_of_choice(const std::string &path) {
    return formats::get<std::vector<std::string>>(formats::read_json(path), "inputs", path);
}

std::string report_of(const selection &result) {
    std::string text = fmt::format(
        "{} candidates in {} clusters ({} {:.4g})\n\n"
        "cluster  candidate                grade",
        result.candidates, result.clusters.count, index_name(result), result.clusters.validity);
    for (const auto &output : result.data.outputs) text += "  " + output;
    text += "\n";
    for (std::size_t k = 0; k < result.clusters.count; ++k) {
        for (std::size_t c = 0; c < result.candidates; ++c) {
            if (result.clusters.cluster[c] != k) continue;
            text += fmt::format("{:5}    {:23.23}{:7.3f}", k + 1, result.data.inputs[c],
                                result.grade[c]);
            for (std::size_t o = 0; o < result.data.outputs.size(); ++o) {
                text += fmt::format(
                    " {:{}.3f}",
                    result.grades(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(o)),
                    result.data.outputs[o].size() + 1);
            }
            text += is_chosen(result, c) ? "  <- chosen\n" : "\n";
        }
    }
    if (!result.checks.empty()) {
        text +=
            "\nwhat a linear map leaves of runs left out (rms, mean over the outputs, in percent "
            "of the largest error)\n";
    }
    for (std::size_t i = 0; i < result.checks.size(); ++i) {
        text +=
            fmt::format("{:8.3f} %  {}\n", 100.0 * result.checks[i].merit,
                        i == 0 ? "all candidates"
                               : "without " + left_away(result.checks[i - 1], result.checks[i]));
    }
    text += fmt::format("\n--inputs {}\n", fmt::join(inputs_of_model(result), ","));
    for (const auto &one : result.data.glitches) text += fmt::format("note: glitch: {}\n", one);
    if (!result.data.note.empty()) text += fmt::format("note: {}\n", result.data.note);
    return text;
}

}  // namespace compbox::training
