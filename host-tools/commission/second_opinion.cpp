// SPDX-License-Identifier: MIT
#include "host-tools/commission/second_opinion.h"

#include <fmt/ranges.h>

#include "host-tools/formats/error.h"
#include "host-tools/plc/libmodbus.h"

namespace compbox::commission {

namespace {

constexpr double comparing_s = 0.5;

// The box's readings of half a second.
struct readings {
    std::vector<std::uint16_t> last;
    std::vector<bool> changed;
};

// Cycles for comparing_s. out: the newest reading, and which registers changed; empty: none came
readings take_readings(live_box &live) {
    readings taken;
    const std::size_t count = live.config().plc.read.count;
    live.cycle_until(comparing_s, [&] {
        if (!live.read_ok()) return false;
        const std::uint16_t *now = live.registers();
        if (taken.last.empty()) {
            taken.last.assign(now, now + count);
            taken.changed.assign(count, false);
        }
        for (std::size_t i = 0; i < count; ++i) {
            taken.changed[i] = taken.changed[i] || taken.last[i] != now[i];
            taken.last[i] = now[i];
        }
        return false;
    });
    return taken;
}

}  // namespace

second_opinion ask_libmodbus(const cb_plc_config &plc) {
    second_opinion found;
    if (plc.transport != CB_TRANSPORT_TCP) return found;
    plc::wire to;
    to.host = plc.host;
    to.port = plc.port;
    to.unit = plc.unit;
    try {
        plc::client client(to);
        found.registers = client.read(plc::table::holding, plc.read.start, plc.read.count);
    } catch (const input_error &error) {
        found.fault = error.what();
    }
    return found;
}

json compare(const second_opinion &by_libmodbus, live_box &live) {
    if (by_libmodbus.registers.empty())
        return by_libmodbus.fault.empty() ? json() : json{{"fault", by_libmodbus.fault}};
    const readings own = take_readings(live);
    std::vector<int> differing;
    int compared = 0, changing = 0;
    for (std::size_t i = 0; i < own.last.size(); ++i) {
        ++(own.changed[i] ? changing : compared);
        if (!own.changed[i] && own.last[i] != by_libmodbus.registers[i])
            differing.push_back(live.config().plc.read.start + static_cast<int>(i));
    }
    return {{"compared", compared}, {"changing", changing}, {"differing", differing}};
}

std::string comparison_text(const json &comparison) {
    if (comparison.is_null() || comparison.contains("fault")) return "";
    const std::size_t differing = comparison["differing"].size();
    return fmt::format("   libmodbus read {} of {} registers that stay the same; {} change",
                       comparison["compared"].get<std::size_t>() - differing,
                       comparison["compared"].get<std::size_t>(),
                       comparison["changing"].get<int>());
}

std::string comparison_remark(const json &comparison) {
    if (comparison.is_null()) return "";
    if (comparison.contains("fault"))
        return "libmodbus gave no second opinion on the registers: " +
               comparison["fault"].get<std::string>();
    const auto differing = comparison["differing"].get<std::vector<int>>();
    if (differing.empty()) return "";
    return fmt::format(
        "libmodbus and the box read different values in register {}; the PLC changed them in "
        "between, or serves its clients different registers: repeat, and compare with compbox plc "
        "read",
        fmt::join(differing, ", "));
}

}  // namespace compbox::commission
