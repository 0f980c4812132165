// SPDX-License-Identifier: MIT
#include "tests/world/files.h"

#include <fcntl.h>

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

namespace compbox::world {

namespace {

std::string folder_of(const std::string &path) {
    const auto slash = path.rfind('/');
    return slash == 0 || slash == std::string::npos ? "/" : path.substr(0, slash);
}

class regular_file : public open_file {
  public:
    regular_file(file_tree &tree, std::shared_ptr<node> of, int flags)
        : tree_(tree), node_(std::move(of)), flags_(flags) {}

    long read(void *to, std::size_t count) override {
        if ((flags_ & O_ACCMODE) == O_WRONLY) return -EBADF;
        const std::string &bytes = node_->bytes;
        if (at_ >= bytes.size()) return 0;
        count = std::min(count, bytes.size() - at_);
        std::memcpy(to, bytes.data() + at_, count);
        at_ += count;
        return static_cast<long>(count);
    }
    long write(const void *from, std::size_t count) override {
        if ((flags_ & O_ACCMODE) == O_RDONLY) return -EBADF;
        if (flags_ & O_APPEND) at_ = node_->bytes.size();
        const long done = tree_.write(*node_, path, at_, static_cast<const char *>(from), count);
        if (done > 0) at_ += static_cast<std::size_t>(done);
        return done;
    }
    long seek(long to, int from) override {
        const long base = from == SEEK_SET   ? 0
                          : from == SEEK_CUR ? static_cast<long>(at_)
                                             : static_cast<long>(node_->bytes.size());
        if (base + to < 0) return -EINVAL;
        at_ = static_cast<std::size_t>(base + to);
        return base + to;
    }
    int truncate(long size) override {
        node_->is_uncut = tree_.refuses_cuts || tree_.read_only;
        return tree_.refuses_cuts ? -EIO : tree_.truncate(*node_, static_cast<std::size_t>(size));
    }
    int sync() override {
        tree_.sync(*node_);
        return 0;
    }
    const node *file() const override { return node_.get(); }

  private:
    file_tree &tree_;
    std::shared_ptr<node> node_;
    int flags_;
    std::size_t at_ = 0;
};

class open_folder : public open_file {
  public:
    open_folder(file_tree &tree, std::shared_ptr<node> of) : tree_(tree), node_(std::move(of)) {}
    long read(void *, std::size_t) override { return -EISDIR; }
    int sync() override {
        tree_.sync_names(path);
        return 0;
    }
    const node *file() const override { return node_.get(); }

  private:
    file_tree &tree_;
    std::shared_ptr<node> node_;
};

// A pipe without a writer.
class open_fifo : public open_file {
  public:
    explicit open_fifo(std::shared_ptr<node> of) : node_(std::move(of)) {}
    long read(void *, std::size_t) override { return 0; }
    const node *file() const override { return node_.get(); }

