/* SPDX-License-Identifier: MIT */
#include "firmware/base/sha256.h"

#include <string.h>

enum { BLOCK = 64, LENGTH_AT = 56 }; /* bytes of a block; place of the length in the last one */

/* The first 32 bits of the fractions of the cube roots of the first 64 primes. */
static const uint32_t constants[64] = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

static uint32_t rotated(uint32_t word, unsigned bits) {
    return word >> bits | word << (32u - bits);
}

static uint32_t word_at(const uint8_t *bytes) {
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

static void put_word(uint8_t *bytes, uint32_t word) {
    for (unsigned i = 0; i < 4; i++) bytes[i] = (uint8_t)(word >> (24u - 8u * i));
}

/* in : block[BLOCK]. out: schedule[64], the words of the 64 rounds (FIPS 180-4, 6.2.2, step 1) */
static void expand(uint32_t *schedule, const uint8_t *block) {
    for (unsigned t = 0; t < 16; t++) schedule[t] = word_at(block + 4 * t);
    for (unsigned t = 16; t < 64; t++) {
        const uint32_t a = schedule[t - 15], b = schedule[t - 2];
        schedule[t] = schedule[t - 16] + (rotated(a, 7) ^ rotated(a, 18) ^ a >> 3) +
                      schedule[t - 7] + (rotated(b, 17) ^ rotated(b, 19) ^ b >> 10);
    }
}

/* Adds a block to the hash. in : hash[8], block[BLOCK] */
static void add_block(uint32_t *hash, const uint8_t *block) {
    uint32_t schedule[64], v[8];
    expand(schedule, block);
    memcpy(v, hash, sizeof v);
    for (unsigned t = 0; t < 64; t++) {
        const uint32_t e = v[4], a = v[0];
        const uint32_t chosen = (e & v[5]) ^ (~e & v[6]);
        const uint32_t most = (a & v[1]) ^ (a & v[2]) ^ (v[1] & v[2]);
        const uint32_t first = v[7] + (rotated(e, 6) ^ rotated(e, 11) ^ rotated(e, 25)) + chosen +
                               constants[t] + schedule[t];
        const uint32_t second = (rotated(a, 2) ^ rotated(a, 13) ^ rotated(a, 22)) + most;
        for (unsigned i = 7; i > 0; i--) v[i] = v[i - 1];
        v[4] += first;
        v[0] = first + second;
    }
    for (unsigned i = 0; i < 8; i++) hash[i] += v[i];
}

/* Adds the rest of the data, a one bit, zeros, and the length in bits.
 * in : bytes[length % BLOCK], behind the last whole block */
static void add_end(uint32_t *hash, const uint8_t *bytes, uint64_t length) {
    uint8_t last[2 * BLOCK] = {0};
    const size_t rest = (size_t)(length % BLOCK);
    const size_t end = rest < LENGTH_AT ? BLOCK : 2 * BLOCK;
    memcpy(last, bytes, rest);
    last[rest] = 0x80;
    put_word(last + end - 8, (uint32_t)(length >> 29));
    put_word(last + end - 4, (uint32_t)(length << 3));
    for (size_t at = 0; at < end; at += BLOCK) add_block(hash, last + at);
}

void cb_sha256(const void *data, size_t length, uint8_t *digest) {
    /* the same of the square roots of the first eight primes */
    uint32_t hash[8] = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                        0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    const uint8_t *bytes = data;
    const size_t whole = length - length % BLOCK;
    for (size_t at = 0; at < whole; at += BLOCK) add_block(hash, bytes + at);
    add_end(hash, bytes + whole, length);
    for (unsigned i = 0; i < 8; i++) put_word(digest + 4 * i, hash[i]);
}
