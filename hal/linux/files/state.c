/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/state.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/timex.h>
#include <unistd.h>

#include "firmware/base/crc32.h"
#include "hal/linux/clock.h"
#include "hal/linux/files/output_file.h"
#include "hal/linux/whole_file.h"

/* The file: a header, `count` records, `probes` of them, the ending, and the CRC-32 of all that.
 * Its byte order is the machine's, which the format number reveals. */
struct header {
    char magic[8];
    uint32_t format; /* 4 with probes, else 3; 2 lacked the ending, 1 had the wall clock alone */
    uint32_t count;
    char machine[40];
    char boot_id[CB_BOOT_ID_SIZE];
    uint32_t synchronised; /* 1: unix_us was synchronised at the time of writing */
    uint32_t probes;       /* 0 before format 4 */
};

struct record { /* of a lag of a bank: no name, and in `input` the value of lag_of itself */
    char name[CB_NAME_SIZE], lag_of[CB_NAME_SIZE];
    int64_t unix_us;     /* of the last value … */
    int64_t boottime_us; /* … and by the clock of this boot */
    float hi, lo, input, tau_s;
    uint32_t power;
    uint32_t range; /* of a lag of a bank: CRC-32 of the range of its input; 0 in older files */
};

struct probe { /* of a term of type adapt */
    char name[CB_NAME_SIZE], of[CB_NAME_SIZE];
    int64_t unix_us;     /* up to which its covariance has grown … */
    int64_t boottime_us; /* … and by the clock of this boot */
    struct cb_adapt filter;
    uint32_t taken, asked, refused, skipped, count;
};

_Static_assert(sizeof(struct probe) == 160, "no byte between its fields");

/* After the last record, from format 3 on. */
struct ending {
    int64_t unix_us;     /* of the PLC's heartbeat … */
    int64_t boottime_us; /* … and by the clock of this boot */
    uint32_t plc_heartbeat;
    uint32_t beat;     /* 1: the heartbeat was read */
    uint32_t stopped;  /* 1: the run ended STOPPED */
    uint32_t revision; /* of the file that ran; 0 in files of versions that did not keep it */
};

enum { MOST_RECORDS = CB_MAX_SIGNALS + CB_MAX_BANK_LAGS };

struct file {
    struct header header;
    struct record records[MOST_RECORDS];
    struct probe probes[CB_MAX_ADAPTS];
    struct ending ending; /* probes, ending and CRC follow the last record in use */
    uint32_t crc;
    char more; /* of a file that is too long */
};

static const char MAGIC[8] = "CBSTATE";
enum { FORMAT = 4, FORMAT_WITHOUT_PROBES = 3, FORMAT_WITHOUT_ENDING = 2 };

/* A short read must not make a boot look like another one.
 * out: the line without its end, or "" if it is not complete */
static void read_boot_id(char boot_id[static CB_BOOT_ID_SIZE]) {
    const int fd = open("/proc/sys/kernel/random/boot_id", O_RDONLY | O_CLOEXEC);
    const long size = fd < 0 ? -1 : cb_read_to_end(fd, boot_id, CB_BOOT_ID_SIZE - 1);
    if (fd >= 0) close(fd);
    const bool whole = size > 0 && boot_id[size - 1] == '\n';
    boot_id[whole ? size - 1 : 0] = '\0';
}

void cb_state_clock_read(struct cb_state_clock *clock) {
    struct timex query = {.modes = 0};
    memset(clock, 0, sizeof *clock);
    const int state = adjtimex(&query);
    clock->synchronised = state >= 0 && state != TIME_ERROR; /* TIME_ERROR: it is not */
    read_boot_id(clock->boot_id);
    clock->boottime_us = cb_boottime_us();
    clock->unix_us = cb_unix_us();
}

/* ---- writing ---- */

static struct ending ending_of(const struct cb_state *state, const struct cb_config *config,
                               const struct cb_state_clock *now) {
    return (struct ending){.unix_us = state->beat_us + (now->unix_us - now->boottime_us),
                           .boottime_us = state->beat_us,
                           .plc_heartbeat = state->plc_heartbeat,
                           .beat = state->beat,
                           .stopped = state->stopped,
                           .revision = config->revision};
}

/* out: what differs for two lags of a bank whose input acts within different ranges */
static uint32_t range_of(const struct cb_bank_key *key) {
    const float range[2] = {key->low, key->high};
    return cb_crc32(0, range, sizeof range);
}

