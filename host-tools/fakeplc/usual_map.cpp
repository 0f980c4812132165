// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/usual_map.h"

namespace compbox {

namespace {

constexpr int handshake_register = 2;
constexpr int first_position = 8;
constexpr int first_applied = 24;
constexpr int first_written = 100;
constexpr int first_offset = 104;
constexpr double position_scale_mm = 0.0001;

// FANUC takes 16 bits of 0.1 µm.
taken_channel offset_of(const std::string &axis, int index, const std::string &profile) {
    const bool fanuc = profile == "fanuc";
    taken_channel channel;
    channel.name = axis;
    channel.format = number_format::parse(fanuc ? "int16" : "int32").value();
    channel.scale_um = fanuc ? 0.1 : 0.01;
    channel.address = first_offset + 2 * index;
    channel.applied_address = first_applied + 2 * index;
    return channel;
}

shown_signal position_of(const std::string &axis, int index) {
    shown_signal signal;
    signal.name = axis;
    signal.address = first_position + 2 * index;
    signal.format = number_format::parse("int32").value();
    signal.scale = position_scale_mm;
    return signal;
}

}  // namespace

register_map usual_register_map(const std::string &axes, const std::string &profile) {
    register_map map;
    map.profile = profile;
    const int count = static_cast<int>(axes.size());
    map.read = {0, first_applied + 2 * count, false};
    map.write = {first_written, first_offset - first_written + 2 * count, false};
    map.control = 0;
    map.plc_heartbeat = 1;
    map.status = first_written;
    map.box_heartbeat = first_written + 1;
    if (profile == "fanuc") map.handshake = handshake_register;
    for (int i = 0; i < count; ++i) {
        const std::string axis(1, axes[static_cast<std::size_t>(i)]);
        map.signals.push_back(position_of(axis, i));
        map.channels.push_back(offset_of(axis, i, profile));
    }
    return map;
}

}  // namespace compbox
