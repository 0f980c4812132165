/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/options.h"

#include <getopt.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char help[] =
    "compboxd: reads machine signals from a PLC, computes the compensation, writes it back.\n"
    "\n"
    "usage: compboxd --config FILE [options]\n"
    "\n"
    "Options:\n"
    "  --config FILE         coefficient file (compbox build makes it, compbox check checks it)\n"
    "  --check               check the file and exit: 0, or 1 after an error message\n"
    "  --most-um U           the site's ceiling of outputs, µm (a slope: µm/m), 0.001 to 1000000;\n"
    "                        a larger limit of the file is lowered to it\n"
    "  --most-um-per-s V     the site's ceiling of their rate, µm/s, 0.001 to 1000000\n"
    "  --keys DIR            take files only that a key NAME.pub in this folder has signed, for "
    "this\n"
    "                        machine and not older; a folder without keys: any file\n"
    "  --allow-older         a reload accepts a file of a lower revision than the running one\n"
    "  --cycles N            stop after N cycles like on SIGTERM\n"
    "  --snapshot FILE       write the box's values, mode and cause as JSON, for other programs\n"
    "  --snapshot-every MS   write it every MS ms, 100 to 1000 (default: 200)\n"
    "  --events FILE         append a line of JSON for each event: mode, cause, reload, start, "
    "end\n"
    "  --stats FILE          write statistics as JSON, every 5 s and at the end\n"
    "  --record FILE         append one CSV row for each cycle: signals, terms, outputs, mode\n"
    "  --record-every MS     a row every MS ms only, 1 to 3600000, and where mode or reason "
    "change\n"
    "  --record-most MB      all records together need at most so many MB, 1 to 1000000: old ones\n"
    "                        are compressed, the oldest removed (default: no limit)\n"
    "  --blackbox DIR        keep the last ten minutes in memory; write them into this folder "
    "around\n"
    "                        each HOLD and FAULT, and on SIGUSR1\n"
    "  --blackbox-most MB    these files have at most so many MB, 1 to 1000000 (default: 200)\n"
    "  --record-inputs FILE  write the exact inputs of each cycle for compbox simulate --replay\n"
    "  --state FILE          keep lags and how the run ended across restarts in this file\n"
    "  --state-every S       write it every S seconds, 1 to 3600 (default: 10), and at the end\n"
    "  --measured FILE       file of compbox measured (default: /run/compboxd/measured)\n"
    "  --priority P          run the loop under SCHED_FIFO with this priority, 1 to 99\n"
    "  --cpu-latency on|off  hold /dev/cpu_dma_latency at 0 (default: on, where permitted)\n"
    "  --cpu N               run the loop on processor N only\n"
    "  --clock C             clock of the ticks: monotonic (default), or boottime, which counts\n"
    "                        ticks during a suspend as missed\n"
    "  --watchdog DEVICE     feed this hardware watchdog, with completed cycles only\n"
    "  --watchdog-timeout S  time after which the watchdog resets, 1 to 60 s (default: 10)\n"
    "  --help                print this text\n"
    "  --version             print the version\n"
    "\n"
    "On SIGTERM or SIGINT, compboxd ramps outputs to zero, writes STOPPED to the status register\n"
    "and exits. On SIGHUP, or when the coefficient file changes, it loads the file without a "
    "step.\n"
    "Exit codes: 0 the PLC confirmed the stop, 1 a file is bad or the PLC did not confirm, 2 "
    "wrong\n"
    "usage.\n"
    "\n"
    "example: compboxd --config coefficients.json --stats stats.json --priority 80\n";

/* What an option has behind its name, and the type of its field. */
enum kind {
    PATH,    /* const char *: a file of its own */
    TEXT,    /* const char * */
    KEYS,    /* const char *: a folder; needs libsodium */
    NUMBER,  /* int, within its bounds */
    COUNT,   /* uint64_t, within its bounds */
    CEILING, /* float */
    CPU,     /* int: an existing processor */
    CLOCK,   /* clockid_t */
    SWITCH,  /* bool: on or off */
    FLAG,    /* bool; nothing behind it */
    HELP,
    VERSION,
};

