/* SPDX-License-Identifier: MIT */
#include "hal/linux/enrolled.h"

#include <dirent.h>
#include <errno.h>
#include <fnmatch.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "hal/linux/signature.h"
#include "hal/linux/whole_file.h"

enum { MOST_PATH = 4300 };

/* A sentence for the caller. */
struct message {
    char *text;
    size_t size;
};

static __attribute__((format(printf, 2, 3))) void report(const struct message *message,
                                                         const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message->text, message->size, format, arguments);
    va_end(arguments);
}

/* A signature with the bytes that it is for. */
struct question {
    const struct cb_signature *signature; /* NULL: keys are only counted */
    const void *bytes;
    size_t length;
};

/* What the keys of a folder say. */
struct answer {
    int keys;   /* -1: one cannot be read; the sentence is reported */
    bool known; /* one of them has the id of the signature */
    bool fits;  /* … and made it; the message has its path */
};

static bool is_key_name(const char *name) {
    return fnmatch("*.pub", name, FNM_PERIOD) == 0;
}

/* out: false: it is no key, and the sentence is reported */
static bool read_key(const char *path, struct cb_public_key *key, const struct message *message) {
    char text[CB_MOST_SIGNATURE_TEXT];
    struct stat there;
    const char *why = "";
    const long length = cb_whole_file_read(path, text, sizeof text, &there, &why);
    if (length < 0)
        report(message, "%s: cannot be read: %s", path, why);
    else if (!cb_public_key_parse(key, text, (size_t)length))
        report(message, "%s: is not a public key of minisign's format; replace or remove it", path);
    else
        return true;
    return false;
}

/* Asks one key. out: false: it cannot be read */
static bool ask(const char *path, const struct question *question, struct answer *answer,
                const struct message *message) {
    struct cb_public_key key;
    const struct cb_signature *signature = question->signature;
    if (!read_key(path, &key, message)) return false;
    answer->keys++;
    if (signature == NULL || memcmp(key.id, signature->id, sizeof key.id) != 0) return true;
    answer->known = true;
    if (answer->fits || !cb_signature_fits(signature, &key, question->bytes, question->length))
        return true;
    answer->fits = true;
    report(message, "%s", path);
    return true;
}

/* out: the path of the next key; false: there is no other one, or errno is not 0. A folder that
 * cannot be read to its end must not pass for one without keys. */
static bool next_key(DIR *opened, const char *folder, char path[MOST_PATH]) {
    const struct dirent *entry;
    do {
        errno = 0;
        entry = readdir(opened);
    } while (entry != NULL && !is_key_name(entry->d_name));
    if (entry == NULL) return false;
    snprintf(path, MOST_PATH, "%s/%s", folder, entry->d_name);
    return true;
}

static struct answer report_folder(const char *folder, const struct message *message) {
    report(message, "%s: cannot be read: %s; make this folder, or leave --keys out", folder,
           strerror(errno));
    return (struct answer){.keys = -1};
}

/* Asks every key of the folder: one that is damaged is reported, whatever the others say. */
static struct answer ask_all(const char *folder, const struct question *question,
                             const struct message *message) {
    struct answer answer = {.keys = 0};
    char path[MOST_PATH];
    DIR *opened = opendir(folder);
    if (opened == NULL) return report_folder(folder, message);
    while (answer.keys >= 0 && next_key(opened, folder, path))
        if (!ask(path, question, &answer, message)) answer.keys = -1;
    if (answer.keys >= 0 && errno != 0) answer = report_folder(folder, message);
    closedir(opened);
    return answer;
}

/* Reads and parses PATH.minisig or PATH.minisig.new, and asks the keys. out: as
 * cb_enrolled_judge(), but never NONE */
static enum cb_enrolled judge(const char *folder, const char *path, const char *suffix,
                              struct question question, const struct message *message) {
    char place[MOST_PATH], text[CB_MOST_SIGNATURE_TEXT];
    struct cb_signature signature;
    struct stat there;
    const char *why = "";
    snprintf(place, sizeof place, "%s%s", path, suffix);
    const long length = cb_whole_file_read(place, text, sizeof text, &there, &why);
    if (length < 0) {
        report(message, "%s: is not signed: %s: %s; sign it with compbox sign", path, place, why);
        return CB_ENROLLED_REFUSED;
    }
    if (!cb_signature_parse(&signature, text, (size_t)length)) {
        report(message, "%s: is not a signature of minisign's format; sign %s again", place, path);
        return CB_ENROLLED_REFUSED;
    }
    question.signature = &signature;
    const struct answer answer = ask_all(folder, &question, message);
    if (answer.keys < 0) return CB_ENROLLED_REFUSED;
    if (answer.fits) return CB_ENROLLED_SIGNED;
    if (answer.known)
        report(message, "%s: is not what was signed, or %s was changed; sign it again", path,
               place);
    else
        report(message, "%s: no key in %s has signed it; enrol the key, or sign it with another",
               path, folder);
    return CB_ENROLLED_REFUSED;
}

enum cb_enrolled cb_enrolled_judge(const char *folder, const char *path, const void *bytes,
                                   size_t length, char *text, size_t size) {
    const struct message message = {text, size};
    const struct question question = {.bytes = bytes, .length = length};
    char other[MOST_PATH];
    const int keys = ask_all(folder, &question, &message).keys;
    if (keys <= 0) return keys < 0 ? CB_ENROLLED_REFUSED : CB_ENROLLED_NONE;
    if (judge(folder, path, CB_SIGNATURE_SUFFIX, question, &message) == CB_ENROLLED_SIGNED)
        return CB_ENROLLED_SIGNED;
    const struct message second = {other, sizeof other};
    if (judge(folder, path, CB_SIGNATURE_SUFFIX ".new", question, &second) != CB_ENROLLED_SIGNED)
        return CB_ENROLLED_REFUSED;
    report(&message, "%s", other);
    return CB_ENROLLED_SIGNED;
}
