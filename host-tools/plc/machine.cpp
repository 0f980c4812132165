// SPDX-License-Identifier: MIT
#include "host-tools/plc/machine.h"

#include <sys/stat.h>

#include <algorithm>
#include <charconv>

#include "host-tools/fakeplc/register_map.h"
#include "host-tools/formats/json.h"

namespace compbox::plc {

namespace {

bool ends_with(const std::string &text, const std::string &end) {
    return text.size() >= end.size() &&
           text.compare(text.size() - end.size(), end.size(), end) == 0;
}

int parse_port(const std::string &text, const std::string &whole) {
    int port = 0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), port);
    const bool number = result.ec == std::errc() && result.ptr == text.data() + text.size();
    if (!number || port < 1 || port > 65535)
        throw input_error(
            fmt::format("{}: the port must be a number from 1 to 65535, as in 192.168.0.10:502 or "
                        "[fd00::1]:502",
                        whole));
    return port;
}

item word(const std::string &name, int address) {
    item made;
    made.name = name;
    made.address = address;
    made.format = *fakeplc::number_format::parse("uint16");
    return made;
}

item number(const std::string &name, int address, const fakeplc::number_format &format,
            double scale, const std::string &unit) {
    item made = word(name, address);
    made.format = format;
    made.scale = scale;
    made.unit = unit;
    return made;
}

void add_fixed(std::vector<item> &to, const fakeplc::register_map &map) {
    to.push_back(word("control", map.control));
    to.push_back(word("plc_heartbeat", map.plc_heartbeat));
    if (map.handshake) to.push_back(word("handshake", *map.handshake));
    to.push_back(word("status", map.status));
    to.push_back(word("box_heartbeat", map.box_heartbeat));
    if (map.detail) to.push_back(word("detail", *map.detail));
}

// in : root, the file; its units are not in the map
void add_signals(std::vector<item> &to, const fakeplc::register_map &map, const json &root) {
    std::map<std::string, std::string> units;
    for (const auto &entry : root.value("signals", json::array()))
        units[formats::get<std::string>(entry, "name", map.file)] =
            formats::get_or<std::string>(entry, "unit", "", map.file);
    for (const auto &signal : map.signals) {
        to.push_back(
            number(signal.name, signal.address, signal.format, signal.scale, units[signal.name]));
        to.back().zero = signal.zero;
    }
}

void add_channel(std::vector<item> &to, const fakeplc::taken_channel &of) {
    to.push_back(number("value_" + of.name, of.address, of.format, of.scale_um, "um"));
    if (of.applied_address)
        to.push_back(
            number("applied_" + of.name, *of.applied_address, of.format, of.scale_um, "um"));
    if (!of.tangent) return;
    to.push_back(number("slope_" + of.name, of.tangent->slope_address, of.tangent->slope_format,
                        of.tangent->slope_scale, ""));
    to.push_back(number("reference_" + of.name, of.tangent->reference_address,
                        of.tangent->reference_format, of.tangent->reference_scale_mm, "mm"));
}

// in : plc.transport. out: its wire; throws input_error for a key that is missing or wrong
wire wire_of(const json &transport, const std::string &path) {
    wire to;
    const json rtu = transport.is_object() ? transport.value("rtu", json()) : json();
    const json tcp = transport.is_object() ? transport.value("tcp", json()) : json();
    if (rtu.is_object()) {
        to.device = formats::get<std::string>(rtu, "device", path);
        to.baud = formats::get<int>(rtu, "baud", path);
        to.parity = formats::get_or<std::string>(rtu, "parity", "even", path);
        to.stop_bits = formats::get_or(rtu, "stop_bits", 1, path);
        to.rs485 = formats::get_or(rtu, "rs485", false, path);
        to.unit = formats::get_or(rtu, "unit", 1, path);
        return to;
    }
    if (!tcp.is_object())
        throw input_error(path, 0, 0, "plc.transport: needs tcp or rtu, the wire to the PLC");
    to.host = formats::get<std::string>(tcp, "host", path);
    to.port = formats::get_or(tcp, "port", 502, path);
    to.unit = formats::get_or(tcp, "unit", 1, path);
    return to;
}

}  // namespace

bool is_file(const std::string &text) {
    struct stat info = {};
    return ends_with(text, ".json") || (::stat(text.c_str(), &info) == 0 && S_ISREG(info.st_mode));
}

wire parse_wire(const std::string &text) {
    wire to;
    const std::size_t colon = text.rfind(':');
    const bool bracketed = text.rfind('[', 0) == 0 && text.find(']') != std::string::npos;
    if (text.find('/') != std::string::npos) {
        to.device = text;
    } else if (bracketed) {
        const std::size_t close = text.find(']');
        to.host = text.substr(1, close - 1);
        if (close + 1 < text.size())
            to.port = parse_port(text[close + 1] == ':' ? text.substr(close + 2) : "", text);
    } else if (colon == std::string::npos || text.find(':') != colon) {
        to.host = text;  // without a port, or an IPv6 address
    } else {
        to.host = text.substr(0, colon);
        to.port = parse_port(text.substr(colon + 1), text);
    }
    return to;
}

machine::machine(const std::string &path) : path_(path) {
    const json root = formats::read_json(path);
    const fakeplc::register_map map = fakeplc::register_map_of(root, path);
    to_plc_ = wire_of(root.at("plc").value("transport", json::object()), path);
    add_fixed(items_, map);
    add_signals(items_, map, root);
    for (const auto &channel : map.channels) add_channel(items_, channel);
    for (auto &one : items_) {
        const bool read = one.address >= map.read.start && one.end() <= map.read.end();
        one.block = read ? map.read.start : map.write.start;
        one.by_plc = read;
    }
    std::stable_sort(items_.begin(), items_.end(),
                     [](const item &a, const item &b) { return a.address < b.address; });
}

const item &machine::named(const std::string &name) const {
    std::string known;
    for (const auto &one : items_) {
        if (one.name == name) return one;
        known += (known.empty() ? "" : ", ") + one.name;
    }
    throw input_error(path_, 0, 0, "no register is named {}; there are {}", name, known);
}

}  // namespace compbox::plc