/* Appends a record, complete but for name and state of the lag. in: signal, that it follows */
static struct record *add(struct file *file, const struct cb_signal_config *signal, int64_t time_us,
                          const struct cb_state_clock *now) {
    struct record *record = &file->records[file->header.count++];
    memcpy(record->lag_of, signal->name, sizeof record->lag_of);
    record->boottime_us = time_us;
    record->unix_us = time_us + (now->unix_us - now->boottime_us);
    return record;
}

static void add_lags(struct file *file, const struct cb_state *state,
                     const struct cb_config *config, const struct cb_state_clock *now) {
    for (unsigned i = 0; i < config->signals_count; i++) {
        const struct cb_signal_config *signal = &config->signals[i];
        const struct cb_lag_state *lag = &state->lags[i];
        if (signal->source != CB_SOURCE_LAG || !lag->settled) continue;
        struct record *record = add(file, &config->signals[signal->lag_of], lag->time_us, now);
        memcpy(record->name, signal->name, sizeof record->name);
        record->hi = lag->lag.hi;
        record->lo = lag->lag.lo;
        record->input = lag->lag.input;
        record->tau_s = signal->tau_s;
        record->power = signal->power;
    }
}

static void add_bank(struct file *file, const struct cb_state *state,
                     const struct cb_config *config, const struct cb_state_clock *now) {
    const struct cb_bank_state *bank = &state->bank;
    for (unsigned i = 0; i < config->bank_lags_count; i++) {
        const struct cb_bank_key key = cb_bank_key_of(config, i);
        if (!cb_bank_is_settled(bank, i)) continue;
        struct record *record =
            add(file, &config->signals[key.signal], bank->time_us[key.signal], now);
        record->hi = bank->lags[i].hi;
        record->lo = bank->lags[i].lo;
        record->input = bank->value[key.signal];
        record->tau_s = key.tau_s;
        record->power = key.power;
        record->range = range_of(&key);
    }
}

/* out: the record of the term with index i in config->adapts */
static struct probe probe_of(const struct cb_config *config, unsigned i,
                             const struct cb_probe_state *state, const struct cb_state_clock *now) {
    const struct cb_term_config *term = &config->terms[config->adapts[i]];
    struct probe probe = {.boottime_us = state->grown_us,
                          .unix_us = state->grown_us + (now->unix_us - now->boottime_us),
                          .filter = state->filter,
                          .taken = state->taken,
                          .asked = state->asked,
                          .refused = state->refused,
                          .skipped = state->skipped,
                          .count = state->count};
    memcpy(probe.name, config->outputs[term->first_output].name, sizeof probe.name);
    memcpy(probe.of, config->outputs[term->as.adapt.output].name, sizeof probe.of);
    return probe;
}

/* Appends the probes behind the first `size` bytes. out: the new size */
static size_t add_probes(struct file *file, size_t size, const struct cb_state *state,
                         const struct cb_config *config, const struct cb_state_clock *now) {
    for (unsigned i = 0; i < config->adapts_count; i++) {
        if (!state->probes[i].timed) continue;
        const struct probe probe = probe_of(config, i, &state->probes[i], now);
        memcpy((char *)file + size, &probe, sizeof probe);
        size += sizeof probe;
        file->header.probes++;
    }
    file->header.format = file->header.probes > 0 ? FORMAT : FORMAT_WITHOUT_PROBES;
    return size;
}

/* in : now: both clocks at one moment
 * out: the complete file with its CRC; result: its length in bytes */
static size_t fill(struct file *file, const struct cb_state *state, const struct cb_config *config,
                   const struct cb_state_clock *now) {
    memset(file, 0, sizeof *file);
    memcpy(file->header.magic, MAGIC, sizeof MAGIC);
    memcpy(file->header.machine, config->machine, sizeof config->machine);
    memcpy(file->header.boot_id, now->boot_id, sizeof now->boot_id);
    file->header.synchronised = now->synchronised;
    add_lags(file, state, config, now);
    add_bank(file, state, config, now);
    size_t size = sizeof file->header + file->header.count * sizeof file->records[0];
    size = add_probes(file, size, state, config, now);
    const struct ending ending = ending_of(state, config, now);
    memcpy((char *)file + size, &ending, sizeof ending);
    size += sizeof ending;
    const uint32_t crc = cb_crc32(0, file, (uint32_t)size);
    memcpy((char *)file + size, &crc, sizeof crc);
    return size + sizeof crc;
}

