/* SPDX-License-Identifier: MIT */
#include "hal/linux/whole_file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

long cb_read_to_end(int fd, char *text, size_t size) {
    size_t length = 0;
    while (length < size) {
        const ssize_t got = read(fd, text + length, size - length);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return -1;
        if (got == 0) break;
        length += (size_t)got;
    }
    return (long)length;
}

bool cb_read_at(int fd, int64_t at, char *to, size_t bytes) {
    return lseek(fd, at, SEEK_SET) == at && cb_read_to_end(fd, to, bytes) == (long)bytes;
}

/* O_NONBLOCK has no effect on a regular file. */
long cb_whole_file_read(const char *path, char *text, size_t size, struct stat *there,
                        const char **why) {
    long length = -1;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (fd < 0 || fstat(fd, there) != 0) {
        *why = strerror(errno);
    } else if (S_ISDIR(there->st_mode)) {
        *why = strerror(EISDIR);
    } else if (!S_ISREG(there->st_mode)) {
        *why = "it is not a regular file; put the file itself there";
    } else {
        length = cb_read_to_end(fd, text, size);
        if (length < 0) *why = strerror(errno);
    }
    if (fd >= 0) close(fd);
    return length;
}
