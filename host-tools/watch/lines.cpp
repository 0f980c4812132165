// SPDX-License-Identifier: MIT
#include "host-tools/watch/lines.h"

#include <fmt/chrono.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "host-tools/command_line/screen.h"
#include "host-tools/formats/text.h"

namespace compbox::watch {

namespace {

constexpr double used_warning = 0.9;  // of a limit
constexpr std::size_t bar_width = 20, name_width = 14, value_width = 12, shares_each = 4;

// ---- members of a file that another program wrote: of any type, or missing

std::string word(const json &of, const char *key) {
    const auto found = of.find(key);
    if (found == of.end() || !found->is_string()) return "";
    return formats::printable(found->get<std::string>());
}

std::optional<double> number(const json &of, const char *key) {
    const auto found = of.find(key);
    if (found == of.end() || !found->is_number()) return std::nullopt;
    return found->get<double>();
}

bool truth(const json &of, const char *key) {
    const auto found = of.find(key);
    return found != of.end() && found->is_boolean() && found->get<bool>();
}

const json &list(const json &of, const char *key) {
    static const json none = json::array();
    const auto found = of.find(key);
    return found != of.end() && found->is_array() ? *found : none;
}

const json &object(const json &of, const char *key) {
    static const json none = json::object();
    const auto found = of.find(key);
    return found != of.end() && found->is_object() ? *found : none;
}

// ---- texts of a fixed width, so that nothing jumps

std::string cell(const std::string &text, std::size_t width) {
    return cli::padded(cli::clipped(text, width), width) + " ";
}

std::string right(const std::string &text, std::size_t width) {
    return fmt::format("{:>{}} ", text, width);
}

std::string micrometres(const std::optional<double> &um) {
    return um ? fmt::format("{:.2f}", *um) : "–";
}

std::string value_text(const std::optional<double> &value) {
    return value ? fmt::format("{:.6g}", *value) : "–";
}

std::string age_text(const std::optional<double> &age_ms) {
    if (!age_ms) return "–";
    if (*age_ms < 10e3) return fmt::format("{:.0f} ms", *age_ms);
    if (*age_ms < 600e3) return fmt::format("{:.0f} s", *age_ms * 1e-3);
    return fmt::format("{:.0f} min", *age_ms / 60e3);
}

std::string wall_clock(const std::optional<double> &unix_s) {
    constexpr double last_s = 253402300799.0;  // of the year 9999
    if (!unix_s || *unix_s < 0.0 || *unix_s > last_s) return "–";
    return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(static_cast<std::time_t>(*unix_s)));
}

line title(const std::string &text) {
    return {{text, tone::faint}};
}

// ---- the parts of the screen

tone tone_of_mode(const std::string &mode) {
    if (mode == "ACTIVE") return tone::good;
    if (mode == "FAULT") return tone::bad;
    return mode == "STANDBY" || mode == "STOPPED" ? tone::strong : tone::warning;
}

void add_head(std::vector<line> &to, const json &box) {
    to.push_back(
        {{word(box, "machine"), tone::strong},
         {fmt::format("   revision {} ({})   compboxd {}   PLC {}   {}",
                      value_text(number(box, "revision")), word(box, "crc"), word(box, "version"),
                      word(box, "plc"), wall_clock(number(box, "unix_s")))}});
    const std::string mode = word(box, "mode");
    to.push_back({{cell(mode, 8), tone_of_mode(mode)}, {word(box, "reason")}});
    const std::string cause = word(object(box, "cause"), "text");
    if (!cause.empty()) to.push_back({{cell("", 8)}, {cause, tone::warning}});
}

// out: the output within its limit: "[    |####      ]"
std::string bar(double output_um, double limit_um) {
    const double half = bar_width / 2;
    const double share = std::clamp(output_um / limit_um, -1.0, 1.0);
    const auto length = static_cast<std::size_t>(std::lround(std::abs(share) * half));
    const std::string marks(length, '#'), rest(static_cast<std::size_t>(half) - length, ' ');
    const std::string none(static_cast<std::size_t>(half), ' ');
    return share < 0 ? "[" + rest + marks + "|" + none + "]"
                     : "[" + none + "|" + marks + rest + "]";
}

// out: name, demand, output, applied and limit, the output as a bar, and what bounded it
line channel_line(const json &channel) {
    const auto demand = number(channel, "demand_um"), output = number(channel, "output_um");
    const auto limit = number(channel, "limit_um"), used = number(channel, "limit_used");
    line made = {{cell(word(channel, "name"), name_width)},
                 {right(micrometres(demand), value_width), tone::faint},
                 {right(micrometres(output), value_width), tone::strong},
                 {right(micrometres(number(channel, "applied_um")), value_width)},
                 {right(micrometres(limit), value_width), tone::faint}};
    if (output && limit && *limit > 0.0) {
        made.push_back({bar(*output, *limit) + " ",
                        used && *used > used_warning ? tone::warning : tone::plain});
    }
    if (truth(channel, "slewed")) made.push_back({"moves to its demand ", tone::faint});
    const auto limited = number(channel, "limited"), excessive = number(channel, "excessive");
    if (limited.value_or(0) > 0) {
        made.push_back({fmt::format("{} cycles limited ", *limited), tone::warning});
    }
    if (excessive.value_or(0) > 0) {
        made.push_back({fmt::format("{} beyond error_um", *excessive), tone::bad});
    }
    return made;
}

void add_channels(std::vector<line> &to, const json &box) {
    to.push_back(title(cell("channel", name_width) + right("demand µm", value_width) +
                       right("output", value_width) + right("applied", value_width) +
                       right("limit", value_width)));
    for (const json &channel : list(box, "channels")) to.push_back(channel_line(channel));
}

// A share of a channel's demand: an output of a term.
struct share {
    std::string name;
    std::optional<double> um;
    double size() const { return um ? std::abs(*um) : -1.0; }
};

// out: what the channel sums, the largest first
std::vector<share> shares_of(const json &channel, const json &box) {
    std::vector<share> shares;
    for (const json &name : list(channel, "terms")) {
        for (const json &term : list(box, "terms")) {
            if (name == term["name"]) shares.push_back({word(term, "name"), number(term, "value")});
        }
    }
    std::stable_sort(shares.begin(), shares.end(),
                     [](const share &a, const share &b) { return a.size() > b.size(); });
    return shares;
}

// "X  37.25 = -( X_thermal -57.50  X_geometry +20.25  )"
line share_line(const json &channel, const json &box) {
    const std::vector<share> shares = shares_of(channel, box);
    const std::size_t shown = std::min(shares.size(), shares_each);
    line made = {{cell(word(channel, "name"), name_width)},
                 {right(micrometres(number(channel, "demand_um")), value_width)},
                 {"= -( ", tone::faint}};
    for (std::size_t i = 0; i < shown; ++i) {
        const auto &um = shares[i].um;
        made.push_back({shares[i].name + (um ? fmt::format(" {:+.2f}  ", *um) : " –  ")});
    }
    if (shares.size() > shown) {
        made.push_back({fmt::format("and {} smaller ", shares.size() - shown), tone::faint});
    }
    made.push_back({")", tone::faint});
    return made;
}

void add_shares(std::vector<line> &to, const json &box) {
    to.push_back(title("why: a demand is the negative sum of its terms, µm"));
    for (const json &channel : list(box, "channels")) to.push_back(share_line(channel, box));
}

line signal_line(const json &signal) {
    const std::string state = word(signal, "state");
    line made = {
        {cell(word(signal, "name"), name_width)},
        {right(value_text(number(signal, "value")), value_width)},
        {cell(word(signal, "unit"), 6)},
        {right(age_text(number(signal, "age_ms")), 8), tone::faint},
        {cell(state, 8), state == "fresh" ? tone::faint : tone::warning},
    };
    const auto implausible = number(signal, "implausible"), stale = number(signal, "stale");
    if (implausible.value_or(0) > 0) {
        made.push_back({fmt::format("{} implausible ", *implausible), tone::warning});
    }
    if (stale.value_or(0) > 0) made.push_back({fmt::format("{} stale", *stale), tone::warning});
    return made;
}

void add_signals(std::vector<line> &to, const json &box) {
    to.push_back(title(cell("signal", name_width) + right("value", value_width) + cell("", 6) +
                       right("age", 8) + "state"));
    for (const json &signal : list(box, "signals")) to.push_back(signal_line(signal));
}

std::string times_text(const json &box, const char *key, const char *name) {
    const json &times = object(box, key);
    const auto text = [&](const char *of) {
        const auto us = number(times, of);
        return us ? fmt::format("{:.0f}", *us) : "–";
    };
    return fmt::format("{} µs: half {}, 99 % {}, longest {}", name, text("p50"), text("p99"),
                       text("max"));
}

// Times of the loop, and the counters that are not zero.
void add_counters(std::vector<line> &to, const json &box) {
    to.push_back({{times_text(box, "jitter_us", "wake-ups late") + "   " +
                       times_text(box, "exchange_us", "exchange"),
                   tone::faint}});
    const json &counters = object(box, "counters");
    std::string text = "cycles " + value_text(number(counters, "cycles"));
    for (const auto &[name, count] : counters.items()) {
        if (name == "cycles" || !count.is_number() || count == 0) continue;
        text += fmt::format("   {} {}", formats::printable(name), count.get<double>());
    }
    to.push_back({{text}});
}

void add_events(std::vector<line> &to, const std::vector<json> &events) {
    if (events.empty()) return;
    to.push_back(title("events, the newest first"));
    std::for_each(events.rbegin(), events.rend(), [&](const json &event) {
        to.push_back(
            {{wall_clock(number(event, "unix_s")) + "  ", tone::faint}, {word(event, "text")}});
    });
}

line clipped(const line &whole, std::size_t columns) {
    line made;
    std::size_t used = 0;
    for (const piece &one : whole) {
        made.push_back({cli::clipped(one.text, columns - used), one.in});
        used += cli::characters(made.back().text);
    }
    return made;
}

// out: the sequence of ECMA-48 that begins the tone; "": none is needed
const char *colour_of(tone in) {
    switch (in) {
        case tone::faint:
            return "\033[2m";
        case tone::strong:
            return "\033[1m";
        case tone::good:
            return "\033[1;32m";
        case tone::warning:
            return "\033[1;33m";
        case tone::bad:
            return "\033[1;31m";
        case tone::plain:
            break;
    }
    return "";
}

}  // namespace

