/* SPDX-License-Identifier: MIT */
#include "hal/linux/hand.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/config/config.h"
#include "hal/linux/file_version.h"
#include "hal/linux/whole_file.h"

void cb_hand_start(struct cb_hand *hand, const char *path, uint32_t owner) {
    *hand = (struct cb_hand){.path = path, .owner = owner};
}

void cb_hand_follow(struct cb_hand *hand, const struct cb_config *config) {
    hand->used = false;
    for (unsigned i = 0; i < config->signals_count; ++i)
        hand->used |= config->signals[i].source == CB_SOURCE_HAND;
    hand->put_us = 0; /* the next samples belong to this file */
}

const char *cb_hand_fault(const struct stat *file, uint32_t owner) {
    if (!S_ISREG(file->st_mode)) return "is not a regular file";
    if (file->st_uid != 0 && file->st_uid != owner) return "belongs to another user";
    if (file->st_mode & (S_IWGRP | S_IWOTH)) return "can be written by other users";
    if (file->st_size > CB_HAND_BYTES) return "is too long";
    return NULL;
}

/* ---- one line */

/* out: the next word of *text as text of its own, and *text behind it; false: none, or too long */
static bool next_word(const char **text, char *word, size_t size) {
    *text += strspn(*text, " ");
    const size_t length = strcspn(*text, " ");
    if (length == 0 || length >= size) return false;
    memcpy(word, *text, length);
    word[length] = '\0';
    *text += length;
    return true;
}

static bool read_um(const char *word, float *um) {
    char *end = NULL;
    if (strspn(word, "0123456789.eE+-") != strlen(word)) return false; /* neither nan nor hex */
    *um = strtof(word, &end);
    return *end == '\0' && fabsf(*um) <= (float)CB_HAND_LARGEST_UM;
}

static bool read_whole(const char *word, int64_t most, int64_t *number) {
    char *end = NULL;
    if (strspn(word, "0123456789") != strlen(word) || strlen(word) > 12) return false;
    *number = strtoll(word, &end, 10);
    return *number <= most;
}

bool cb_hand_parse(const char *text, struct cb_hand_line *line) {
    char word[32];
    int64_t count = 0;
    if (!next_word(&text, word, sizeof word)) return false;
    line->key = cb_hand_key(word);
    if (line->key == 0 || !next_word(&text, word, sizeof word)) return false;
    if (!read_um(word, &line->um) || !next_word(&text, word, sizeof word)) return false;
    if (!read_whole(word, UINT16_MAX, &count) || !next_word(&text, word, sizeof word)) return false;
    line->count = (uint16_t)count;
    return read_whole(word, INT64_MAX, &line->unix_s) && text[strspn(text, " ")] == '\0';
}

/* ---- the file */

/* Reads the file through one descriptor, so that the file that is judged is the one that is read.
 * out: number of bytes in text[CB_HAND_BYTES + 1]; -1, and *why it is not accepted */
