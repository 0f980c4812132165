/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/output_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

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

int cb_output_open(const char *path) {
    struct stat opened;
    const int fd = open(path, O_WRONLY | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644);
    if (fd < 0) return -1;
    if (fstat(fd, &opened) != 0) return refused(fd, errno);
    if (S_ISREG(opened.st_mode) && ftruncate(fd, 0) != 0) return refused(fd, errno);
    return fd;
}

int cb_output_begin(const char *path, char *temporary, size_t size) {
    if ((size_t)snprintf(temporary, size, "%s.new", path) >= size) return refused(-1, ENAMETOOLONG);
    const int fault = fault_at(path);
    if (fault != 0) return refused(-1, fault);
    unlink(temporary);
    return open(temporary, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644);
}

int cb_output_replace(const char *path, const char *temporary, int error) {
    if (error == 0 && rename(temporary, path) != 0) error = errno;
    if (error != 0) unlink(temporary);
    return error;
}

const char *cb_output_error(int error) {
    if (error == ELOOP) return "it is a symbolic link, which is not followed";
    if (error == ENOTSUP) return "it is not a regular file";
    return strerror(error);
}
