/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/compress.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <unistd.h>
#include <zlib.h>

#include "hal/linux/files/output_file.h"

/* deflate takes 262 KiB for its window of 32 KiB. */
enum { ARENA = 300 * 1024, WINDOW_BITS = 15, GZIP = 16, MEMORY_LEVEL = 8, ALIGNMENT = 16 };

static struct {
    bool runs;
    int from, to;
    z_stream stream;
    size_t arena_used;
    _Alignas(ALIGNMENT) unsigned char arena[ARENA];
    unsigned char in[CB_COMPRESS_SLICE], out[CB_COMPRESS_SLICE];
} job;

/* zlib's allocation: a slice of the arena; all of it is free with the next file. */
static void *allocate(void *unused, unsigned count, unsigned size) {
    const size_t bytes = ((size_t)count * size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    (void)unused;
    if (bytes > sizeof job.arena - job.arena_used) return NULL;
    job.arena_used += bytes;
    return job.arena + job.arena_used - bytes;
}

static void release(void *unused, void *block) {
    (void)unused;
    (void)block;
}

/* out: 0, or errno */
static int start_stream(void) {
    job.arena_used = 0;
    job.stream = (z_stream){.zalloc = allocate, .zfree = release};
    const int made = deflateInit2(&job.stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED,
                                  WINDOW_BITS + GZIP, MEMORY_LEVEL, Z_DEFAULT_STRATEGY);
    return made == Z_OK ? 0 : ENOMEM;
}

int cb_compress_begin(const char *from, const char *to) {
    job.from = open(from, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (job.from < 0) return errno;
    job.to = cb_output_open(to);
    const int error = job.to < 0 ? errno : start_stream();
    job.runs = true;
    if (error != 0) cb_compress_abandon();
    return error;
}

void cb_compress_abandon(void) {
    if (!job.runs) return;
    job.runs = false;
    close(job.from);
    if (job.to >= 0) close(job.to);
}

/* Compresses the stream's input and writes it. out: 0, or errno */
static int put(int flush) {
    do {
        job.stream.next_out = job.out;
        job.stream.avail_out = sizeof job.out;
        if (deflate(&job.stream, flush) == Z_STREAM_ERROR) return EINVAL;
        const size_t bytes = sizeof job.out - job.stream.avail_out;
        if (cb_output_write(job.to, job.out, bytes) != bytes) return errno;
    } while (job.stream.avail_out == 0);
    return 0;
}

/* Closes both files, with `to` on the disk. out: 0, or errno */
static int finish(void) {
    const int error = cb_output_close(job.to, put(Z_FINISH), true);
    job.to = -1;
    return error;
}

int cb_compress_step(void) {
    const ssize_t bytes = read(job.from, job.in, sizeof job.in);
    if (bytes < 0 && errno == EINTR) return CB_COMPRESS_MORE;
    int error = bytes < 0 ? errno : 0;
    if (bytes > 0) {
        job.stream.next_in = job.in;
        job.stream.avail_in = (unsigned)bytes;
        error = put(Z_NO_FLUSH);
        if (error == 0) return CB_COMPRESS_MORE;
    }
    if (bytes == 0) error = finish();
    cb_compress_abandon();
    return error;
}
