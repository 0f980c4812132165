// SPDX-License-Identifier: MIT
#include "host-tools/commission/write.h"

#include <cmath>
#include <cstdint>
#include <ctime>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

namespace compbox::commission {

namespace {

std::string now_text() {
    const std::time_t now = std::time(nullptr);
    std::tm utc = {};
    ::gmtime_r(&now, &utc);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
    return text;
}

double whole_tenths(double ms) {
    return std::round(ms * 10.0) / 10.0;
}

json times_of(const loop_times &times) {
    return {{"exchange_ms", json_of(times.exchange)},
            {"write_to_applied_ms", json_of(times.taken_over)},
            {"plc_update_ms", whole_tenths(times.update_ms)},
            {"handshake_round_ms", whole_tenths(times.round_ms)},
            {"lead_ms", whole_tenths(lead_of(times))},
            {"shortest_period_ms", shortest_period_ms(times)}};
}

}  // namespace

json earlier_figures(const json &document) {
    const json none = json::object();
    const json &provenance = document.contains("provenance") ? document["provenance"] : none;
    if (!provenance.is_object() || !provenance.contains("commissioning")) return none;
    return provenance["commissioning"].is_object() ? provenance["commissioning"] : none;
}

json figures_of(const json &document, const findings &result) {
    json figures = earlier_figures(document);
    figures["date"] = now_text();
    if (!figures["signs"].is_object()) figures["signs"] = json::object();
    for (const auto &[channel, found] : result.signs) {
        json &sign = figures["signs"][document["channels"][channel]["name"].get<std::string>()];
        sign = {{"offset_um", found.offset_um},
                {"measured_um", found.measured_um},
                {"sign", found.sign}};
        if (found.alone_um) sign["measured_alone_um"] = *found.alone_um;
    }
    figures["positions"] = result.positions;
    if (result.times) figures["times"] = times_of(*result.times);
    return figures;
}

json with_result(const json &document, const std::string &file, const findings &result) {
    json changed = document;
    if (!changed.contains("provenance")) changed["provenance"] = json::object();
    if (!changed["provenance"].is_object()) {
        throw input_error(file, 0, 0, "provenance: must be an object {…}, to take what was found");
    }
    for (const auto &[channel, found] : result.signs) {
        changed["channels"][channel]["sign"] = found.sign;
    }
    const json lead = changed["cycle"].value("lead_ms", json(0));
    if (result.times && !lead.is_string()) {
        changed["cycle"]["lead_ms"] = std::min(500.0, std::round(lead_of(*result.times)));
    }
    if (changed.contains("terms") && !changed["terms"].empty()) {
        const auto revision = changed["revision"].get<std::uint32_t>();
        if (revision == UINT32_MAX) {
            throw input_error(file, 0, 0, "revision: {} is the highest, so none is next", revision);
        }
        changed["revision"] = revision + 1;
    }
    changed["provenance"]["commissioning"] = figures_of(document, result);
    return changed;
}

}  // namespace compbox::commission