  private:
    std::shared_ptr<node> node_;
};

}  // namespace

file_tree::file_tree(std::function<time_ns()> wall) : wall_(std::move(wall)) {
    make_folder("/");
}

std::shared_ptr<node> file_tree::find(const std::string &path, bool follow) const {
    auto at = names_.find(path);
    for (int links = 0; at != names_.end() && at->second->kind == node_kind::link && follow;
         ++links) {
        if (links == 8) return nullptr;
        at = names_.find(at->second->target);
    }
    return at == names_.end() ? nullptr : at->second;
}

std::vector<std::string> file_tree::names_in(const std::string &folder) const {
    std::vector<std::string> found;
    for (const auto &[path, file] : names_)
        if (path != folder && folder_of(path) == folder)
            found.push_back(path.substr(path.rfind('/') + 1));
    return found;
}

std::string file_tree::text(const std::string &path) const {
    const auto found = find(path);
    return found == nullptr ? "" : found->bytes;
}

void file_tree::touch(node &file) const {
    file.modified_ns = file.changed_ns = wall_();
}

std::shared_ptr<node> file_tree::make(const std::string &path, node_kind kind) {
    auto made = std::make_shared<node>();
    made->kind = kind;
    made->number = ++nodes_made_;
    touch(*made);
    names_[path] = made;
    return made;
}

int file_tree::open(const std::string &path, int flags, std::shared_ptr<open_file> *opened) {
    auto found = find(path, (flags & O_NOFOLLOW) == 0);
    if (found != nullptr && (flags & O_CREAT) && (flags & O_EXCL)) return -EEXIST;
    if (found != nullptr && found->kind == node_kind::link) return -ELOOP;
    const bool writes = (flags & O_ACCMODE) != O_RDONLY;
    if (found == nullptr) {
        if (!(flags & O_CREAT)) return -ENOENT;
        const auto folder = find(folder_of(path));
        if (folder == nullptr) return -ENOENT;
        if (folder->kind != node_kind::folder) return -ENOTDIR;
        if (read_only) return -EROFS;
        found = make(path, node_kind::regular);
    }
    if (found->kind == node_kind::device) {
        *opened = found->driver();
        if (*opened == nullptr) return -ENODEV;
    } else if (found->kind == node_kind::folder) {
        if (writes) return -EISDIR;
        *opened = std::make_shared<open_folder>(*this, found);
    } else if (found->kind == node_kind::fifo) {
        if (writes) return -ENXIO;
        *opened = std::make_shared<open_fifo>(found);
    } else {
        if (flags & O_DIRECTORY) return -ENOTDIR;
        if (writes && read_only) return -EROFS;
        *opened = std::make_shared<regular_file>(*this, found, flags);
        if (flags & O_TRUNC) truncate(*found, 0);
    }
    (*opened)->path = path;
    return 0;
}

int file_tree::rename(const std::string &from, const std::string &to) {
    const auto found = find(from, false);
    if (found == nullptr) return -ENOENT;
    if (read_only) return -EROFS;
    const auto there = find(to, false);
    if (there != nullptr && there->kind == node_kind::folder) return -EISDIR;
    if (there != nullptr) used_ -= static_cast<std::int64_t>(there->bytes.size());
    const bool link = there != nullptr && there->kind == node_kind::link;
    found->replaced_ns = link ? wall_() - there->modified_ns : 0;
    names_[to] = found;
    names_.erase(from);
    found->changed_ns = wall_();
    if (written) written(to, *found);
    return 0;
}

int file_tree::unlink(const std::string &path) {
    const auto found = find(path, false);
    if (found == nullptr) return -ENOENT;
    if (found->kind == node_kind::folder) return -EISDIR;
    if (read_only) return -EROFS;
    used_ -= static_cast<std::int64_t>(found->bytes.size());
    names_.erase(path);
    return 0;
}

long file_tree::write(node &file, const std::string &path, std::size_t at, const char *bytes,
                      std::size_t count) {
    if (read_only) return -EROFS;
    const std::size_t size = file.bytes.size();
    const std::size_t free =
        static_cast<std::size_t>(std::max<std::int64_t>(capacity_bytes - used_, 0));
    const std::size_t room = free + (size > at ? size - at : 0);
    if (count > 0 && room == 0) return -ENOSPC;
    count = std::min(count, room);
    if (at + count > size) {
        used_ += static_cast<std::int64_t>(at + count - size);
        file.bytes.resize(at + count);
    }
    std::memcpy(file.bytes.data() + at, bytes, count);
    file.dirty = true;
    file.unchanged = std::min(file.unchanged, at);
    touch(file);
    if (written) written(path, file);
    return static_cast<long>(count);
}

int file_tree::truncate(node &file, std::size_t size) {
    if (read_only) return -EROFS;
    used_ += static_cast<std::int64_t>(size) - static_cast<std::int64_t>(file.bytes.size());
    file.bytes.resize(size);
    file.dirty = true;
    file.unchanged = std::min(file.unchanged, size);
    touch(file);
    return 0;
}

void file_tree::sync(node &file) {
    file.durable = file.bytes;
    file.dirty = false;
    file.unchanged = file.bytes.size();
}

void file_tree::sync_names(const std::string &folder) {
    const auto inside = [&folder](const std::string &path) { return folder_of(path) == folder; };
    for (auto at = durable_names_.begin(); at != durable_names_.end();) {
        at = inside(at->first) && names_.count(at->first) == 0 ? durable_names_.erase(at)
                                                               : std::next(at);
    }
    for (const auto &name : names_) {
        if (inside(name.first)) durable_names_[name.first] = name.second;
    }
}

std::int64_t file_tree::used_bytes() const {
    return used_;
}

void file_tree::put(const std::string &path, const std::string &bytes) {
    auto found = find(path);
    if (found == nullptr || found->kind != node_kind::regular)
        found = make(path, node_kind::regular);
    used_ +=
        static_cast<std::int64_t>(bytes.size()) - static_cast<std::int64_t>(found->bytes.size());
    found->bytes = bytes;
    touch(*found);
    sync(*found);
    durable_names_[path] = found;
}

void file_tree::replace(const std::string &path, const std::string &bytes) {
    remove(path);
    put(path, bytes);
}

void file_tree::make_folder(const std::string &path) {
    durable_names_[path] = make(path, node_kind::folder);
}

void file_tree::make_link(const std::string &path, const std::string &target) {
    const auto made = make(path, node_kind::link);
    made->target = target;
    durable_names_[path] = made;
}

void file_tree::make_fifo(const std::string &path) {
    durable_names_[path] = make(path, node_kind::fifo);
}

void file_tree::make_device(const std::string &path,
                            std::function<std::shared_ptr<open_file>()> driver) {
    const auto made = make(path, node_kind::device);
    made->driver = std::move(driver);
    durable_names_[path] = made;
}

void file_tree::remove(const std::string &path) {
    const auto found = find(path, false);
    if (found == nullptr) return;
    used_ -= static_cast<std::int64_t>(found->bytes.size());
    names_.erase(path);
    durable_names_.erase(path);
}

// Keeps each changed name or not, and of each file that was not synchronised its durable content,
// its newest, or the newest with a tail that is missing or zero.
void file_tree::cut_power(dice &chance) {
    std::vector<std::string> changed;
    for (const auto &name : names_) {
        const auto before = durable_names_.find(name.first);
        if (before == durable_names_.end() || before->second != name.second)
            changed.push_back(name.first);
    }
    for (const auto &name : durable_names_) {
        if (names_.count(name.first) == 0) changed.push_back(name.first);
    }
    auto after = durable_names_;
    for (const auto &path : changed) {
        if (chance.one_in(2)) continue;
        const auto now = names_.find(path);
        if (now == names_.end())
            after.erase(path);
        else
            after[path] = now->second;
    }
    names_ = durable_names_ = after;
    used_ = 0;
    for (const auto &name : names_) {
        node &file = *name.second;
        if (file.dirty) {
            const std::string newest = file.bytes;
            file.bytes = file.durable;
            if (chance.one_in(2)) {
                // What was synchronised stays up to where it was cut or written anew.
                const std::size_t kept =
                    file.unchanged +
                    static_cast<std::size_t>(chance.below(newest.size() - file.unchanged + 1));
                file.bytes = newest.substr(0, kept);
                if (chance.one_in(2)) file.bytes.resize(newest.size());
            }
        }
        sync(file);
        used_ += static_cast<std::int64_t>(file.bytes.size());
    }
}

}  // namespace compbox::world