static long read_text(struct cb_hand *hand, char *text, const char **why) {
    const int fd = open(hand->path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    struct stat file;
    *why = "cannot be read";
    if (fd < 0) return -1;
    long length = -1;
    if (fstat(fd, &file) == 0) {
        hand->known = file;
        *why = cb_hand_fault(&file, hand->owner);
        if (*why == NULL) length = cb_read_to_end(fd, text, CB_HAND_BYTES + 1);
        if (*why == NULL && (length < 0 || length > CB_HAND_BYTES)) *why = "cannot be read";
    }
    close(fd);
    if (*why != NULL) return -1;
    text[length] = '\0';
    return length;
}

/* out: whether a signal of the file takes this name */
static bool is_wanted(const struct cb_config *config, uint32_t key) {
    for (unsigned i = 0; i < config->signals_count; ++i)
        if (config->signals[i].source == CB_SOURCE_HAND && config->signals[i].can_id == key)
            return true;
    return false;
}

/* out: the measurements of this name, a new entry if there was none; NULL: no room */
static struct cb_hand_measured *measured_of(struct cb_hand *hand, uint32_t key) {
    for (unsigned i = 0; i < hand->names; ++i)
        if (hand->measured[i].line.key == key) return &hand->measured[i];
    if (hand->names == CB_HAND_NAMES) return NULL;
    hand->measured[hand->names] = (struct cb_hand_measured){.line = {.key = key, .unix_s = -1}};
    return &hand->measured[hand->names++];
}

/* One look at the file. */
struct look {
    struct cb_hand *hand;
    const struct cb_config *config;
    int64_t unix_s;
    char *message;
    size_t size;
};

static void report_line(const struct look *look, const struct cb_hand_line *line,
                        const char *sentence) {
    char name[5] = "";
    unsigned length = 0;
    for (int shift = 24; shift >= 0; shift -= 8)
        if (line->key >> shift & 0xFF) name[length++] = (char)(line->key >> shift & 0xFF);
    const size_t used = strlen(look->message);
    snprintf(look->message + used, look->size - used, "%smeasured by hand: %s %.6g um %s",
             used > 0 ? "; " : "", name, (double)line->um, sentence);
}

/* Takes a line, or refuses it, unless it is known. What is refused is known from then on. */
static void take_line(const struct look *look, const struct cb_hand_line *line) {
    struct cb_hand_measured *of = measured_of(look->hand, line->key);
    if (of == NULL) return;
    const bool same = of->line.count == line->count && of->line.unix_s == line->unix_s;
    of->line = *line;
    if (same || !look->hand->begun) return;
    const int64_t age_s = look->unix_s - line->unix_s;
    if (!is_wanted(look->config, line->key)) {
        report_line(look, line, "is refused: no signal of the file has this name under hand");
    } else if (age_s > CB_HAND_OLDEST_S) {
        report_line(look, line, "is refused: it is older than 5 minutes; measure again");
    } else if (age_s < -CB_HAND_FUTURE_S) {
        report_line(look, line, "is refused: it is from the future by the clock");
    } else {
        of->um = line->um;
        ++of->count;
        look->hand->put_us = 0;
        report_line(look, line, "is taken");
    }
}

/* Takes all lines, or none if one is wrong. */
static void take_text(const struct look *look, char *text) {
    struct cb_hand_line lines[CB_HAND_NAMES];
    unsigned count = 0, number = 1;
    for (char *line = text; *line != '\0'; ++number) {
        const size_t length = strcspn(line, "\n");
        const bool more = line[length] == '\n';
        line[length] = '\0';
        if (count == CB_HAND_NAMES || !cb_hand_parse(line, &lines[count++])) {
            snprintf(look->message, look->size,
                     "%s: line %u is not NAME UM COUNT TIME; nothing of it is taken: use compbox "
                     "measured",
                     look->hand->path, number);
            return;
        }
        line += length + more;
    }
    for (unsigned i = 0; i < count; ++i) take_line(look, &lines[i]);
}

bool cb_hand_look(struct cb_hand *hand, const struct cb_config *config, int64_t now_us,
                  int64_t unix_us, char *message, size_t size) {
    char text[CB_HAND_BYTES + 2];
    const struct look look = {hand, config, unix_us / 1000000, message, size};
    struct stat file;
    const char *why = NULL;
    if (!hand->used || (hand->begun && now_us - hand->looked_us < CB_HAND_LOOK_US)) return false;
    hand->looked_us = now_us;
    message[0] = '\0';
    if (lstat(hand->path, &file) == 0 && !cb_same_version(&file, &hand->known)) {
        hand->known = file;
        if (read_text(hand, text, &why) >= 0)
            take_text(&look, text);
        else
            snprintf(message, size, "%s: %s, so no measurement is taken", hand->path, why);
    }
    hand->begun = true;
    return message[0] != '\0';
}

/* in : part: CB_HAND_VALUE or CB_HAND_COUNT. out: the ring had room for all signals with it */
static bool put_part(struct cb_hand *hand, const struct cb_config *config, uint8_t part,
                     uint32_t generation, struct cb_sample_ring *to) {
    bool all = true;
    for (unsigned i = 0; i < config->signals_count; ++i) {
        const struct cb_signal_config *signal = &config->signals[i];
        if (signal->source != CB_SOURCE_HAND || signal->bus != part) continue;
        const struct cb_hand_measured *of = measured_of(hand, signal->can_id);
        if (of == NULL) continue;
        const float raw = part == CB_HAND_COUNT ? (float)of->count : of->um;
        const struct cb_sample sample = {(uint8_t)i, raw, hand->put_us};
        all = cb_sample_ring_put(to, sample, generation) && all;
    }
    return all;
}

/* A count says that its value is new, so all values come first. */
void cb_hand_put(struct cb_hand *hand, const struct cb_config *config, uint32_t generation,
                 struct cb_sample_ring *to, int64_t now_us) {
    if (!hand->used || (hand->put_us != 0 && now_us - hand->put_us < CB_HAND_LOOK_US)) return;
    hand->put_us = now_us;
    if (put_part(hand, config, CB_HAND_VALUE, generation, to))
        put_part(hand, config, CB_HAND_COUNT, generation, to);
}
