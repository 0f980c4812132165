// SPDX-License-Identifier: MIT
// The PLC's log: one CSV row for each scan.
#pragma once

#include <cstdio>
#include <memory>
#include <string>

#include "host-tools/fakeplc/plc.h"

namespace compbox::fakeplc {

class plc_log {
  public:
    // Opens the file and writes the header. Throws input_error.
    plc_log(const std::string &path, const register_map &map);

    void add(const plc_state &state);
    // Writes the buffered rows; false if a write failed.
    bool flush();

  private:
    struct closer {
        void operator()(std::FILE *file) const { std::fclose(file); }
    };
    std::unique_ptr<std::FILE, closer> file_;
    bool good_ = true;
};

}  // namespace compbox::fakeplc
