// SPDX-License-Identifier: MIT
#include "host-tools/view/page.h"

#include <algorithm>

namespace compbox::view {

const page_file *find_page(std::string_view path) {
    if (path.empty() || path[0] != '/') return nullptr;
    const std::string_view name = path == "/" ? "index.html" : path.substr(1);
    const auto end = page_files + page_files_count;
    const auto found = std::lower_bound(
        page_files, end, name, [](const page_file &a, std::string_view b) { return a.name < b; });
    return found != end && found->name == name ? found : nullptr;
}

}  // namespace compbox::view