std::vector<line> lines_of(const json &box, const std::string &why_not,
                           const std::vector<json> &events, const window &into) {
    std::vector<line> all;
    if (!why_not.empty()) all.push_back({{formats::printable(why_not), tone::bad}});
    if (!box.is_null()) {
        add_head(all, box);
        all.emplace_back();
        add_channels(all, box);
        all.emplace_back();
        add_shares(all, box);
        all.emplace_back();
        add_signals(all, box);
        all.emplace_back();
        add_counters(all, box);
        all.emplace_back();
    }
    add_events(all, events);
    while (!all.empty() && all.back().empty()) all.pop_back();
    if (all.size() > into.rows) {
        const std::size_t left = all.size() - into.rows + 1;
        all.resize(into.rows - 1);
        all.push_back(title(fmt::format("and {} more lines: enlarge the terminal", left)));
    }
    for (line &one : all) one = clipped(one, into.columns);
    return all;
}

std::string text_of(const line &pieces, bool coloured) {
    std::string text;
    for (const piece &one : pieces) {
        const std::string begin = coloured ? colour_of(one.in) : "";
        text += begin + one.text + (begin.empty() ? "" : "\033[0m");
    }
    while (!coloured && !text.empty() && text.back() == ' ') text.pop_back();
    return text;
}

}  // namespace compbox::watch
