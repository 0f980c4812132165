// SPDX-License-Identifier: MIT
// The daemon's snapshot file (docs/snapshot.md), read again whenever it changes.
#pragma once

#include <sys/stat.h>

#include <memory>
#include <optional>
#include <string>

#include "host-tools/formats/json_type.h"

namespace compbox::box_files {

// The longest interval between two snapshots is 1 s.
constexpr double snapshot_stale_s = 3.0;
constexpr std::size_t snapshot_most_bytes = 1u << 18;  // compboxd writes 128 kB at most

class snapshot_file {
  public:
    explicit snapshot_file(const std::string &path);
    ~snapshot_file();
    snapshot_file(const snapshot_file &) = delete;
    snapshot_file &operator=(const snapshot_file &) = delete;

    // Looks at the file; reads and parses it if it is another one than before.
    // out: whether there is a new snapshot
    bool poll();

    // out: the newest snapshot, null without a usable one, and as text on one line, or "null".
    // An object of version 1 whose lists hold objects with names.
    const json &value() const { return *value_; }
    const std::string &text() const { return text_; }

    // in : wall clock, s. out: time since the file was written, 0 or more; nothing without a file
    std::optional<double> age_s(double unix_s) const;

    // in : wall clock, s. out: why there is no box to show, as a sentence; "": it runs
    std::string why_not(double unix_s) const;

    // out: {"snapshot": …, "age_s": …, "stale": …, "why": …} on one line
    std::string live_text(double unix_s) const;

  private:
    bool read(int descriptor);
    bool parse(const std::string &text);
    bool drop(const std::string &why);

    std::string path_, text_ = "null", why_;
    struct stat seen_ = {};
    std::unique_ptr<json> value_;
};

// Wall clock, s.
double unix_now_s();

}  // namespace compbox::box_files
