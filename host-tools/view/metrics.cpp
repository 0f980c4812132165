// SPDX-License-Identifier: MIT
#include "host-tools/view/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include "host-tools/formats/json.h"
#include "host-tools/view/status_words.h"

namespace compbox::view {

namespace {

using formats::member_or_null;
using labels = std::vector<std::pair<const char *, std::string>>;

// out: a number, or null
json json_of(const std::optional<int> &number) {
    return number ? json(*number) : json();
}

// The text, family by family.
class writer {
  public:
    explicit writer(metrics_format format) : format_(format) {}

    // Begins a family. in : type: gauge, counter, histogram or info
    void family(const std::string &name, std::string_view type, std::string_view help) {
        name_ = "compbox_" + name;
        suffix_ = type == "counter" ? "_total" : type == "info" ? "_info" : "";
        const bool is_older = format_ == metrics_format::prometheus;
        const std::string head = name_ + (is_older ? suffix_ : "");
        const std::string_view kind = is_older && type == "info" ? "gauge" : type;
        put("# TYPE {} {}\n# HELP {} {}\n", head, kind, head, help);
    }

    // in : value: what is no number is left out
    void sample(const json &value, const labels &with = {}, const char *part = "") {
        if (!value.is_number()) return;
        put("{}{}{}", name_, suffix_, part);
        const char *between = "{";
        for (const auto &[name, text] : with) {
            put("{}{}=\"{}\"", between, name, escaped_label(text));
            between = ",";
        }
        if (value.is_number_float()) {
            put("{} {}\n", with.empty() ? "" : "}", value.get<double>());
        } else {
            put("{} {}\n", with.empty() ? "" : "}", value.get<std::int64_t>());
        }
    }

    std::string text() {
        if (format_ == metrics_format::openmetrics) put("# EOF\n");
        return fmt::to_string(out_);
    }

  private:
    template <typename... Values>
    void put(fmt::format_string<Values...> form, Values &&...values) {
        fmt::format_to(std::back_inserter(out_), form, std::forward<Values>(values)...);
    }

