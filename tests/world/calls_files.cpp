// SPDX-License-Identifier: MIT
// Descriptors and files.
#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <cstdarg>
#include <cstring>
#include <ctime>

#include "tests/world/calls.h"

namespace {

using namespace compbox::world;

mode_t type_of(node_kind kind) {
    switch (kind) {
        case node_kind::regular:
            return S_IFREG;
        case node_kind::folder:
            return S_IFDIR;
        case node_kind::link:
            return S_IFLNK;
        case node_kind::fifo:
            return S_IFIFO;
        case node_kind::device:
            return S_IFCHR;
    }
    return 0;
}

void describe(const node *file, struct stat *to) {
    *to = {};
    to->st_mode = S_IFCHR | 0600;
    to->st_rdev = makedev(188, 0);  // of USB serial adapters
    if (file == nullptr) return;
    to->st_dev = 1;
    to->st_ino = static_cast<ino_t>(file->number);
    to->st_mode = type_of(file->kind) | file->permissions;
    to->st_uid = file->owner;
    to->st_size = static_cast<off_t>(file->bytes.size());
    to->st_mtim = {file->modified_ns / second, file->modified_ns % second};
    to->st_ctim = {file->changed_ns / second, file->changed_ns % second};
}

int stat_path(const char *name, const char *path, struct stat *to, bool follow) {
    const call_fate fate = here().begin(name, nullptr, path);
    if (fate.error != 0) return -1;
    const auto found = here().files.find(path, follow);
    if (found == nullptr) return returned(-ENOENT);
    describe(found.get(), to);
    return 0;
}

int ready_of(pollfd *set, nfds_t count) {
    int ready = 0;
    for (nfds_t i = 0; i < count; ++i) {
        set[i].revents = 0;
        if (set[i].fd < 0) continue;
        const auto file = here().descriptor(set[i].fd);
        const int events = file == nullptr ? POLLNVAL : file->ready();
        set[i].revents =
            static_cast<short>(events & (set[i].events | POLLERR | POLLHUP | POLLNVAL));
        ready += set[i].revents != 0;
    }
    return ready;
}

int poll_until(pollfd *set, nfds_t count, time_ns until) {
    for (;;) {
        const int ready = ready_of(set, count);
        if (ready > 0 || here().time.now() >= until) return ready;
        here().wait_for_change(until);
    }
}

// A pipe waits for its other end, which never comes.
bool waits_for_ever(const char *path, int flags) {
    const auto found = here().files.find(path, (flags & O_NOFOLLOW) == 0);
    return found != nullptr && found->kind == node_kind::fifo && (flags & O_NONBLOCK) == 0;
}

}  // namespace

extern "C" {

int world_open(const char *path, int flags, ...) {
    if (here().begin("open", nullptr, path).error != 0) return -1;
    if (waits_for_ever(path, flags)) {
        for (;;) here().wait_for_change(never);
    }
    std::shared_ptr<open_file> opened;
    const int error = here().files.open(path, flags, &opened);
    if (error != 0) return returned(error);
    opened->waits = (flags & O_NONBLOCK) == 0;
    return returned(here().add_descriptor(std::move(opened)));
}

int world_close(int fd) {
    call_fate fate;
    if (begin_on(fd, "close", &fate) == nullptr && fate.error == 0) return -1;
    (void)here().close_descriptor(fd);  // Linux closes it even if it reports an error
    return fate.error != 0 ? -1 : 0;
}

ssize_t world_read(int fd, void *to, size_t count) {
    call_fate fate;
    open_file *const file = begin_on(fd, "read", &fate);
    if (file == nullptr) return -1;
    if (fate.half && count > 1) count /= 2;
    return returned(file->read(to, count));
}

ssize_t world_write(int fd, const void *from, size_t count) {
    call_fate fate;
    open_file *const file = begin_on(fd, "write", &fate);
    if (file == nullptr) return -1;
    if (fate.half && count > 1) count /= 2;
    return returned(file->write(from, count));
}

off_t world_lseek(int fd, off_t to, int from) {
    call_fate fate;
    open_file *const file = begin_on(fd, "lseek", &fate);
    return file == nullptr ? -1 : returned(file->seek(to, from));
}

int world_ftruncate(int fd, off_t size) {
    call_fate fate;
    open_file *const file = begin_on(fd, "ftruncate", &fate);
    return file == nullptr ? -1 : returned(file->truncate(size));
}

int world_fsync(int fd) {
    call_fate fate;
    open_file *const file = begin_on(fd, "fsync", &fate);
    return file == nullptr ? -1 : returned(file->sync());
}

int world_flock(int fd, int) {
    call_fate fate;
    open_file *const file = begin_on(fd, "flock", &fate);
    return file == nullptr ? -1 : returned(file->lock());
}

int world_ioctl(int fd, unsigned long request, ...) {
    call_fate fate;
    open_file *const file = begin_on(fd, "ioctl", &fate);
    if (file == nullptr) return -1;
    va_list arguments;
    va_start(arguments, request);
    void *const argument = va_arg(arguments, void *);
    va_end(arguments);
    return returned(file->control(request, argument));
}

int world_fstat(int fd, struct stat *to) {
    call_fate fate;
    const open_file *const file = begin_on(fd, "fstat", &fate);
    if (file == nullptr) return -1;
    describe(file->file(), to);
    return 0;
}

int world_stat(const char *path, struct stat *to) {
    return stat_path("stat", path, to, true);
}

int world_lstat(const char *path, struct stat *to) {
    return stat_path("lstat", path, to, false);
}

int world_access(const char *path, int) {
    if (here().begin("access", nullptr, path).error != 0) return -1;
    return here().files.has(path) ? 0 : returned(-ENOENT);
}

// One folder is read at a time.
DIR *world_opendir(const char *path) {
    if (here().begin("opendir", nullptr, path).error != 0) return nullptr;
    const auto found = here().files.find(path);
    if (found == nullptr || found->kind != node_kind::folder) {
        error_number() = found == nullptr ? ENOENT : ENOTDIR;
        return nullptr;
    }
    auto &listed = here().current_process().listed;
    listed = here().files.names_in(path);
    return reinterpret_cast<DIR *>(&listed);
}

dirent *world_readdir(DIR *) {
    if (here().begin("readdir").error != 0) return nullptr;
    auto &process = here().current_process();
    if (process.listed.empty()) return nullptr;
    std::strncpy(process.entry.d_name, process.listed.back().c_str(),
                 sizeof process.entry.d_name - 1);
    process.listed.pop_back();
    return &process.entry;
}

int world_closedir(DIR *) {
    return here().begin("closedir").error != 0 ? -1 : 0;
}

int world_rename(const char *from, const char *to) {
    const bool refused = here().begin("rename", nullptr, from).error != 0;
    const int result = refused ? -1 : returned(here().files.rename(from, to));
    if (result != 0 && here().rename_failed) here().rename_failed(to);
    return result;
}

int world_unlink(const char *path) {
    if (here().begin("unlink", nullptr, path).error != 0) return -1;
    return returned(here().files.unlink(path));
}

int world_poll(pollfd *set, nfds_t count, int timeout_ms) {
    if (here().begin("poll").error != 0) return -1;
    return poll_until(set, count, timeout_ms < 0 ? never : here().time.now() + timeout_ms * ms);
}

int world_ppoll(pollfd *set, nfds_t count, const timespec *timeout, const sigset_t *) {
    if (here().begin("ppoll").error != 0) return -1;
    return poll_until(set, count,
                      timeout == nullptr
                          ? never
                          : here().time.now() + timeout->tv_sec * second + timeout->tv_nsec);
}
}
