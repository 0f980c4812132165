/* SPDX-License-Identifier: MIT
 * Measurements that a person makes by hand, for the signals with the source `hand`. `compbox
 * measured` replaces a file with a line for each name:
 *
 *     X 4.2 17 1790000000        name, um, count, and seconds since 1970
 *
 * The normal thread reads it when it changes. A line whose count or time differs from the last one
 * of its name is one measurement, and counts the signal up by one. What the file has at the start
 * is no measurement, because the previous run may have taken it. */
#ifndef COMPBOX_HAL_LINUX_HAND_H
#define COMPBOX_HAL_LINUX_HAND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>

#include "hal/linux/sample_ring.h"

struct cb_config;

enum {
    CB_HAND_NAMES = 16,           /* most names in a file */
    CB_HAND_BYTES = 2048,         /* most bytes of the file */
    CB_HAND_LOOK_US = 500000,     /* interval of looks, and of samples */
    CB_HAND_OLDEST_S = 300,       /* an older measurement is refused */
    CB_HAND_FUTURE_S = 60,        /* as is one from further in the future */
    CB_HAND_LARGEST_UM = 1000000, /* a larger value is a mistake of the unit */
};

/* One line of the file. */
struct cb_hand_line {
    uint32_t key; /* cb_hand_key() of its name */
    float um;
    uint16_t count;
    int64_t unix_s;
};

/* The measurements of one name, as the box has them. */
struct cb_hand_measured {
    struct cb_hand_line line; /* the last one seen of this name */
    float um;                 /* of the last measurement; 0 before the first one */
    uint16_t count;           /* measurements since the start; wraps */
};

struct cb_hand {
    const char *path;  /* of the file */
    uint32_t owner;    /* user who may own it, beside root */
    bool used;         /* the coefficient file has such signals */
    bool begun;        /* the file of the start was looked at */
    struct stat known; /* of the file when it was last read; 0: there was none */
    int64_t looked_us, put_us;
    unsigned names;
    struct cb_hand_measured measured[CB_HAND_NAMES];
};

/* in : path stays valid; owner: the user of this process. Keeps nothing of an earlier run. */
void cb_hand_start(struct cb_hand *hand, const char *path, uint32_t owner);

/* The signals of another coefficient file: counts and values go on by name. */
void cb_hand_follow(struct cb_hand *hand, const struct cb_config *config);

/* Reads the file if it has changed, at most every CB_HAND_LOOK_US.
 * in : now_us, unix_us: now, on both clocks; config: the running one
 * out: true: message[size] has a sentence about what was taken or refused */
bool cb_hand_look(struct cb_hand *hand, const struct cb_config *config, int64_t now_us,
                  int64_t unix_us, char *message, size_t size);

/* Puts value and count of each signal into the ring: every CB_HAND_LOOK_US, so that they stay
 * fresh, and at once after a measurement. No count comes before the values. */
void cb_hand_put(struct cb_hand *hand, const struct cb_config *config, uint32_t generation,
                 struct cb_sample_ring *to, int64_t now_us);

/* out: why the file is not accepted, as "belongs to another user"; NULL: it is */
const char *cb_hand_fault(const struct stat *file, uint32_t owner);

/* in : text: one line, ended by 0, without its line end
 * out: true and *line; false: it is not NAME UM COUNT TIME within the ranges above */
bool cb_hand_parse(const char *text, struct cb_hand_line *line);

#endif
