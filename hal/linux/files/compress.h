/* SPDX-License-Identifier: MIT
 * Compression of a file in small slices, by zlib, in fixed memory; one file at a time. Built where
 * zlib is found (CB_HAS_ZLIB). */
#ifndef COMPBOX_HAL_LINUX_FILES_COMPRESS_H
#define COMPBOX_HAL_LINUX_FILES_COMPRESS_H

enum {
    CB_COMPRESS_SLICE = 32768, /* bytes of the file for each step */
    CB_COMPRESS_MORE = -1,     /* no errno: a write may fail with any of them */
};

/* Begins `to` from the content of `from`. out: 0, or errno, and nothing is begun */
int cb_compress_begin(const char *from, const char *to);

/* Compresses a slice. out: CB_COMPRESS_MORE; 0: `to` is whole and on the disk; else errno. It has
 * ended unless there is more. */
int cb_compress_step(void);

/* Ends a compression that goes on; its files stay. */
void cb_compress_abandon(void);

#endif