#define CB_AT(member) offsetof(struct cb_options, member)
static const struct known {
    const char *name;
    enum kind kind;
    size_t at; /* its field in struct cb_options */
    uint64_t min, max;
} known[] = {
    {"config", PATH, CB_AT(config), 0, 0},
    {"check", FLAG, CB_AT(check), 0, 0},
    {"most-um", CEILING, CB_AT(site.ceiling.um), 0, 0},
    {"most-um-per-s", CEILING, CB_AT(site.ceiling.um_per_s), 0, 0},
    {"keys", KEYS, CB_AT(site.keys), 0, 0},
    {"allow-older", FLAG, CB_AT(allow_older), 0, 0},
    {"cycles", COUNT, CB_AT(cycles), 1, 1000000000000},
    {"snapshot", PATH, CB_AT(snapshot), 0, 0},
    {"snapshot-every", NUMBER, CB_AT(snapshot_every_ms), 100, 1000},
    {"events", PATH, CB_AT(events), 0, 0},
    {"stats", PATH, CB_AT(stats), 0, 0},
    {"record", PATH, CB_AT(record), 0, 0},
    {"record-every", NUMBER, CB_AT(record_every_ms), 1, 3600000},
    {"record-most", NUMBER, CB_AT(record_most_mb), 1, 1000000},
    {"blackbox", TEXT, CB_AT(blackbox), 0, 0},
    {"blackbox-most", NUMBER, CB_AT(blackbox_most_mb), 1, 1000000},
    {"record-inputs", PATH, CB_AT(inputs), 0, 0},
    {"state", PATH, CB_AT(state), 0, 0},
    {"state-every", NUMBER, CB_AT(state_every_s), 1, 3600},
    {"measured", PATH, CB_AT(measured), 0, 0},
    {"priority", NUMBER, CB_AT(priority), 1, 99},
    {"cpu-latency", SWITCH, CB_AT(cpu_latency), 0, 0},
    {"cpu", CPU, CB_AT(cpu), 0, 0},
    {"clock", CLOCK, CB_AT(clock), 0, 0},
    {"watchdog", TEXT, CB_AT(watchdog), 0, 0},
    {"watchdog-timeout", NUMBER, CB_AT(watchdog_timeout_s), 1, 60},
    {"help", HELP, 0, 0, 0},
    {"version", VERSION, 0, 0, 0},
};
#undef CB_AT

enum {
    KNOWN = sizeof known / sizeof known[0],
    FIRST = 256, /* beyond characters, which getopt_long returns for unknown options */
};

/* Parses an unsigned decimal integer within [min, max], with nothing before or behind it. */
static bool parse_number(const char *option, const char *text, uint64_t min, uint64_t max,
                         uint64_t *number) {
    char *end = NULL;
    unsigned long long value = strtoull(text, &end, 10); /* too large for it: its largest, > max */
    bool digits = text[0] >= '0' && text[0] <= '9';
    if (digits && *end == '\0' && value >= min && value <= max) {
        *number = value;
        return true;
    }
    fprintf(stderr, "compboxd: --%s must be a whole number from %llu to %llu, not \"%s\"\n", option,
            (unsigned long long)min, (unsigned long long)max, text);
    return false;
}

/* Parses a number of the ceiling, such as 300, 0.5 or 1e3; nothing before or behind it. */
static bool parse_ceiling(const char *option, const char *text, float *number) {
    const bool plain = text[0] >= '0' && text[0] <= '9' && strlen(text) < 64 &&
                       strspn(text, "0123456789.eE+-") == strlen(text);
    char *end = NULL;
    const float value = plain ? strtof(text, &end) : 0.0f;
    if (plain && *end == '\0' && value >= 0.001f && value <= 1e6f) {
        *number = value;
        return true;
    }
    fprintf(stderr, "compboxd: --%s must be a number from 0.001 to 1000000, not \"%s\"\n", option,
            text);
    return false;
}

static bool parse_switch(const char *option, const char *text, bool *on) {
    *on = strcmp(text, "on") == 0;
    if (*on || strcmp(text, "off") == 0) return true;
    fprintf(stderr, "compboxd: --%s must be on or off, not \"%s\"\n", option, text);
    return false;
}

static bool parse_clock(const char *text, clockid_t *clock) {
    *clock = strcmp(text, "boottime") == 0 ? CLOCK_BOOTTIME : CLOCK_MONOTONIC;
    if (*clock == CLOCK_BOOTTIME || strcmp(text, "monotonic") == 0) return true;
    fprintf(stderr, "compboxd: --clock must be monotonic or boottime, not \"%s\"\n", text);
    return false;
}

/* Parses the index of an existing processor. */
static bool parse_cpu(const char *text, int *cpu) {
    uint64_t number = 0;
    const long last = sysconf(_SC_NPROCESSORS_CONF) - 1;
    if (!parse_number("cpu", text, 0, last < 0 ? 0 : (uint64_t)last, &number)) return false;
    *cpu = (int)number;
    return true;
}

