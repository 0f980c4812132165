// SPDX-License-Identifier: MIT
#include "host-tools/test_report/page.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "host-tools/formats/json.h"
#include "host-tools/formats/template.h"
#include "host-tools/formats/text.h"
#include "host-tools/test_report/figures.h"
#include "host-tools/test_report/plot.h"
#include "host-tools/test_report/uncertainty.h"

namespace compbox::test_report {

namespace {

const char *const page_text =
#include "host-tools/test_report/page.html.in"
    ;

// Rows that fit beside the figures with one warning above them; rows as high as another warning.
constexpr std::size_t most_targets_beside = 26, rows_of_warning = 3;

std::string file_name(const fitting::measurement &data) {
    return std::filesystem::path(data.file).filename().string();
}

// in : any text. out: the same on one line, as HTML shows it between tags and in quotes
std::string escaped(const std::string &text) {
    std::string html;
    for (const char c : formats::printable(text)) {
        switch (c) {
            case '&':
                html += "&amp;";
                break;
            case '<':
                html += "&lt;";
                break;
            case '>':
                html += "&gt;";
                break;
            case '"':
                html += "&quot;";
                break;
            case '\'':
                html += "&#39;";
                break;
            default:
                html += c;
        }
    }
    return html;
}

// Escapes every text in a value.
void escape_all(json &value) {
    if (value.is_string()) value = escaped(value.get<std::string>());
    if (!value.is_structured()) return;
    for (auto &item : value) escape_all(item);
}

enum class quantity { positioning, straightness, angle };

quantity quantity_of(const particulars &about, const std::string &unit) {
    const std::string &name = about.name;
    if (unit == "urad") return quantity::angle;
    if (!name.empty() && name[1] <= 'C') return quantity::angle;
    return name.empty() || name[1] == name[2] ? quantity::positioning : quantity::straightness;
}

// "Positioning of axis X", "Straightness of axis X in Z".
std::string subject_of(const particulars &about, const std::string &unit) {
    const std::string of = about.axis.empty() ? "" : " of axis " + about.axis;
    const std::string along = about.name.empty() ? "" : std::string(1, about.name[1]);
    switch (quantity_of(about, unit)) {
        case quantity::positioning:
            return "Positioning" + of;
        case quantity::straightness:
            return "Straightness" + of + " in " + along;
        case quantity::angle:
            break;
    }
    return "Angular error" + of + (along.empty() ? "" : " about " + along);
}

std::string two_digits(const std::optional<double> &value) {
    if (!value) return "–";
    return (*value < 0.0 ? "−" : "") + fmt::format("{:.2f}", std::abs(*value));
}

std::string cell(const std::string &text) {
    return "<td>" + escaped(text) + "</td>";
}

std::string heads(const std::vector<std::string> &names) {
    std::string text;
    for (const auto &name : names) text += "<th>" + escaped(name) + "</th>";
    return text;
}

// The verdict of one figure, or null.
const json *judgement_of(const json &report, const std::string &key) {
    if (!report.contains("conformity")) return nullptr;
    for (const auto &one : report["conformity"]["figures"]) {
        if (one["figure"] == key) return &one;
    }
    return nullptr;
}

std::string capital(std::string text) {
    if (!text.empty()) text[0] = static_cast<char>(std::toupper(text[0]));
    return text;
}

// A row of the table of figures; empty if neither file has the figure.
json figure_row(const json &report, const figure &one, const by_figure &uncertainties) {
    const auto before = value_of(report["before"], one);
    const bool both = report.contains("after");
    const auto after = both ? value_of(report["after"], one) : std::optional<double>();
    if (!before && !after) return json();
    std::string cells = cell(two_digits(before));
    if (both) {
        cells += cell(two_digits(after));
        const bool ratio = before && after && *before != 0.0;
        cells += cell(ratio ? fmt::format("{:.0f} %", 100.0 * (1.0 - *after / *before)) : "–");
    }
    const auto u = uncertainties.find(one.key);
    if (!uncertainties.empty())
        cells += cell(u == uncertainties.end() ? "–" : two_digits(u->second));
    if (report.contains("conformity")) {
        const json *judged = judgement_of(report, one.key);
        cells += cell(judged ? two_digits((*judged)["limit"].get<double>()) : "");
        cells += cell(judged ? (*judged)["verdict"].get<std::string>() : "");
    }
    const bool iso_symbol = std::string(one.place).rfind("/positioning", 0) == 0;
    std::string name = iso_symbol ? one.symbol : capital(one.symbol);
    const std::string words = one.name;
    if (iso_symbol && words.size() > 2 && words.find("ward") == std::string::npos) {
        name += " · " + words.substr(0, words.size() - 2);
    }
    return json{{"name", escaped(name)}, {"cells", cells}};
}

// Positioning has the figures of ISO 230-2. Straightness has its own, and R and B.
std::vector<figure> figures_for(quantity kind) {
    if (kind != quantity::straightness) return positioning_figures;
    std::vector<figure> all = straightness_figures;
    for (const auto &one : positioning_figures) {
        const std::string key = one.key;
        if (key == "R" || key == "B" || key == "R+" || key == "R-") all.push_back(one);
    }
    return all;
}

// in : figures_of() of one file; both: the table names its file
// out: the table of targets
json table_of(const json &figures, const std::string &name, const std::string &unit, bool both) {
    const json &part = figures["positioning"];
    json table;
    std::vector<std::string> names;
    for (const char *side : {"forward", "backward"}) {
        const std::string arrow = *side == 'f' ? "↑" : "↓";
        if (part.contains(side)) names.insert(names.end(), {"x̄" + arrow, "s" + arrow});
    }
    if (part.contains("reversal")) names.push_back("B");
    table["heading"] = "Targets, " + unit + (both ? ", " + escaped(name) : "");
    table["heads"] = heads(names);
    std::string rows;
    for (std::size_t i = 0; i < part["targets_mm"].size(); ++i) {
        std::string cells = cell(fmt::format("{:g}", part["targets_mm"][i].get<double>()));
        for (const char *side : {"forward", "backward"}) {
            if (!part.contains(side)) continue;
            const json &s = part[side]["s"][i];
            cells += cell(two_digits(part[side]["mean"][i].get<double>()));
            cells += cell(two_digits(s.is_null() ? std::optional<double>() : s.get<double>()));
        }
        if (part.contains("reversal")) cells += cell(two_digits(part["reversal"][i].get<double>()));
        rows += (rows.empty() ? "<tr>" : "\n<tr>") + cells + "</tr>";
    }
    table["rows"] = rows;
    return table;
}

// Label and value of what is known, two pairs a row.
json about_rows(const particulars &about, const json &report,
                const std::vector<fitting::measurement> &files) {
    const json &part = report.contains("after") ? report["after"] : report["before"];
    const auto &targets = part["positioning"]["targets_mm"];
    std::string runs = std::to_string(part["positioning"]["runs_forward"].get<int>()) + " forward";
    runs += fmt::format(", {} backward", part["positioning"]["runs_backward"].get<int>());
    const std::vector<std::pair<std::string, std::string>> all = {
        {"Machine", about.machine},
        {"Serial number", about.serial},
        {"Axis", about.axis},
        {"Location", about.location},
        {"Instrument", about.instrument},
        {"Operator", about.by},
        {"Environment", about.environment},
        {"Remark", about.title},
        {files.size() > 1 ? "Data before" : "Data", file_name(files.front())},
        {"Targets", fmt::format("{} from {:g} to {:g} mm", targets.size(),
                                targets.front().get<double>(), targets.back().get<double>())},
        {files.size() > 1 ? "Data after" : "", files.size() > 1 ? file_name(files.back()) : ""},
        {"Runs", runs}};
    std::vector<std::pair<std::string, std::string>> known;
    for (const auto &one : all) {
        if (!one.second.empty()) known.push_back(one);
    }
    if (known.size() % 2 != 0) known.emplace_back();
    json rows = json::array();
    for (std::size_t i = 0; i < known.size(); i += 2) {
        rows.push_back({{"label", known[i].first},
                        {"value", known[i].second},
                        {"label2", known[i + 1].first},
                        {"value2", known[i + 1].second}});
    }
    return rows;
}

// out: one sentence on the uncertainty of a measurement, with its budget
std::string uncertainty_note(const json &figures, quantity kind) {
    if (!figures.contains("uncertainty")) return "The measurement uncertainty is not stated.";
    const bool across = kind == quantity::straightness;
    const std::string budget = budget_text(figures, across ? "straightness" : "positioning");
    if (budget.empty()) {
        return "U: expanded measurement uncertainty with k = 2, as stated by the operator.";
    }
    std::string text =
        "U: expanded measurement uncertainty with k = 2, by ISO/TR 230-9 from " + budget + ".";
    if (!figures["uncertainty"].contains("stated")) return text;
    text += " Stated by the operator: U of ";
    for (const auto &key : figures["uncertainty"]["stated"]) {
        text += (text.back() == ' ' ? "" : ", ") + key.get<std::string>();
    }
    return text + ".";
}

// out: the remarks on all files, with "before: ", "after: " or "both: " in front if there are two
std::vector<std::pair<std::string, std::string>> page_remarks(const json &report) {
    const json &before = report["before"]["positioning"]["remarks"];
    std::vector<std::pair<std::string, std::string>> all;
    if (!report.contains("after")) {
        for (const auto &remark : before) all.emplace_back("", remark.get<std::string>());
        return all;
    }
    const json &after = report["after"]["positioning"]["remarks"];
    const auto has = [](const json &list, const json &one) {
        return std::find(list.begin(), list.end(), one) != list.end();
    };
    for (const auto &remark : before) {
        all.emplace_back(has(after, remark) ? "both: " : "before: ", remark.get<std::string>());
    }
    for (const auto &remark : after) {
        if (!has(before, remark)) all.emplace_back("after: ", remark.get<std::string>());
    }
    return all;
}

// out: [{"text"}]: the standards, the uncertainty, and each file's remarks
json notes_of(const json &report, quantity kind) {
    json notes = json::array();
    const auto note = [&](const std::string &text) { notes.push_back({{"text", text}}); };
    if (kind == quantity::positioning) {
        note("A, R, E, M and B by ISO 230-2; s with n − 1; ↑ forward, ↓ backward. B = x̄↑ − x̄↓.");
    } else if (kind == quantity::angle) {
        note(
            "Angular deviations, evaluated as ISO 230-2 evaluates positions; s with n − 1; "
            "↑ forward, ↓ backward. B = x̄↑ − x̄↓.");
    } else {
        note(
            "Straightness deviation of the mean by ISO 230-1, about three reference lines; R and B "
            "as in ISO 230-2; s with n − 1; ↑ forward, ↓ backward. B = x̄↑ − x̄↓.");
    }
    note(uncertainty_note(report[report.contains("after") ? "after" : "before"], kind));
    for (const auto &[which, remark] : page_remarks(report)) note(capital(which + remark) + ".");
    return notes;
}

// The verdict on all figures, with those that decide it, and the rule.
void add_verdict(json &values, const json &report) {
    values["verdict"] = values["verdict_class"] = values["verdict_rule"] = "";
    if (!report.contains("conformity")) return;
    const json &found = report["conformity"];
    const std::string whole = found["verdict"].get<std::string>();
    bool known = true;
    std::string which;
    for (const auto &one : found["figures"]) {
        known = known && !one["uncertainty"].is_null();
        if (one["verdict"] != whole) continue;
        which += (which.empty() ? "" : ", ") + one["symbol"].get<std::string>();
    }
    const bool fails = whole == name_of(verdict::does_not);
    values["verdict_class"] = fails ? "fails" : whole;
    values["verdict"] = (fails                                  ? "Does not conform: "
                         : whole == name_of(verdict::undecided) ? "Conformity is not decided: "
                                                                : "Conforms to the limits of ") +
                        which + ".";
    values["verdict_rule"] =
        known ? "Decision rule of ISO 14253-1: conforms where the figure plus U is within the "
                "limit, does not where the figure less U is beyond it."
              : "Without U a figure is compared with its limit, which is no proof; with U, by the "
                "decision rule of ISO 14253-1.";
}

void add_headings(json &values, const particulars &about, const std::string &unit) {
    const std::string subject = subject_of(about, unit);
    values["at"] = "@";
    values["software"] = about.software;
    values["title"] = "Test report: " + subject + (about.name.empty() ? "" : ", " + about.name);
    values["document"] = heading_of(about, unit);
    values["subtitle"] = about.machine.empty() ? "Machine tool" : about.machine;
    values["number"] = about.number;
    values["date"] = about.date;
    values["signed"] = about.by.empty() ? "" : ": " + about.by;
    values["picture"] = "Deviation over position: " + subject;
}

// in : values with escaped texts. Adds the tables, whose cells are HTML.
void add_tables(json &values, const json &report, const particulars &about,
                const by_figure &uncertainties) {
    const bool both = report.contains("after");
    const std::string unit = report["before"]["unit"] == "um" ? "µm" : "µrad";
    const quantity kind = quantity_of(about, report["before"]["unit"].get<std::string>());
    std::vector<std::string> names = both ? std::vector<std::string>{"before", "after", "less"}
                                          : std::vector<std::string>{"value"};
    if (!uncertainties.empty()) names.push_back("U");
    if (report.contains("conformity")) names.insert(names.end(), {"limit", "verdict"});
    values["figure_heads"] = heads(names);
    values["figures_title"] = "Figures, " + unit;
    values["figures"] = json::array();
    for (const auto &one : figures_for(kind)) {
        const json row = figure_row(report, one, uncertainties);
        if (!row.is_null()) values["figures"].push_back(row);
    }
    const json &judged = both ? report["after"] : report["before"];
    const std::size_t warnings = values["warnings"].size();
    const std::size_t rows = judged["positioning"]["targets_mm"].size() +
                             rows_of_warning * (warnings > 1 ? warnings - 1 : 0);
    const bool fits = rows <= most_targets_beside;
    values["beside"] = values["more"] = json::array();
    if (fits) {
        values["beside"].push_back(table_of(judged, "after", unit, both));
        return;
    }
    for (const char *which : {"before", "after"}) {
        if (!report.contains(which)) continue;
        json table = table_of(report[which], which, unit, both);
        table["break"] = values["more"].empty() ? " more" : "";
        values["more"].push_back(table);
    }
}

}  // namespace

std::string iso_name(const std::string &text) {
    const auto is = [&](std::size_t i, const char *letters) {
        return std::string(letters).find(text[i]) != std::string::npos;
    };
    const bool fits = text.size() >= 3 && text[0] == 'E' && is(1, "XYZABC") && is(2, "XYZABCUVW");
    const bool ends = text.size() == 3 || !std::isalnum(static_cast<unsigned char>(text[3]));
    return fits && ends ? text.substr(0, 3) : "";
}

particulars completed(const particulars &stated, const std::vector<fitting::measurement> &files) {
    particulars about = stated;
    for (const auto &file : files) {
        const formats::laser_particulars &from = file.about;
        const std::pair<std::string &, const std::string &> fields[] = {
            {about.machine, from.machine}, {about.serial, from.serial},
            {about.date, from.date},       {about.by, from.by},
            {about.axis, from.axis},       {about.location, from.location},
            {about.title, from.title},     {about.instrument, from.instrument}};
        for (const auto &[into, text] : fields) {
            if (into.empty()) into = text;
        }
        if (about.environment.empty() && file.environment) {
            about.environment = formats::environment_text(*file.environment);
        }
        for (const auto &text : {from.title, file_name(file)}) {
            if (about.name.empty()) about.name = iso_name(text);
        }
    }
    if (about.axis.empty() && !about.name.empty()) about.axis = about.name.substr(2, 1);
    return about;
}

std::string heading_of(const particulars &about, const std::string &unit) {
    return (about.name.empty() ? "" : about.name + ": ") + subject_of(about, unit) +
           (about.machine.empty() ? "" : ", " + about.machine);
}

std::string page_of(const json &report, const std::vector<fitting::measurement> &files,
                    const particulars &about) {
    const std::string unit = report["before"]["unit"].get<std::string>();
    const json &judged = report[report.contains("after") ? "after" : "before"];
    const by_figure uncertainties = uncertainties_in(judged);
    json values;
    add_headings(values, about, unit);
    add_verdict(values, report);
    values["about"] = about_rows(about, report, files);
    values["notes"] = notes_of(report, quantity_of(about, unit));
    values["notes"].push_back({{"text", "Made by " + about.software + "."}});
    values["warnings"] = json::array();
    for (const char *which : {"before", "after"}) {
        if (!report.contains(which) || !report[which].contains("warnings")) continue;
        for (const auto &warning : report[which]["warnings"]) {
            values["warnings"].push_back(
                {{"text", capital(which) + ": " + warning.get<std::string>() + "."}});
        }
    }
    escape_all(values);
    add_tables(values, report, about, uncertainties);
    values["svg"] = report_svg(files);
    return formats::expanded(page_text, values);
}

}  // namespace compbox::test_report
