/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/archive.h"

#include <errno.h>
#include <stdio.h>
#include <unistd.h>

#include "hal/linux/files/compress.h"
#include "hal/linux/files/output_file.h"

void cb_archive_start(struct cb_archive *archive, const char *path, int64_t most_bytes) {
    *archive = (struct cb_archive){.path = path, .most_bytes = most_bytes};
    const int length = snprintf(archive->temporary, sizeof archive->temporary, "%s.gz.new", path);
    /* It is as long as the longest name that is kept, PATH.999.gz. */
    if (most_bytes == 0 || length >= (int)sizeof archive->temporary) return;
    unlink(archive->temporary);
    archive->number = 1;
}

int64_t cb_archive_piece(const struct cb_archive *archive) {
    return archive->most_bytes > 0 ? archive->most_bytes / CB_ARCHIVE_SHARE : INT64_MAX;
}

/* Removes the oldest files beyond so many bytes of all. A file whose size cannot be read, or which
 * stays, ends it: the newer ones would go in its place. */
static void trim(const struct cb_archive *archive, int64_t most_bytes) {
    int64_t bytes, all = 0;
    unsigned last = 0;
    while ((bytes = cb_rotate_bytes(archive->path, last + 1)) >= 0) {
        all += bytes;
        last++;
    }
    for (; last > 1 && all > most_bytes; last--) {
        bytes = cb_rotate_bytes(archive->path, last);
        if (bytes < 0 || cb_rotate_remove(archive->path, last) != 0) return;
        all -= bytes;
    }
}

int cb_archive_keep(struct cb_archive *archive) {
    const bool limited = archive->most_bytes > 0;
    cb_archive_finish(archive);
    const int error = cb_rotate(archive->path, CB_ARCHIVE_FILES, limited);
    cb_output_sync_folder(archive->path); /* a power cut leaves the old names or the new ones */
    if (error != 0 || !limited) return error;
    trim(archive, archive->most_bytes - 2 * cb_archive_piece(archive));
    archive->number = 1;
    return 0;
}

#if CB_HAS_ZLIB
/* Puts the compressed file in the place of the other one. out: 0, or errno */
static int replace(struct cb_archive *archive, const char *plain) {
    char compressed[CB_ROTATE_NAME];
    cb_rotate_name(compressed, archive->path, archive->number, true);
    if (rename(archive->temporary, compressed) != 0) return errno;
    cb_output_sync_folder(compressed);
    return unlink(plain) == 0 ? 0 : errno;
}

/* Looks at one number. A plain file whose compressed one is there is a crash's rest. out: 0;
 * CB_COMPRESS_MORE: its compression begins; or errno */
static int look(struct cb_archive *archive, const char *plain) {
    char compressed[CB_ROTATE_NAME];
    if (cb_rotate_bytes(archive->path, archive->number) < 0) return ENOENT;
    cb_rotate_name(compressed, archive->path, archive->number, true);
    if (access(plain, F_OK) != 0) return 0;
    if (access(compressed, F_OK) == 0) return unlink(plain) == 0 ? 0 : errno;
    const int error = cb_compress_begin(plain, archive->temporary);
    archive->compresses = error == 0;
    return error == 0 ? CB_COMPRESS_MORE : error;
}

void cb_archive_work(struct cb_archive *archive) {
    char plain[CB_ROTATE_NAME];
    if (archive->number == 0) return;
    cb_rotate_name(plain, archive->path, archive->number, false);
    int error = archive->compresses ? cb_compress_step() : look(archive, plain);
    if (error == CB_COMPRESS_MORE) return;
    if (error == 0 && archive->compresses) error = replace(archive, plain);
    archive->error = error == ENOENT ? 0 : error;
    if (archive->error != 0 && archive->compresses) unlink(archive->temporary);
    archive->compresses = false;
    archive->number = error == 0 ? archive->number + 1 : 0;
}

void cb_archive_finish(struct cb_archive *archive) {
    if (!archive->compresses) return;
    cb_compress_abandon();
    unlink(archive->temporary);
    archive->compresses = false;
}
#else
void cb_archive_work(struct cb_archive *archive) {
    archive->number = 0;
}

void cb_archive_finish(struct cb_archive *archive) {
    (void)archive;
}
#endif
