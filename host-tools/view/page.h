// SPDX-License-Identifier: MIT
// The files of page/, compiled into the program (cmake/page.cmake).
#pragma once

#include <string_view>

namespace compbox::view {

struct page_file {
    std::string_view name;  // below page/, such as "index.html"
    std::string_view type;  // content type
    std::string_view etag;  // from the content, with its quotes
    std::string_view content;
};

// out: the file for "/" (index.html) or "/NAME", which lives as long as the program; null: none
const page_file *find_page(std::string_view path);

// Sorted by name; the build makes it.
extern const page_file page_files[];
extern const unsigned page_files_count;

}  // namespace compbox::view
