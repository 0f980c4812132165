// SPDX-License-Identifier: MIT
#include "host-tools/command_line/progress.h"

#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <ostream>

namespace compbox::cli {

std::function<void(double)> progress_of(const cli::streams &io, const std::string &what) {
    if (!io.shows_progress) return {};
    auto shown = std::make_shared<long>(-1);
    return [&err = io.err, what, shown](double part) {
        const long percent = std::lround(100.0 * part);
        if (percent == *shown) return;
        *shown = percent;
        err << "\r" << what << " " << percent << " %" << std::flush;
        if (percent >= 100) err << "\r\033[K" << std::flush;
    };
}

std::function<void(double, double)> progress_bar_of(const cli::streams &io, const std::string &what,
                                                    const std::string &figure) {
    if (!io.shows_progress) return {};
    return [&err = io.err, what, figure](double part, double value) {
        constexpr int width = 30;
        const int full = static_cast<int>(std::lround(width * part));
        err << "\r" << what << " [" << std::string(static_cast<std::size_t>(full), '#')
            << std::string(static_cast<std::size_t>(width - full), '.') << "]"
            << fmt::format(" {:3.0f} %  ", 100.0 * part) << figure << " "
            << fmt::format("{:.4g}", value) << "\033[K" << std::flush;
        if (part >= 1.0) err << "\r\033[K" << std::flush;
    };
}

}  // namespace compbox::cli
