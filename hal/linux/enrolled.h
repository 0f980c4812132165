/* SPDX-License-Identifier: MIT
 * The keys enrolled in a folder, NAME.pub, and whether one of them has signed a file. The signature
 * of FILE is in FILE.minisig, or, while both are being replaced, in FILE.minisig.new: so a
 * signature that fits is there at every moment (docs/signing.md). */
#ifndef COMPBOX_HAL_LINUX_ENROLLED_H
#define COMPBOX_HAL_LINUX_ENROLLED_H

#include <stddef.h>

#define CB_SIGNATURE_SUFFIX ".minisig"

enum cb_enrolled {
    CB_ENROLLED_NONE,    /* the folder has no key: any file will do */
    CB_ENROLLED_SIGNED,  /* one of its keys has signed exactly these bytes */
    CB_ENROLLED_REFUSED, /* the message has a sentence with place and remedy */
};

/* in : folder; path of the file, which has these bytes (it is not read again); message[size]
 * out: the verdict; in message, if SIGNED, the file of the key. A key or a folder that cannot be
 *      read is a refusal. No state. */
enum cb_enrolled cb_enrolled_judge(const char *folder, const char *path, const void *bytes,
                                   size_t length, char *message, size_t size);

#endif
