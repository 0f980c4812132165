// SPDX-License-Identifier: MIT
#include "host-tools/compbox/progress.h"

#include <unistd.h>

#include <cmath>
#include <iostream>
#include <memory>

namespace compbox {

std::function<void(double)> progress_of(const std::string &what) {
    if (::isatty(STDERR_FILENO) == 0) return {};
    auto shown = std::make_shared<long>(-1);
    return [what, shown](double part) {
        const long percent = std::lround(100.0 * part);
        if (percent == *shown) return;
        *shown = percent;
        std::cerr << "\r" << what << " " << percent << " %" << std::flush;
        if (percent >= 100) std::cerr << "\r\033[K" << std::flush;
    };
}

}  // namespace compbox
