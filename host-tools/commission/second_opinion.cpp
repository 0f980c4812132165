// SPDX-License-Identifier: MIT
#include "host-tools/commission/second_opinion.h"

#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

extern "C" {
#include "firmware/config/config.h"
}
#include "host-tools/formats/error.h"
#include "host-tools/plc/libmodbus.h"

namespace compbox::commission {

second_opinion::second_opinion(const cb_plc_config &plc) {
    if (plc.transport != CB_TRANSPORT_TCP) return;
    plc::wire to;
    to.host = plc.host;
    to.port = plc.port;
    to.unit = plc.unit;
    try {
        plc::client client(to);
        by_libmodbus_ = client.read(plc::table::holding, plc.read.start, plc.read.count);
    } catch (const input_error &error) {
        fault_ = error.what();
    }
}

void second_opinion::observe(live_box &live) {
    live.on_reading = [this](const plc_reading &reading) {
        if (own_.empty()) changed_.assign(reading.registers.size(), false);
        for (std::size_t i = 0; i < own_.size(); ++i) {
            changed_[i] = changed_[i] || own_[i] != reading.registers[i];
        }
        own_ = reading.registers;
    };
}

json second_opinion::compare(live_box &live) const {
    live.on_reading = nullptr;
    if (by_libmodbus_.empty()) return fault_.empty() ? json() : json{{"fault", fault_}};
    std::vector<int> differing;
    int compared = 0, changing = 0;
    for (std::size_t i = 0; i < own_.size(); ++i) {
        ++(changed_[i] ? changing : compared);
        if (!changed_[i] && own_[i] != by_libmodbus_[i])
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