int cb_state_write(const struct cb_state *state, const struct cb_config *config, const char *path,
                   const struct cb_state_clock *now) {
    struct file file;
    return cb_output_whole(path, &file, fill(&file, state, config, now), true);
}

/* ---- reading ---- */

static size_t records_of(const struct header *header) {
    return sizeof *header + (size_t)header->count * sizeof(struct record);
}

/* out: number of probes; 0 in the formats without */
static uint32_t probes_of(const struct header *header) {
    return header->format == FORMAT ? header->probes : 0;
}

/* out: number of bytes under the CRC */
static size_t body_of(const struct header *header) {
    const size_t all = records_of(header) + probes_of(header) * sizeof(struct probe);
    return header->format == FORMAT_WITHOUT_ENDING ? all : all + sizeof(struct ending);
}

/* out: the fault of the file as a whole, or NULL */
static const char *fault_of(const struct file *file, size_t size) {
    const struct header *header = &file->header;
    if (size < sizeof *header + sizeof file->crc || memcmp(header->magic, MAGIC, sizeof MAGIC) != 0)
        return "is no state file";
    if (header->format < FORMAT_WITHOUT_ENDING || header->format > FORMAT)
        return "is of another version";
    const size_t body = body_of(header);
    if (header->count > MOST_RECORDS || probes_of(header) > CB_MAX_ADAPTS ||
        size != body + sizeof file->crc)
        return "has the wrong length";
    uint32_t crc;
    memcpy(&crc, (const char *)file + body, sizeof crc);
    if (crc != cb_crc32(0, file, (uint32_t)body)) return "is damaged";
    return NULL;
}

/* out: true for a possible moment; differences of such times do not overflow. By the clock of the
 * boot what has not changed since the boot before is below 0. */
static bool is_time(int64_t unix_us, int64_t boottime_us) {
    const int64_t most_us = INT64_MAX / 4;
    return unix_us >= 0 && unix_us <= most_us && boottime_us >= -most_us && boottime_us <= most_us;
}

static bool is_sound(const struct record *record) {
    return is_time(record->unix_us, record->boottime_us) && isfinite(record->hi) &&
           isfinite(record->lo) && isfinite(record->input);
}

/* A lag of the box: of a signal, or of a bank, whose name is "". */
struct wanted {
    const char *name, *lag_of;
    uint32_t power;
    float tau_s;
    uint32_t range; /* as struct record */
};

static bool is_same(const struct record *record, const struct wanted *lag) {
    return strncmp(record->name, lag->name, CB_NAME_SIZE) == 0 &&
           strncmp(record->lag_of, lag->lag_of, CB_NAME_SIZE) == 0 && record->power == lag->power &&
           record->tau_s == lag->tau_s;
}

/* out: the record of this lag, with another range if no other is there; NULL if there is none or
 * its signal differs */
static const struct record *record_of(const struct file *file, const struct wanted *lag) {
    const struct record *found = NULL;
    for (uint32_t i = 0; i < file->header.count; i++) {
        const struct record *record = &file->records[i];
        if (!is_same(record, lag)) continue;
        if (record->range == lag->range) {
            found = record;
            break;
        }
        if (!found) found = record;
    }
    return found && is_sound(found) ? found : NULL;
}

/* Clock that measures the pause. */
enum pause {
    PAUSE_BOOTTIME,    /* same boot */
    PAUSE_WALL_CLOCK,  /* another boot, and the wall clock was synchronised at both ends */
    PAUSE_UNSYNC_THEN, /* unknown: unsynchronised when the file was written … */
    PAUSE_UNSYNC_NOW,  /* … or unsynchronised now */
};

static enum pause pause_of(const struct header *header, const struct cb_state_clock *now) {
    const bool known = now->boot_id[0] != '\0';
    if (known && strncmp(header->boot_id, now->boot_id, sizeof now->boot_id) == 0)
        return PAUSE_BOOTTIME;
    if (header->synchronised != 1) return PAUSE_UNSYNC_THEN;
    return now->synchronised ? PAUSE_WALL_CLOCK : PAUSE_UNSYNC_NOW;
}

/* Results of the lags, for the sentence. */
struct tally {
    unsigned lags, resumed, future;
    int64_t pause_us; /* the longest */
};

