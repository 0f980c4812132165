// SPDX-License-Identifier: MIT
// Pt100 modules on a bus: holding registers of temperatures, 0.1 °C each, and their faults.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host-tools/fakeplc/serial_server.h"

namespace compbox::fakeplc {

class pt100_modules {
  public:
    // "5=20.1,21.5": the temperatures of unit 5 in °C, register 0 first. Throws input_error.
    void add(const std::string &text);

    // Answers readings by function 3 or 4; replies with an exception to any other request.
    unit_reply answer(int unit, const byte_string &request) const;

    // in : a command, any text. out: one line that begins with "ok" or "error:"
    std::string run(const std::string &line);

  private:
    struct module {
        std::vector<double> temperatures_degC;
        bool silent = false;
        int late_ms = 0;
    };
    module &at(const std::string &unit);
    void set(module &which, const std::string &index, const std::string &value);

    std::map<int, module> modules_;
};

}  // namespace compbox::fakeplc
