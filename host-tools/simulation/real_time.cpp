// SPDX-License-Identifier: MIT
#include "host-tools/simulation/real_time.h"

#include "host-tools/simulation/remeasure.h"
#include "host-tools/simulation/table.h"

extern "C" {
#include "firmware/box/mode.h"
}

namespace compbox::simulation {

using namespace table;

namespace {

// Keys of compboxd's statistics that the report repeats.
constexpr const char *real_time_keys[] = {"cycles",      "overruns",    "period_us", "jitter_us",
                                          "interval_us", "exchange_us", "step_us",   "drift_us",
                                          "realtime",    "box",         "plc"};

std::string motion_table(const motion_figures &motion) {
    if (motion.duration_s == 0.0) return "";
    std::string text =
        fmt::format("\nin real time, {:.1f} s at {:.1f} m/min; true error while moving\n\n",
                    motion.duration_s, 1e-3 * motion.feed_mm_per_min);
    const std::string all = twin::axis_letters;
    return text + headings(all) + row("compboxd", all, [&](std::size_t a) {
               const double before = motion.before_um[a], after = motion.after_um[a];
               return fmt::format("{:6.1f}  {:6.2f} {}", before, after,
                                  percent(direction_figures::reduction(before, after)));
           });
}

// out: the number of a key of an untrusted statistics file, 0 for another type
double number_at(const json &object, const char *key) {
    const json value = object.is_object() ? object.value(key, json()) : json();
    return value.is_number() ? value.get<double>() : 0.0;
}

// out: the text of a key, "" for another type
std::string text_at(const json &object, const char *key) {
    const json value = object.is_object() ? object.value(key, json()) : json();
    return value.is_string() ? value.get<std::string>() : "";
}

// out: "p50 75, p99 118, max 4078": one statistic in µs
std::string spread(const json &statistics, const char *key) {
    const auto value = statistics.find(key);
    if (value == statistics.end() || !value->is_object()) return "not recorded";
    const auto part = [&](const char *name) { return number_at(*value, name); };
    return fmt::format("p50 {:7.1f}   p99 {:7.1f}   max {:7.1f}", part("p50"), part("p99"),
                       part("max"));
}

std::string statistics_table(const json &statistics) {
    if (!statistics.is_object()) return "";
    const auto number = [&](const char *key) { return number_at(statistics, key); };
    std::string text = fmt::format("\ncompboxd: {:.0f} cycles of {:.1f} ms, {:.0f} overrun{}\n\n",
                                   number("cycles"), 1e-3 * number("period_us"), number("overruns"),
                                   number("overruns") == 1 ? "" : "s");
    return text + fmt::format(
                      "  wake-up jitter, µs       {}\n  exchange with PLC, µs    {}\n"
                      "  one step of the box, µs  {}\n",
                      spread(statistics, "jitter_us"), spread(statistics, "exchange_us"),
                      spread(statistics, "step_us"));
}

// out: a line for each time compboxd left ACTIVE before its stop; such an interruption, not the
//      model, explains the error in motion
std::string interruptions(const json &statistics) {
    if (!statistics.is_object() || !statistics.contains("history")) return "";
    std::string text;
    bool was_active = false;
    for (const json &entry : statistics["history"]) {
        const std::string mode = text_at(entry, "mode"), reason = text_at(entry, "reason");
        if (reason == cb_reason_text(CB_REASON_STOP)) break;
        if (was_active && mode != "ACTIVE") {
            text += fmt::format("  at {:.1f} s {}: {}\n", number_at(entry, "time_s"), mode, reason);
        }
        was_active = was_active || mode == "ACTIVE";
    }
    if (text.empty()) return "";
    return "\n  compensation was interrupted, which the figures in motion show; is this machine "
           "busy?\n" +
           text;
}

}  // namespace

std::string real_time_text(const real_time_run &real) {
    return motion_table(real.motion) + interruptions(real.statistics) +
           statistics_table(real.statistics);
}

void add_real_time(json &report, const real_time_run &real) {
    for (const char *key : real_time_keys) {
        if (real.statistics.is_object() && real.statistics.contains(key)) {
            report[key] = real.statistics[key];
        }
    }
    if (real.motion.duration_s == 0.0) return;
    report["in_motion"] = {
        {"duration_s", rounded(real.motion.duration_s)},
        {"feed_mm_per_min", rounded(real.motion.feed_mm_per_min)},
        {"before_um",
         by_axis(twin::axis_letters, [&](auto a) { return real.motion.before_um[a]; })},
        {"after_um", by_axis(twin::axis_letters, [&](auto a) { return real.motion.after_um[a]; })}};
}

}  // namespace compbox::simulation
