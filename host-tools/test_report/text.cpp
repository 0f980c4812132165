// SPDX-License-Identifier: MIT
// The figures as a table for a terminal.
#include <fmt/core.h>

#include "host-tools/formats/json.h"
#include "host-tools/test_report/figures.h"
#include "host-tools/test_report/uncertainty.h"

namespace compbox::test_report {

namespace {

std::string cell_of(const std::optional<double> &value) {
    return value ? fmt::format("{:12.3f}", *value) : fmt::format("{:>12}", "-");
}

// out: a row of the table: a figure of the first file, and of the second if there is one; "" for a
// direction that the first file does not have. uncertainties: of the last file
std::string row_of(const figure &one, const json &report, const by_figure &uncertainties) {
    const auto before = value_of(report["before"], one);
    if (!report["before"].contains(json::json_pointer(one.place).parent_pointer())) return "";
    std::string row = fmt::format("  {:34}{}", one.name, cell_of(before));
    if (report.contains("after")) {
        const auto after = value_of(report["after"], one);
        row += cell_of(after);
        if (before && after && *before != 0.0) {
            row += fmt::format("{:10.1f} %", 100.0 * (1.0 - *after / *before));
        } else if (!uncertainties.empty()) {
            row += fmt::format("{:12}", "");
        }
    }
    const auto U = uncertainties.find(one.key);
    if (U != uncertainties.end()) row += cell_of(U->second);
    return row + "\n";
}

// out: the contributions to U, one line; "" without a budget
std::string budget_line(const json &figures, const char *of) {
    const std::string text = budget_text(figures, of);
    return text.empty() ? "" : "  contributions to U: " + text + "\n";
}

std::string remarks_of(const json &figures) {
    std::string text;
    const std::string file = figures["file"].get<std::string>();
    if (figures.contains("environment")) {
        text += fmt::format("\n  {}: {}", file, figures["environment"].get<std::string>());
    }
    for (const json::json_pointer &place :
         {json::json_pointer("/positioning/remarks"), json::json_pointer("/warnings")}) {
        if (!figures.contains(place)) continue;
        for (const auto &remark : figures.at(place)) {
            text += fmt::format("\n  {}: {}", file, remark.get<std::string>());
        }
    }
    return text;
}

std::string verdicts_of(const json &report) {
    if (!report.contains("conformity")) return "";
    std::string text = "\n  conformity (ISO 14253-1 where the uncertainty is known)\n";
    for (const auto &one : report["conformity"]["figures"]) {
        const std::string uncertainty =
            one["uncertainty"].is_null() ? "-"
                                         : fmt::format("{:.3f}", one["uncertainty"].get<double>());
        text +=
            fmt::format("  {:34}{:12.3f}  limit {:.3f}, U {}: {}\n",
                        one["figure"].get<std::string>(), one["value"].get<double>(),
                        one["limit"].get<double>(), uncertainty, one["verdict"].get<std::string>());
    }
    return text;
}

}  // namespace

std::string text_of(const json &report) {
    const bool both = report.contains("after");
    const json &judged = report[both ? "after" : "before"];
    const by_figure uncertainties = uncertainties_in(judged);
    std::string text = fmt::format(
        "  {:34}{:>12}", report["before"]["unit"] == "um" ? "figures in um" : "figures in urad",
        both ? "before" : "");
    if (both) text += fmt::format("{:>12}{:>12}", "after", "less");
    if (!uncertainties.empty()) text += fmt::format("{:>12}", "U (k = 2)");
    text += "\n\n  positioning, ISO 230-2\n";
    for (const auto &one : positioning_figures) text += row_of(one, report, uncertainties);
    text += budget_line(judged, "positioning");
    text += "\n  straightness of the mean, ISO 230-1, about\n";
    for (const auto &one : straightness_figures) text += row_of(one, report, uncertainties);
    text += budget_line(judged, "straightness");
    text += verdicts_of(report) + remarks_of(report["before"]);
    if (both) text += remarks_of(report["after"]);
    return text + "\n";
}

}  // namespace compbox::test_report
