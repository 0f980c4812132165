// SPDX-License-Identifier: MIT
// The disk of the box's computer: what was written, and what of it survives a power cut. Contents
// become durable by fsync of the file, names by fsync of the folder. Paths are absolute.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/world/dice.h"
#include "tests/world/open_file.h"
#include "tests/world/scheduler.h"

namespace compbox::world {

enum class node_kind { regular, folder, link, fifo, device };

struct node {
    node_kind kind = node_kind::regular;
    int number = 0;  // of the inode
    std::string bytes;
    std::string durable;        // content after a power cut …
    bool dirty = false;         // … unless some of what was written since then survives
    std::size_t unchanged = 0;  // the first bytes, on the disk since before
    std::string target;         // of a link
    unsigned owner = 1000, permissions = 0644;
    bool is_uncut = false;                    // the disk refused the newest ftruncate
    time_ns modified_ns = 0, changed_ns = 0;  // of the wall clock
    time_ns replaced_ns = 0;  // age of the link whose place a rename gave it; 0: none
    // Opens a device.
    std::function<std::shared_ptr<open_file>()> driver;
};

class file_tree {
  public:
    // in : wall: the wall clock, for the times of files
    explicit file_tree(std::function<time_ns()> wall);

    // ---- calls of the box: results are ≥ 0, or -errno
    int open(const std::string &path, int flags, std::shared_ptr<open_file> *opened);
    int rename(const std::string &from, const std::string &to);
    int unlink(const std::string &path);
    // out: nullptr if there is none; a link itself unless `follow`
    std::shared_ptr<node> find(const std::string &path, bool follow = true) const;

    // ---- for the world: what an operator, another program or the system does, at once and durable
    void put(const std::string &path, const std::string &bytes);      // in place
    void replace(const std::string &path, const std::string &bytes);  // by another file
    void make_folder(const std::string &path);
    void make_link(const std::string &path, const std::string &target);
    void make_fifo(const std::string &path);
    void make_device(const std::string &path, std::function<std::shared_ptr<open_file>()> driver);
    void remove(const std::string &path);
    std::vector<std::string> names_in(const std::string &folder) const;
    bool has(const std::string &path) const { return find(path) != nullptr; }
    std::string text(const std::string &path) const;  // "" if there is none

    // Everything that was not synchronised may be lost: chance decides of each file, and of its
    // bytes.
    void cut_power(dice &chance);

    std::int64_t used_bytes() const;
    std::int64_t capacity_bytes = 64 << 20;  // of all regular files: beyond it ENOSPC
    bool refuses_cuts = false;               // of ftruncate
    time_ns hangs_until_ns = 0;              // calls about it wait until then
    bool read_only = false;                  // EROFS

    // Called with each change of a regular file's content or name, for the hash and invariants.
    std::function<void(const std::string &path, const node &file)> written;

    // ---- for open files
    long write(node &file, const std::string &path, std::size_t at, const char *bytes,
               std::size_t count);
    int truncate(node &file, std::size_t size);
    void sync(node &file);
    void sync_names(const std::string &folder);

  private:
    std::shared_ptr<node> make(const std::string &path, node_kind kind);
    void touch(node &file) const;
    void forget_cache(const std::string &path);

    std::function<time_ns()> wall_;
    std::map<std::string, std::shared_ptr<node>> names_, durable_names_;
    int nodes_made_ = 0;
    std::int64_t used_ = 0;
};

}  // namespace compbox::world