/* The current start of a box. */
struct resumption {
    const struct file *file;
    enum pause pause; /* a known one */
    const struct cb_state_clock *now;
    struct tally tally;
};

/* out: the record of this lag if it may go on, and *time_us of its last value; else NULL */
static const struct record *resume(struct resumption *to, const struct wanted *lag,
                                   int64_t *time_us) {
    const struct record *record = record_of(to->file, lag);
    struct tally *tally = &to->tally;
    tally->lags++;
    if (!record) return NULL;
    const int64_t pause_us = to->pause == PAUSE_BOOTTIME
                                 ? to->now->boottime_us - record->boottime_us
                                 : to->now->unix_us - record->unix_us;
    if (pause_us > tally->pause_us) tally->pause_us = pause_us;
    tally->future += pause_us < 0;
    if (pause_us < 0 || (double)pause_us * 1e-6 * (double)CB_STATE_PAUSES > (double)lag->tau_s)
        return NULL;
    tally->resumed++;
    *time_us = to->now->boottime_us - pause_us;
    return record;
}

static void report(const struct tally *tally, const char *path, char *message, size_t size) {
    if (tally->lags == 0)
        snprintf(message, size, "%s: no lags", path);
    else if (tally->future > 0)
        snprintf(message, size, "%s: is from the future by the clock, so its lags start steady",
                 path);
    else
        snprintf(message, size,
                 "%s: %u of %u lags go on after a pause of %.1f s; the others start steady", path,
                 tally->resumed, tally->lags, (double)tally->pause_us * 1e-6);
}

static void report_unknown(enum pause pause, const char *path, char *message, size_t size) {
    snprintf(message, size,
             "%s: the pause since the last boot is unknown, because the wall clock %s "
             "synchronised; lags start steady",
             path, pause == PAUSE_UNSYNC_THEN ? "was not" : "is not");
}

/* Appends to the sentence about the lags. */
static void report_ending(bool stopped, char *message, size_t size) {
    const size_t length = strlen(message);
    snprintf(message + length, size - length, "; the previous run %s STOPPED",
             stopped ? "ended" : "did not end");
}

/* out: bytes read, more than a whole file has if it is too long; -1 with errno */
static long read_bytes(const char *path, struct file *file) {
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW |
                            O_NONBLOCK); /* a pipe would wait for its writer */
    if (fd < 0) return -1;
    memset(file, 0, sizeof *file);
    const long size = cb_read_to_end(fd, (char *)file, sizeof *file);
    close(fd);
    return size;
}

static void resume_lags(struct cb_state *state, const struct cb_config *config,
                        struct resumption *to) {
    for (unsigned i = 0; i < config->signals_count; i++) {
        const struct cb_signal_config *signal = &config->signals[i];
        if (signal->source != CB_SOURCE_LAG) continue;
        const struct wanted lag = {signal->name, config->signals[signal->lag_of].name,
                                   signal->power, signal->tau_s, 0};
        int64_t time_us = 0;
        const struct record *record = resume(to, &lag, &time_us);
        if (!record) continue;
        state->lags[i] =
            (struct cb_lag_state){{record->hi, record->lo, record->input}, time_us, true};
    }
}

static void resume_bank(struct cb_state *state, const struct cb_config *config,
                        struct resumption *to) {
    for (unsigned i = 0; i < config->bank_lags_count; i++) {
        const struct cb_bank_key key = cb_bank_key_of(config, i);
        const struct wanted lag = {"", config->signals[key.signal].name, key.power, key.tau_s,
                                   range_of(&key)};
        int64_t time_us = 0;
        const struct record *record = resume(to, &lag, &time_us);
        if (!record) continue;
        cb_bank_settle(&state->bank, i, (struct cb_bank_lag){record->hi, record->lo});
        state->bank.time_us[key.signal] = time_us;
        state->bank.value[key.signal] = record->input;
    }
}

/* in : pause: a known one; a file of the previous version has an ending of zeros */
static void resume_beat(struct cb_state *state, const struct ending *ending, enum pause pause,
                        const struct cb_state_clock *now) {
    const bool sound = is_time(ending->unix_us, ending->boottime_us);
    if (ending->beat != 1 || !sound) return;
    const int64_t pause_us = pause == PAUSE_BOOTTIME ? now->boottime_us - ending->boottime_us
                                                     : now->unix_us - ending->unix_us;
    if (pause_us < 0 || pause_us > CB_STATE_BEAT_US) return;
    state->beat = true;
    state->plc_heartbeat = (uint16_t)ending->plc_heartbeat;
    state->beat_us = now->boottime_us - pause_us;
}

