// SPDX-License-Identifier: MIT
#include "host-tools/box_files/line_cutter.h"

namespace compbox::box_files {

void line_cutter::clear() {
    rest_.clear();
    skips_ = false;
}

void line_cutter::add(std::string_view bytes, const line_taker &take) {
    rest_.append(bytes);
    std::size_t start = 0;
    for (std::size_t end; (end = rest_.find('\n', start)) != std::string::npos; start = end + 1) {
        if (!skips_ && end - start <= most_line_) {
            take(std::string_view(rest_).substr(start, end - start));
        }
        skips_ = false;
    }
    rest_.erase(0, start);
    if (rest_.size() <= most_line_) return;
    rest_.clear();
    skips_ = true;
}

}  // namespace compbox::box_files
