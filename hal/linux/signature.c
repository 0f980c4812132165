/* SPDX-License-Identifier: MIT */
#include "hal/linux/signature.h"

#include <sodium.h>
#include <string.h>

_Static_assert(CB_KEY_BYTES == crypto_sign_PUBLICKEYBYTES, "a key of Ed25519");
_Static_assert(CB_SIGNATURE_BYTES == crypto_sign_BYTES, "a signature of Ed25519");

enum { HASH_BYTES = 64, ALGORITHM_BYTES = 2 };

struct text {
    const char *at;
    size_t left;
};

/* Takes the next line, which must begin with `prefix` and end with a newline.
 * out: true and *line without both */
static bool take_line(struct text *text, const char *prefix, struct text *line) {
    const size_t skipped = strlen(prefix);
    size_t length = 0;
    while (length < text->left && text->at[length] != '\n') length++;
    if (length == text->left || length < skipped || memcmp(text->at, prefix, skipped) != 0)
        return false;
    *line = (struct text){text->at + skipped, length - skipped};
    text->at += length + 1;
    text->left -= length + 1;
    return true;
}

/* Takes a line of base64 that stands for exactly `size` bytes, at most those of an algorithm, an id
 * and a signature. The decoder of libsodium 1.0.18 takes each byte above 127 for a slash, so the
 * line must be what its encoder makes of the bytes. */
static bool take_bytes(struct text *text, uint8_t *bytes, size_t size) {
    char again[sodium_base64_ENCODED_LEN(ALGORITHM_BYTES + CB_KEY_ID_BYTES + CB_SIGNATURE_BYTES,
                                         sodium_base64_VARIANT_ORIGINAL)];
    struct text line;
    size_t length = 0;
    if (!take_line(text, "", &line) ||
        line.left + 1 != sodium_base64_encoded_len(size, sodium_base64_VARIANT_ORIGINAL) ||
        sodium_base642bin(bytes, size, line.at, line.left, NULL, &length, NULL,
                          sodium_base64_VARIANT_ORIGINAL) != 0 ||
        length != size)
        return false;
    sodium_bin2base64(again, sizeof again, bytes, size, sodium_base64_VARIANT_ORIGINAL);
    return memcmp(again, line.at, line.left) == 0;
}

bool cb_public_key_parse(struct cb_public_key *key, const char *text, size_t length) {
    struct text rest = {text, length}, comment;
    uint8_t bytes[ALGORITHM_BYTES + CB_KEY_ID_BYTES + CB_KEY_BYTES];
    if (!take_line(&rest, "untrusted comment: ", &comment) ||
        !take_bytes(&rest, bytes, sizeof bytes) || rest.left != 0 || memcmp(bytes, "Ed", 2) != 0)
        return false;
    memcpy(key->id, bytes + ALGORITHM_BYTES, sizeof key->id);
    memcpy(key->key, bytes + ALGORITHM_BYTES + sizeof key->id, sizeof key->key);
    return true;
}

bool cb_signature_parse(struct cb_signature *signature, const char *text, size_t length) {
    struct text rest = {text, length}, comment, trusted;
    uint8_t bytes[ALGORITHM_BYTES + CB_KEY_ID_BYTES + CB_SIGNATURE_BYTES];
    if (length >= CB_MOST_SIGNATURE_TEXT || !take_line(&rest, "untrusted comment: ", &comment) ||
        !take_bytes(&rest, bytes, sizeof bytes) ||
        !take_line(&rest, "trusted comment: ", &trusted) ||
        !take_bytes(&rest, signature->of_comment, sizeof signature->of_comment) || rest.left != 0)
        return false;
    signature->hashed = memcmp(bytes, "ED", 2) == 0;
    if (!signature->hashed && memcmp(bytes, "Ed", 2) != 0) return false;
    memcpy(signature->id, bytes + ALGORITHM_BYTES, sizeof signature->id);
    memcpy(signature->of_file, bytes + ALGORITHM_BYTES + sizeof signature->id,
           sizeof signature->of_file);
    signature->comment = trusted.at;
    signature->comment_length = trusted.left;
    return true;
}

/* The comment is shorter than CB_MOST_SIGNATURE_TEXT, as parsed. */
static bool comment_fits(const struct cb_signature *signature, const struct cb_public_key *key) {
    uint8_t whole[CB_SIGNATURE_BYTES + CB_MOST_SIGNATURE_TEXT];
    memcpy(whole, signature->of_file, CB_SIGNATURE_BYTES);
    memcpy(whole + CB_SIGNATURE_BYTES, signature->comment, signature->comment_length);
    return crypto_sign_verify_detached(signature->of_comment, whole,
                                       CB_SIGNATURE_BYTES + signature->comment_length,
                                       key->key) == 0;
}

bool cb_signature_fits(const struct cb_signature *signature, const struct cb_public_key *key,
                       const void *bytes, size_t length) {
    uint8_t hash[HASH_BYTES];
    if (sodium_init() < 0 || memcmp(signature->id, key->id, sizeof key->id) != 0) return false;
    if (signature->hashed) {
        if (crypto_generichash(hash, sizeof hash, bytes, length, NULL, 0) != 0) return false;
        bytes = hash;
        length = sizeof hash;
    }
    return crypto_sign_verify_detached(signature->of_file, bytes, length, key->key) == 0 &&
           comment_fits(signature, key);
}
