// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/pt100.h"

#include <cmath>
#include <sstream>

#include "host-tools/fakeplc/typed_number.h"
#include "host-tools/formats/error.h"

namespace compbox::fakeplc {

namespace {

constexpr double degC_per_unit = 0.1;
constexpr int most_registers = 125;

double temperature(const std::string &text) {
    const double value = number(text);
    if (value < -3276.8 || value > 3276.7) {
        throw input_error(fmt::format("'{}' °C does not fit into a register of 0.1 °C", text));
    }
    return value;
}

std::uint16_t register_of(double degC) {
    return static_cast<std::uint16_t>(std::lround(degC / degC_per_unit));
}

}  // namespace

void pt100_modules::add(const std::string &text) {
    const auto equals = text.find('=');
    if (equals == std::string::npos) {
        throw input_error(fmt::format("'{}' is not UNIT=DEGC[,DEGC…], as in 5=20.1,21.5", text));
    }
    const int unit = whole(text.substr(0, equals), 1, 247);
    if (modules_.count(unit) > 0) {
        throw input_error(fmt::format("unit {} is there twice", unit));
    }
    module made;
    std::stringstream list(text.substr(equals + 1));
    for (std::string item; std::getline(list, item, ',');)
        made.temperatures_degC.push_back(temperature(item));
    if (made.temperatures_degC.empty() || made.temperatures_degC.size() > most_registers) {
        throw input_error(fmt::format("unit {} needs 1 to 125 temperatures", unit));
    }
    modules_[unit] = made;
}

unit_reply pt100_modules::answer(int unit, const byte_string &request) const {
    const auto found = modules_.find(unit);
    if (found == modules_.end() || found->second.silent) return {};
    const module &which = found->second;
    const auto refuse = [&](std::uint8_t code) {
        return unit_reply{modbus::exception_reply(request[0], code), which.late_ms};
    };
    if (request[0] != 3 && request[0] != 4) return refuse(modbus::illegal_function);
    if (request.size() != 5) return refuse(modbus::illegal_value);
    const unsigned start = modbus::word(request, 1), count = modbus::word(request, 3);
    if (count < 1 || count > most_registers) return refuse(modbus::illegal_value);
    if (start + count > which.temperatures_degC.size()) return refuse(modbus::illegal_address);
    byte_string reply{request[0], static_cast<std::uint8_t>(2 * count)};
    for (unsigned i = start; i < start + count; ++i) {
        const std::uint16_t raw = register_of(which.temperatures_degC[i]);
        reply.push_back(static_cast<std::uint8_t>(raw >> 8));
        reply.push_back(static_cast<std::uint8_t>(raw & 0xFF));
    }
    return {reply, which.late_ms};
}

pt100_modules::module &pt100_modules::at(const std::string &unit) {
    const auto found = modules_.find(whole(unit, 1, 247));
    if (found == modules_.end()) throw input_error("there is no unit " + unit);
    return found->second;
}

void pt100_modules::set(module &which, const std::string &index, const std::string &value) {
    const int last = static_cast<int>(which.temperatures_degC.size()) - 1;
    which.temperatures_degC[static_cast<std::size_t>(whole(index, 0, last))] = temperature(value);
}

std::string pt100_modules::run(const std::string &line) {
    std::istringstream text(line);
    std::vector<std::string> words;
    for (std::string one; text >> one;) words.push_back(one);
    try {
        if (words.size() == 4 && words[0] == "set") {
            set(at(words[1]), words[2], words[3]);
        } else if (words.size() == 3 && words[0] == "silent") {
            at(words[1]).silent = whole(words[2], 0, 1) == 1;
        } else if (words.size() == 3 && words[0] == "late") {
            at(words[1]).late_ms = whole(words[2], 0, 600000);
        } else {
            return "error: usage: set UNIT REGISTER DEGC, silent UNIT 0|1, late UNIT MS, quit";
        }
    } catch (const input_error &error) {
        return std::string("error: ") + error.what();
    }
    return "ok";
}

}  // namespace compbox::fakeplc
