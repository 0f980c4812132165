/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/rotate.h"

#include <errno.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

enum { NAME = 4096, FORMS = 2 }; /* plain and compressed */

/* out: false: PATH.N does not fit into name[NAME] */
static bool has_name(char *name, const char *path, unsigned n, unsigned form) {
    const char *end = form > 0 ? ".gz" : "";
    const int length =
        n == 0 ? snprintf(name, NAME, "%s", path) : snprintf(name, NAME, "%s.%u%s", path, n, end);
    return length < NAME;
}

/* out: 0: PATH.N is there; or errno */
static int look(const char *path, unsigned n) {
    char name[NAME];
    struct stat there;
    for (unsigned form = 0; form < FORMS; form++) {
        if (!has_name(name, path, n, form)) return ENAMETOOLONG;
        if (lstat(name, &there) == 0) return 0;
        if (errno != ENOENT) return errno;
    }
    return ENOENT;
}

/* Renames both forms of PATH.N to the next number. out: 0, or errno */
static int move(const char *path, unsigned n) {
    char from[NAME], to[NAME];
    for (unsigned form = 0; form < (n == 0 ? 1 : FORMS); form++) {
        if (!has_name(from, path, n, form) || !has_name(to, path, n + 1, form)) return ENAMETOOLONG;
        if (rename(from, to) != 0 && errno != ENOENT) return errno;
    }
    return 0;
}

static int remove_both(const char *path, unsigned n) {
    char name[NAME];
    for (unsigned form = 0; form < FORMS; form++) {
        if (!has_name(name, path, n, form)) return ENAMETOOLONG;
        if (unlink(name) != 0 && errno != ENOENT) return errno;
    }
    return 0;
}

int cb_rotate(const char *path, unsigned most, bool may_remove) {
    unsigned free = 1;
    int error;
    while ((error = look(path, free)) == 0 && free < most) free++;
    if (error == 0) error = may_remove ? remove_both(path, most) : EEXIST;
    if (error != 0 && error != ENOENT) return error;
    for (unsigned n = free; n > 0; n--)
        if ((error = move(path, n - 1)) != 0) return error;
    return 0;
}
