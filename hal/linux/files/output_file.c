/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/output_file.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "hal/linux/whole_file.h"

static int refused(int fd, int error) {
    if (fd >= 0) close(fd);
    errno = error;
    return -1;
}

/* out: 0 for a regular file or none; else errno, because a rename would replace it */
static int fault_at(const char *path) {
    struct stat there;
    if (lstat(path, &there) != 0) return errno == ENOENT ? 0 : errno;
    return S_ISLNK(there.st_mode) ? ELOOP : S_ISREG(there.st_mode) ? 0 : ENOTSUP;
}

int cb_output_open_kept(const char *path, int64_t *bytes) {
    struct stat opened;
    const int fd = open(path, O_WRONLY | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644);
    if (fd < 0) return -1;
    if (fstat(fd, &opened) != 0) return refused(fd, errno);
    *bytes = S_ISREG(opened.st_mode) ? opened.st_size : -1;
    return fd;
}

int cb_output_open(const char *path) {
    int64_t bytes = 0;
    const int fd = cb_output_open_kept(path, &bytes);
    if (bytes > 0 && !cb_output_cut(fd, 0)) return refused(fd, errno);
    return fd;
}

bool cb_output_cut(int fd, int64_t bytes) {
    while (ftruncate(fd, bytes) != 0)
        if (errno != EINTR) return false;
    return true;
}

size_t cb_output_write(int fd, const void *bytes, size_t size) {
    size_t done = 0;
    while (done < size) {
        const ssize_t now = write(fd, (const char *)bytes + done, size - done);
        if (now < 0 && errno == EINTR) continue;
        if (now == 0) errno = ENOSPC;
        if (now <= 0) break;
        done += (size_t)now;
    }
    return done;
}

/* out: 0; or errno. *bytes: size of the file with the end of its last line */
static int end_last_line(int fd, int64_t *bytes) {
    char last = '\n';
    *bytes = lseek(fd, 0, SEEK_END);
    if (*bytes <= 0) return *bytes < 0 ? errno : 0;
    if (!cb_read_at(fd, *bytes - 1, &last, 1)) return errno;
    if (last == '\n') return 0;
    ++*bytes;
    return cb_output_write(fd, "\n", 1) == 1 ? 0 : errno;
}

int cb_output_append(const char *path, int64_t *bytes) {
    const int fd =
        open(path, O_RDWR | O_APPEND | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644);
    struct stat opened;
    *bytes = 0;
    if (fd < 0) return -1;
    if (fstat(fd, &opened) != 0) return refused(fd, errno);
    const int error = S_ISREG(opened.st_mode) ? end_last_line(fd, bytes) : 0;
    return error == 0 ? fd : refused(fd, error);
}

/* Creates an empty file. in: temporary[size]: for its name. out: a descriptor; or -1 with errno */
static int begin(const char *path, char *temporary, size_t size) {
    if ((size_t)snprintf(temporary, size, "%s.new", path) >= size) return refused(-1, ENAMETOOLONG);
    const int fault = fault_at(path);
    if (fault != 0) return refused(-1, fault);
    unlink(temporary);
    return open(temporary, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644);
}

int cb_output_close(int fd, int error, bool durable) {
    if (error == 0 && durable && fsync(fd) != 0) error = errno;
    if (close(fd) != 0 && error == 0) error = errno;
    return error;
}

void cb_output_sync_folder(const char *path) {
    char folder[4096];
    snprintf(folder, sizeof folder, "%s", path);
    const int fd = open(dirname(folder), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return;
    fsync(fd);
    close(fd);
}

int cb_output_whole(const char *path, const void *bytes, size_t size, bool durable) {
    char temporary[4096];
    const int fd = begin(path, temporary, sizeof temporary);
    if (fd < 0) return errno;
    int error = cb_output_write(fd, bytes, size) == size ? 0 : errno;
    error = cb_output_close(fd, error, durable);
    if (error == 0 && rename(temporary, path) != 0) error = errno;
    if (error != 0) unlink(temporary);
    if (error == 0 && durable) cb_output_sync_folder(path);
    return error;
}

const char *cb_output_error(int error) {
    if (error == ELOOP) return "it is a symbolic link, which is not followed";
    if (error == ENOTSUP) return "it is not a regular file";
    return strerror(error);
}