/* Takes one option with its argument. out: false when the argument is wrong */
static bool take(struct cb_options *options, const struct known *option, const char *argument) {
    void *field = (char *)options + option->at;
    uint64_t number = 0;
    switch (option->kind) {
        case PATH:
        case TEXT:
            *(const char **)field = argument;
            return true;
        case KEYS:
            *(const char **)field = argument;
            if (CB_HAS_LIBSODIUM) return true;
            fputs(
                "compboxd: --keys: this program was built without libsodium and cannot verify "
                "signatures; leave the option out\n",
                stderr);
            return false;
        case NUMBER:
            if (!parse_number(option->name, argument, option->min, option->max, &number))
                return false;
            *(int *)field = (int)number;
            return true;
        case COUNT:
            return parse_number(option->name, argument, option->min, option->max, field);
        case CEILING:
            return parse_ceiling(option->name, argument, field);
        case CPU:
            return parse_cpu(argument, field);
        case CLOCK:
            return parse_clock(argument, field);
        case SWITCH:
            return parse_switch(option->name, argument, field);
        case FLAG:
            *(bool *)field = true;
            return true;
        case HELP:
        case VERSION:
            break;
    }
    return false;
}

/* Prints the error of getopt_long in one sentence. word: the last one it read. */
static void refuse(int letter, const char *word) {
    const bool is_long = strncmp(word, "--", 2) == 0;
    if (letter == ':')
        fprintf(stderr, "compboxd: %s needs a value; see compboxd --help\n", word);
    else if (is_long && optopt >= FIRST)
        fprintf(stderr, "compboxd: \"%s\": this option takes no value\n", word);
    else if (optopt != 0)
        fprintf(stderr, "compboxd: unknown option -%c; see compboxd --help\n", optopt);
    else
        fprintf(stderr, "compboxd: unknown or ambiguous option %s; see compboxd --help\n", word);
}

/* out: whether two paths are one file, by name or by a link. A device may be named twice: /dev/null
 *      loses nothing. */
static bool is_one_file(const char *a, const char *b) {
    struct stat one, other;
    if (stat(a, &one) != 0 || stat(b, &other) != 0) return strcmp(a, b) == 0;
    return S_ISREG(one.st_mode) && one.st_dev == other.st_dev && one.st_ino == other.st_ino;
}

/* out: whether all paths differ. A record written over the coefficient file would leave the machine
 *      uncompensated from the next start on. */
static bool files_differ(const struct cb_options *options) {
    const char *paths[KNOWN] = {NULL};
    for (size_t i = 0; i < KNOWN; i++) {
        if (known[i].kind == PATH)
            paths[i] = *(const char *const *)((const char *)options + known[i].at);
        for (size_t k = 0; k < i && paths[i] != NULL; k++) {
            if (paths[k] == NULL || !is_one_file(paths[i], paths[k])) continue;
            fprintf(stderr, "compboxd: --%s and --%s name the same file, %s; give each its own\n",
                    known[k].name, known[i].name, paths[i]);
            return false;
        }
    }
    return true;
}

/* out: words[KNOWN + 1]: the table as getopt_long reads it */
static void list(struct option *words) {
    for (int i = 0; i < KNOWN; i++) {
        const bool bare = known[i].kind >= FLAG;
        words[i] =
            (struct option){known[i].name, bare ? no_argument : required_argument, NULL, FIRST + i};
    }
    words[KNOWN] = (struct option){NULL, 0, NULL, 0};
}

/* Prints the help or the version. */
static enum cb_options_result print(enum kind kind) {
    if (kind == HELP)
        fputs(help, stdout);
    else
        puts("compboxd " CB_VERSION);
    return CB_OPTIONS_DONE;
}

enum cb_options_result cb_options_parse(struct cb_options *options, int argc, char **argv) {
    *options = (struct cb_options){.cpu_latency = true,
                                   .snapshot_every_ms = 200,
                                   .blackbox_most_mb = 200,
                                   .state_every_s = 10,
                                   .measured = "/run/compboxd/measured",
                                   .cpu = -1,
                                   .clock = CLOCK_MONOTONIC,
                                   .watchdog_timeout_s = 10};
    struct option words[KNOWN + 1];
    optind = 0;
    opterr = 0; /* getopt's own messages begin with the path of the program */
    list(words);
    for (int letter; (letter = getopt_long(argc, argv, ":", words, NULL)) != -1;) {
        if (letter == '?' || letter == ':') {
            refuse(letter, argv[optind - 1]);
            return CB_OPTIONS_WRONG;
        }
        const struct known *option = &known[letter - FIRST];
        if (option->kind == HELP || option->kind == VERSION) return print(option->kind);
        if (!take(options, option, optarg)) return CB_OPTIONS_WRONG;
    }
    if (optind < argc) {
        fprintf(stderr, "compboxd: \"%s\" belongs to no option; see compboxd --help\n",
                argv[optind]);
        return CB_OPTIONS_WRONG;
    }
    if (options->config == NULL) {
        fputs("compboxd: --config FILE is missing; see compboxd --help\n", stderr);
        return CB_OPTIONS_WRONG;
    }
    if (!files_differ(options)) return CB_OPTIONS_WRONG;
    return CB_OPTIONS_RUN;
}
