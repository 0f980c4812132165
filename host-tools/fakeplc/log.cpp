// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/log.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

namespace compbox::fakeplc {

namespace {

// Rounded to 0.1 nm.
std::string rounded(double value) {
    return fmt::format("{}", std::round(value * 1e4) / 1e4 + 0.0);
}

void append(std::string &row, const twin::xyz &values) {
    for (const double value : values) row += "," + rounded(value);
}

void append_names(std::string &row, const std::string &before, const std::string &after) {
    for (const char axis : {'X', 'Y', 'Z'}) row += fmt::format(",{}{}{}", before, axis, after);
}

}  // namespace

plc_log::plc_log(const std::string &path, const register_map &map)
    : file_(std::fopen(path.c_str(), "we")) {
    if (!file_) {
        throw input_error(path, 0, 0, "cannot create the log ({})", std::strerror(errno));
    }
    std::string header = "time_s";
    append_names(header, "", "_mm");
    for (const auto &channel : map.channels)
        header += fmt::format(",commanded_{}_um", channel.name);
    for (const auto &channel : map.channels) header += fmt::format(",applied_{}_um", channel.name);
    for (const auto &channel : map.channels) {
        header += fmt::format(",nc_{}_um,nc_{}_slope,nc_{}_reference_mm", channel.name,
                              channel.name, channel.name);
    }
    append_names(header, "displacement_", "_um");
    append_names(header, "error_before_", "_um");
    append_names(header, "error_after_", "_um");
    header += ",control,status,plc_heartbeat,box_heartbeat,handshake,alarms,event\n";
    good_ = std::fputs(header.c_str(), file_.get()) >= 0;
}

void plc_log::add(const plc_state &state) {
    std::string row = rounded(state.time_s);
    append(row, state.position_mm);
    for (const double um : state.commanded_um) row += "," + rounded(um);
    for (const double um : state.applied_um) row += "," + rounded(um);
    for (const auto &held : state.held) {
        row += fmt::format(",{},{},{}", rounded(held.um), held.slope, rounded(held.reference_mm));
    }
    append(row, state.displacement_um);
    append(row, state.error_before_um);
    append(row, state.error_after_um);
    for (const int number : {int{state.control}, int{state.status}, int{state.plc_heartbeat},
                             int{state.box_heartbeat}, int{state.handshake}, state.alarms}) {
        row += fmt::format(",{}", number);
    }
    row += ",";
    std::string events;
    for (const auto &words : state.events) events += (events.empty() ? "" : " | ") + words;
    std::replace(events.begin(), events.end(), ',', ';');
    row += events + "\n";
    good_ = std::fputs(row.c_str(), file_.get()) >= 0 && good_;
}

bool plc_log::flush() {
    good_ = std::fflush(file_.get()) == 0 && good_;
    return good_;
}

}  // namespace compbox::fakeplc
