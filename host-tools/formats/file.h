// SPDX-License-Identifier: MIT
// Reads and writes whole files. No file is ever left incomplete.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace compbox::formats {

// out: the file's bytes. Throws input_error if it cannot be read or exceeds max_bytes.
std::string read_file(const std::string &path, std::size_t max_bytes = 256u << 20);

// Writes a temporary file beside `path`, syncs it and renames it to `path`, so that a reader sees
// the old or the new file, never a part. Throws input_error on failure and removes the temporary
// file. Rejects devices and files that this program has read, so that no result overwrites its
// measurement. With `out`, the paths "-" and "/dev/stdout" print to it.
void write_file(const std::string &path, const std::string &content, std::ostream *out = nullptr);

// The last of these checks, for files written row by row: throws input_error that asks for another
// name for `what`.
void refuse_given(const std::string &path, const std::string &what);

// Like write_file, but for a file that may have been read.
void update_file(const std::string &path, const std::string &content, std::ostream *out = nullptr);

// Like write_file, for a file that only this user may read.
void write_secret_file(const std::string &path, const std::string &content);

// Creates missing folders of the path. Throws input_error.
void make_folder(const std::string &path);

// While one lives, write_file, update_file, make_folder and run_gnuplot throw input_error for a
// path that is not in or below one of its folders after symbolic links are followed. At most one
// lives at a time; it applies to all threads.
class writes_below {
  public:
    explicit writes_below(const std::vector<std::string> &folders);
    ~writes_below();
    writes_below(const writes_below &) = delete;
    writes_below &operator=(const writes_below &) = delete;
};

// Throws input_error if writes_below forbids the path.
void refuse_outside(const std::string &path);

}  // namespace compbox::formats
