// SPDX-License-Identifier: MIT
// Whole files in and out. Nothing is ever left half-written.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace compbox {

// The file's bytes. Throws input_error when it cannot be read or is larger than max_bytes.
std::string read_file(const std::string &path, std::size_t max_bytes = 256u << 20);

// Writes a temporary file beside `path`, syncs it and renames it over `path`, so that a reader
// sees the old or the new file and never a part. Throws input_error when that fails; the temporary
// file is then gone. Devices are refused, and so is a file that this program has read: what was
// made of a measurement is not written over it. Where `out` is given, the paths "-" and
// "/dev/stdout" print to it instead.
void write_file(const std::string &path, const std::string &content, std::ostream *out = nullptr);

// The last of these checks alone, for what is written row by row: throws input_error that asks for
// another name for `what`.
void refuse_given(const std::string &path, const std::string &what);

// As write_file for a file that is brought up to date: it may have been read.
void update_file(const std::string &path, const std::string &content, std::ostream *out = nullptr);

// Creates the folder and its parents where missing. Throws input_error.
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

// Throws input_error where writes_below forbids the path.
void refuse_outside(const std::string &path);

}  // namespace compbox
