/* SPDX-License-Identifier: MIT */
#include "hal/linux/daemon/options.h"

#include <getopt.h>
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

enum {
    CHECK = 256,
    MOST_UM,
    MOST_UM_PER_S,
    ALLOW_OLDER,
    SNAPSHOT,
    SNAPSHOT_EVERY,
    EVENTS,
    RECORD_EVERY,
    RECORD_MOST,
    BLACKBOX,
    BLACKBOX_MOST,
}; /* values beyond characters, which getopt_long returns for unknown options */

static const struct option known[] = {
    {"config", required_argument, NULL, 'c'},
    {"check", no_argument, NULL, CHECK},
    {"most-um", required_argument, NULL, MOST_UM},
    {"most-um-per-s", required_argument, NULL, MOST_UM_PER_S},
    {"allow-older", no_argument, NULL, ALLOW_OLDER},
    {"cycles", required_argument, NULL, 'n'},
    {"snapshot", required_argument, NULL, SNAPSHOT},
    {"snapshot-every", required_argument, NULL, SNAPSHOT_EVERY},
    {"events", required_argument, NULL, EVENTS},
    {"stats", required_argument, NULL, 's'},
    {"record", required_argument, NULL, 'r'},
    {"record-every", required_argument, NULL, RECORD_EVERY},
    {"record-most", required_argument, NULL, RECORD_MOST},
    {"blackbox", required_argument, NULL, BLACKBOX},
    {"blackbox-most", required_argument, NULL, BLACKBOX_MOST},
    {"record-inputs", required_argument, NULL, 'i'},
    {"state", required_argument, NULL, 'm'},
    {"state-every", required_argument, NULL, 'e'},
    {"priority", required_argument, NULL, 'p'},
    {"cpu-latency", required_argument, NULL, 'l'},
    {"cpu", required_argument, NULL, 'u'},
    {"clock", required_argument, NULL, 'k'},
    {"watchdog", required_argument, NULL, 'w'},
    {"watchdog-timeout", required_argument, NULL, 't'},
    {"help", no_argument, NULL, 'h'},
    {"version", no_argument, NULL, 'v'},
    {NULL, 0, NULL, 0},
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
static bool take(struct cb_options *options, int letter, const char *argument) {
    uint64_t number = 0;
    switch (letter) {
        case 'c':
            options->config = argument;
            return true;
        case SNAPSHOT:
            options->snapshot = argument;
            return true;
        case SNAPSHOT_EVERY:
            if (!parse_number("snapshot-every", argument, 100, 1000, &number)) return false;
            options->snapshot_every_ms = (int)number;
            return true;
        case EVENTS:
            options->events = argument;
            return true;
        case 's':
            options->stats = argument;
            return true;
        case 'r':
            options->record = argument;
            return true;
        case RECORD_EVERY:
            if (!parse_number("record-every", argument, 1, 3600000, &number)) return false;
            options->record_every_ms = (int)number;
            return true;
        case RECORD_MOST:
            if (!parse_number("record-most", argument, 1, 1000000, &number)) return false;
            options->record_most_mb = (int)number;
            return true;
        case BLACKBOX:
            options->blackbox = argument;
            return true;
        case BLACKBOX_MOST:
            if (!parse_number("blackbox-most", argument, 1, 1000000, &number)) return false;
            options->blackbox_most_mb = (int)number;
            return true;
        case 'i':
            options->inputs = argument;
            return true;
        case 'm':
            options->state = argument;
            return true;
        case 'e':
            if (!parse_number("state-every", argument, 1, 3600, &number)) return false;
            options->state_every_s = (int)number;
            return true;
        case 'n':
            return parse_number("cycles", argument, 1, 1000000000000, &options->cycles);
        case 'p':
            if (!parse_number("priority", argument, 1, 99, &number)) return false;
            options->priority = (int)number;
            return true;
        case CHECK:
            options->check = true;
            return true;
        case MOST_UM:
            return parse_ceiling("most-um", argument, &options->ceiling.um);
        case MOST_UM_PER_S:
            return parse_ceiling("most-um-per-s", argument, &options->ceiling.um_per_s);
        case ALLOW_OLDER:
            options->allow_older = true;
            return true;
        case 'u':
            return parse_cpu(argument, &options->cpu);
        case 'k':
            return parse_clock(argument, &options->clock);
        case 'w':
            options->watchdog = argument;
            return true;
        case 't':
            if (!parse_number("watchdog-timeout", argument, 1, 60, &number)) return false;
            options->watchdog_timeout_s = (int)number;
            return true;
        case 'l':
            return parse_switch("cpu-latency", argument, &options->cpu_latency);
        default:
            return false;
    }
}

static bool is_known(int letter) {
    for (const struct option *option = known; option->name != NULL; option++)
        if (option->val == letter) return true;
    return false;
}

/* Prints the error of getopt_long in one sentence. word: the last one it read. */
static void refuse(int letter, const char *word) {
    const bool is_long = strncmp(word, "--", 2) == 0;
    if (letter == ':')
        fprintf(stderr, "compboxd: %s needs a value; see compboxd --help\n", word);
    else if (is_long && is_known(optopt))
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
    const struct {
        const char *name, *path;
    } files[] = {{"--config", options->config}, {"--snapshot", options->snapshot},
                 {"--events", options->events}, {"--stats", options->stats},
                 {"--record", options->record}, {"--record-inputs", options->inputs},
                 {"--state", options->state}};
    const size_t count = sizeof files / sizeof files[0];
    for (size_t i = 1; i < count; i++)
        for (size_t k = 0; k < i && files[i].path != NULL; k++) {
            if (files[k].path == NULL || !is_one_file(files[i].path, files[k].path)) continue;
            fprintf(stderr, "compboxd: %s and %s name the same file, %s; give each its own\n",
                    files[k].name, files[i].name, files[i].path);
            return false;
        }
    return true;
}

enum cb_options_result cb_options_parse(struct cb_options *options, int argc, char **argv) {
    *options = (struct cb_options){.cpu_latency = true,
                                   .snapshot_every_ms = 200,
                                   .blackbox_most_mb = 200,
                                   .state_every_s = 10,
                                   .cpu = -1,
                                   .clock = CLOCK_MONOTONIC,
                                   .watchdog_timeout_s = 10};
    optind = 0;
    opterr = 0; /* getopt's own messages begin with the path of the program */
    for (int letter; (letter = getopt_long(argc, argv, ":", known, NULL)) != -1;) {
        if (letter == 'h') {
            fputs(help, stdout);
            return CB_OPTIONS_DONE;
        }
        if (letter == 'v') {
            puts("compboxd " CB_VERSION);
            return CB_OPTIONS_DONE;
        }
        if (letter == '?' || letter == ':') refuse(letter, argv[optind - 1]);
        if (!take(options, letter, optarg)) return CB_OPTIONS_WRONG;
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