    metrics_format format_;
    fmt::memory_buffer out_;
    std::string name_, suffix_;
};

std::string text_of(const json &value) {
    return value.is_string() ? value.get<std::string>() : value.is_null() ? "" : value.dump();
}

// out: value * factor, or null
json scaled(const json &value, double factor) {
    return value.is_number() ? json(value.get<double>() * factor) : json();
}

void put_state(writer &out, const json &snapshot) {
    out.family("mode", "gauge", "0 STANDBY, 1 ACTIVE, 2 HOLD, 3 RAMP, 4 FAULT, 5 STOPPED");
    out.sample(json_of(mode_number(snapshot.at("mode").get<std::string>())));
    out.family("reason", "gauge", "The number of the reason, as in the status register");
    out.sample(json_of(reason_number(snapshot.at("reason").get<std::string>())));
    out.family("file", "info", "The coefficient file that runs, and the version of compboxd");
    out.sample(1, {{"revision", text_of(member_or_null(snapshot, "revision"))},
                   {"crc", text_of(member_or_null(snapshot, "crc"))},
                   {"version", text_of(member_or_null(snapshot, "version"))},
                   {"machine", text_of(member_or_null(snapshot, "machine"))}});
}

// One gauge with one sample for each object of a list.
void put_list(writer &out, const json &list, const char *key, double factor = 1.0) {
    for (const auto &one : list) {
        const json value = member_or_null(one, key);
        out.sample(factor == 1.0 ? value : scaled(value, factor),
                   {{"name", text_of(member_or_null(one, "name"))}});
    }
}

// Signals, terms and channels.
void put_values(writer &out, const json &snapshot) {
    out.family("signal_value", "gauge", "The last accepted value");
    for (const auto &one : snapshot.at("signals")) {
        out.sample(member_or_null(one, "value"), {{"name", text_of(member_or_null(one, "name"))},
                                                  {"unit", text_of(member_or_null(one, "unit"))}});
    }
    out.family("signal_age_seconds", "gauge", "Age of the value in the last cycle");
    put_list(out, snapshot.at("signals"), "age_ms", 1e-3);
    out.family("term_value", "gauge", "The output of a term in um or urad");
    put_list(out, snapshot.at("terms"), "value");
    out.family("term_sigma_um", "gauge",
               "One standard deviation of it, by the term's own statement");
    put_list(out, snapshot.at("terms"), "sigma_um");
    for (const auto &[key, help] : {std::pair("demand_um", "The negative sum of its terms"),
                                    std::pair("output_um", "What the box writes"),
                                    std::pair("applied_um", "What the PLC reports as applied"),
                                    std::pair("limit_um", "The largest output")}) {
        out.family(std::string("channel_") + key, "gauge", help);
        put_list(out, snapshot.at("channels"), key);
    }
}

bool is_counter_name(const std::string &name) {
    return !name.empty() && name.size() <= 64 &&
           std::all_of(name.begin(), name.end(),
                       [](unsigned char c) { return std::islower(c) || c == '_'; });
}

void put_counters(writer &out, const json &snapshot) {
    const json counters = member_or_null(snapshot, "counters");
    if (!counters.is_object()) return;
    for (const auto &[name, value] : counters.items()) {
        if (!is_counter_name(name)) continue;
        out.family(name, "counter", "A counter of the box, see docs/faults.md");
        out.sample(value);
    }
}

// Writes the buckets of times, which the snapshot counts up to bounds in us.
void put_times(writer &out, const std::string &name, const char *help, const json &times) {
    const json up_to = member_or_null(times, "up_to");
    if (!up_to.is_object()) return;
    std::map<long, json> buckets;
    for (const auto &[bound, count] : up_to.items()) {
        const long bound_us = std::strtol(bound.c_str(), nullptr, 10);
        if (bound_us > 0) buckets[bound_us] = count;
    }
    out.family(name, "histogram", help);
    for (const auto &[bound_us, count] : buckets) {
        const std::string le = fmt::format("{}", static_cast<double>(bound_us) / 1e6);
        out.sample(count, {{"le", le}}, "_bucket");
    }
    out.sample(member_or_null(times, "count"), {{"le", "+Inf"}}, "_bucket");
    out.sample(member_or_null(times, "count"), {}, "_count");
    out.sample(scaled(member_or_null(times, "sum"), 1e-6), {}, "_sum");
}

void put_plant(writer &out, const uplink::figures &plant) {
    out.family("mqtt_connected", "gauge", "1: there is a connection to the MQTT broker");
    out.sample(plant.connected ? 1 : 0);
    out.family("mqtt_waiting_messages", "gauge", "Values and events that wait for the broker");
    out.sample(plant.waiting);
    out.family("mqtt_waiting_bytes", "gauge", "Their share of --mqtt-buffer");
    out.sample(plant.waiting_bytes);
    out.family("mqtt_connections", "counter", "Connections to the broker");
    out.sample(plant.connections);
    out.family("mqtt_messages", "counter", "Values and events that the broker has confirmed");
    out.sample(plant.delivered);
    out.family("mqtt_lost_messages", "counter", "Values and events that the full buffer dropped");
    out.sample(plant.lost);
}

}  // namespace

std::string escaped_label(std::string_view value) {
    std::string out;
    for (const char c : value) {
        if (c == '\n') {
            out += "\\n";
            continue;
        }
        if (c == '\\' || c == '"') out += '\\';
        out += c;
    }
    return out;
}

metrics_format metrics_format_of(const std::string &accept) {
    const bool takes_older = accept.find("text/plain") != std::string::npos;
    const bool takes_newer = accept.find("openmetrics") != std::string::npos;
    return takes_older && !takes_newer ? metrics_format::prometheus : metrics_format::openmetrics;
}

std::string metrics_type(metrics_format format) {
    return format == metrics_format::openmetrics
               ? "application/openmetrics-text; version=1.0.0; charset=utf-8"
               : "text/plain; version=0.0.4; charset=utf-8";
}

std::string metrics_text(const box_files::snapshot_file &file,
                         const std::optional<uplink::figures> &plant, double unix_s,
                         metrics_format format) {
    writer out(format);
    if (plant) put_plant(out, *plant);
    const bool is_up = file.why_not(unix_s).empty();
    out.family("up", "gauge", "1: compboxd runs and its snapshot is fresh");
    out.sample(is_up ? 1 : 0);
    if (!is_up) return out.text();
    const json &snapshot = file.value();
    put_state(out, snapshot);
    put_values(out, snapshot);
    put_counters(out, snapshot);
    put_times(out, "wakeup_seconds", "Lateness of the wake-ups, over the whole run",
              member_or_null(snapshot, "jitter_us"));
    put_times(out, "exchange_seconds", "Time of the exchange with the PLC, over the whole run",
              member_or_null(snapshot, "exchange_us"));
    return out.text();
}

}  // namespace compbox::view
