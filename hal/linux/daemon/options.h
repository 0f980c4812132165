/* SPDX-License-Identifier: MIT
 * compboxd's command line. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_OPTIONS_H
#define COMPBOX_HAL_LINUX_DAEMON_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>
#include <time.h>

#include "hal/linux/daemon/load.h"

struct cb_options {
    const char *config; /* coefficient file */
    bool check;         /* load it and exit */
    struct cb_site site;
    bool allow_older;      /* a reload may use a file of a lower revision */
    const char *snapshot;  /* the box at this moment as JSON; NULL: none */
    int snapshot_every_ms; /* its write interval */
    const char *events;    /* lines of JSON, appended; NULL: none */
    const char *stats;     /* statistics as JSON; NULL: none */
    const char *record;    /* one CSV row per cycle; NULL: none */
    int record_every_ms;   /* … or in this interval; 0: each cycle */
    int record_most_mb;    /* of it and the kept ones; 0: no limit */
    const char *blackbox;  /* folder of its files; NULL: none */
    int blackbox_most_mb;
    const char *inputs;     /* the exact inputs of each step; NULL: none */
    const char *state;      /* memory of the lags across restarts; NULL: none */
    int state_every_s;      /* its write interval */
    const char *measured;   /* file of measurements by hand; it is read */
    uint64_t cycles;        /* number of cycles before it stops; 0: no limit */
    int priority;           /* SCHED_FIFO 1 … 99; 0: normal scheduling */
    int cpu;                /* the loop runs on this processor only; -1: any */
    clockid_t clock;        /* of the ticks */
    const char *watchdog;   /* device of the hardware watchdog; NULL: none */
    int watchdog_timeout_s; /* its time until the reset of the machine */
    bool cpu_latency;       /* keep the processor in its lightest sleep */
};

enum cb_options_result { CB_OPTIONS_RUN, CB_OPTIONS_DONE, CB_OPTIONS_WRONG };

/* out: RUN: *options is complete; DONE: the requested help or version is printed; WRONG: a sentence
 *      about the mistake is printed on stderr. Pointers point into argv. */
enum cb_options_result cb_options_parse(struct cb_options *options, int argc, char **argv);

#endif
