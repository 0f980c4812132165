/* SPDX-License-Identifier: MIT
 * Public keys and signatures in the format of minisign: two and four lines of text. All
 * cryptography is libsodium's.
 *
 *   untrusted comment: …          no key vouches for this line
 *   base64 of "Ed" ID KEY         a public key; or, of a signature:
 *   base64 of "ED" ID SIGNATURE   of the file's BLAKE2b-512 ("Ed": of the file itself)
 *   trusted comment: TEXT
 *   base64 of the signature of SIGNATURE TEXT
 */
#ifndef COMPBOX_HAL_LINUX_SIGNATURE_H
#define COMPBOX_HAL_LINUX_SIGNATURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    CB_KEY_ID_BYTES = 8,
    CB_KEY_BYTES = 32,
    CB_SIGNATURE_BYTES = 64,
    CB_MOST_SIGNATURE_TEXT = 10240, /* minisign's comments have at most 1 and 8 kB */
};

struct cb_public_key {
    uint8_t id[CB_KEY_ID_BYTES], key[CB_KEY_BYTES];
};

struct cb_signature {
    uint8_t id[CB_KEY_ID_BYTES];            /* of the key that made it */
    bool hashed;                            /* the signature is of the file's BLAKE2b-512 */
    uint8_t of_file[CB_SIGNATURE_BYTES];    /* … */
    uint8_t of_comment[CB_SIGNATURE_BYTES]; /* of of_file and the trusted comment */
    const char *comment;                    /* the trusted one, in the text that was parsed */
    size_t comment_length;
};

/* out: whether all of the text is a public key, and *key */
bool cb_public_key_parse(struct cb_public_key *key, const char *text, size_t length);

/* out: whether all of the text is a signature, and *signature, which points into the text */
bool cb_signature_parse(struct cb_signature *signature, const char *text, size_t length);

/* out: whether the key has signed exactly these bytes and the trusted comment. A normal thread's
 * work: it hashes the whole file. */
bool cb_signature_fits(const struct cb_signature *signature, const struct cb_public_key *key,
                       const void *bytes, size_t length);

#endif