/* out: true and *probe, the record of the term with index i in config->adapts */
static bool find_probe(const struct file *file, const struct cb_config *config, unsigned i,
                       struct probe *probe) {
    const struct cb_term_config *term = &config->terms[config->adapts[i]];
    const char *name = config->outputs[term->first_output].name;
    const char *of = config->outputs[term->as.adapt.output].name;
    const char *at = (const char *)file + records_of(&file->header);
    for (uint32_t k = 0; k < probes_of(&file->header); k++, at += sizeof *probe) {
        memcpy(probe, at, sizeof *probe);
        if (strncmp(probe->name, name, CB_NAME_SIZE) != 0) continue;
        return strncmp(probe->of, of, CB_NAME_SIZE) == 0 &&
               is_time(probe->unix_us, probe->boottime_us);
    }
    return false;
}

/* Bias and gain stay valid for any pause; their uncertainty grows by it. A pause that is unknown
 * counts as CB_STATE_UNKNOWN_US. */
static void resume_probes(struct cb_state *state, const struct cb_config *config,
                          const struct file *file, enum pause pause,
                          const struct cb_state_clock *now) {
    for (unsigned i = 0; i < config->adapts_count; i++) {
        struct probe probe;
        if (!find_probe(file, config, i, &probe)) continue;
        int64_t pause_us = CB_STATE_UNKNOWN_US;
        if (pause == PAUSE_BOOTTIME) pause_us = now->boottime_us - probe.boottime_us;
        if (pause == PAUSE_WALL_CLOCK) pause_us = now->unix_us - probe.unix_us;
        if (pause_us < 0) pause_us = CB_STATE_UNKNOWN_US;
        state->probes[i] = (struct cb_probe_state){.grown_us = now->boottime_us - pause_us,
                                                   .filter = probe.filter,
                                                   .taken = probe.taken,
                                                   .asked = probe.asked,
                                                   .refused = probe.refused,
                                                   .skipped = probe.skipped,
                                                   .count = (uint16_t)probe.count,
                                                   .timed = true};
    }
}

static struct ending read_ending(const struct file *file) {
    struct ending ending = {0};
    if (file->header.format != FORMAT_WITHOUT_ENDING)
        memcpy(&ending, (const char *)file + body_of(&file->header) - sizeof ending, sizeof ending);
    return ending;
}

bool cb_state_read(struct cb_state *state, const struct cb_config *config, const char *path,
                   const struct cb_state_clock *now, char *message, size_t size) {
    struct file file;
    memset(state, 0, sizeof *state);
    const long length = read_bytes(path, &file);
    if (length < 0) {
        snprintf(message, size, "%s: %s, so lags start steady", path,
                 errno == ENOENT ? "is not there yet" : cb_output_error(errno));
        return false;
    }
    const char *fault = fault_of(&file, (size_t)length);
    if (fault == NULL && memcmp(file.header.machine, config->machine, sizeof config->machine) != 0)
        fault = "is of another machine";
    if (fault != NULL) {
        snprintf(message, size, "%s: %s and is not used; lags start steady", path, fault);
        return false;
    }
    const struct ending ending = read_ending(&file);
    const enum pause pause = pause_of(&file.header, now);
    state->stopped = ending.stopped == 1;
    resume_probes(state, config, &file, pause, now);
    if (pause == PAUSE_UNSYNC_THEN || pause == PAUSE_UNSYNC_NOW) {
        report_unknown(pause, path, message, size);
    } else {
        struct resumption to = {.file = &file, .pause = pause, .now = now};
        resume_lags(state, config, &to);
        resume_bank(state, config, &to);
        resume_beat(state, &ending, pause, now);
        report(&to.tally, path, message, size);
    }
    report_ending(state->stopped, message, size);
    return true;
}

bool cb_state_last_run(struct cb_last_run *ran, const char *path) {
    struct file file;
    const long length = read_bytes(path, &file);
    if (length < 0 || fault_of(&file, (size_t)length) != NULL) return false;
    memcpy(ran->machine, file.header.machine, sizeof ran->machine);
    ran->machine[sizeof ran->machine - 1] = '\0';
    ran->revision = read_ending(&file).revision;
    return true;
}
