/* SPDX-License-Identifier: MIT
 * compboxd: the box on Linux. This thread reads the coefficient file and starts the loop
 * (daemon/loop.c). Then it writes log, record and statistics from the loop's rows, until a signal
 * or the loop itself ends it. */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "firmware/config/rtu_budget.h"
#include "hal/linux/bus.h"
#include "hal/linux/clock.h"
#include "hal/linux/daemon/can_sockets.h"
#include "hal/linux/daemon/load.h"
#include "hal/linux/daemon/log.h"
#include "hal/linux/daemon/loop.h"
#include "hal/linux/daemon/options.h"
#include "hal/linux/daemon/reload.h"
#include "hal/linux/daemon/row_files.h"
#include "hal/linux/daemon/stop.h"
#include "hal/linux/daemon/supervise.h"
#include "hal/linux/files/ceiling_words.h"
#include "hal/linux/files/snapshot.h"
#include "hal/linux/files/state.h"
#include "hal/linux/files/stats.h"
#include "hal/linux/hand.h"
#include "hal/linux/realtime.h"

enum {
    EXIT_OK = 0,
    EXIT_BAD = 1,
    EXIT_USAGE = 2,
    LOOK_EVERY_MS = 50,       /* poll interval of the rows */
    STATS_EVERY_US = 5000000, /* maximum age of the statistics file */
    BUS_AGAIN_US = 1000000,   /* pause before a bus without a thread is started again */
};

struct daemon {
    struct cb_options options;
    struct cb_loop loop;
    struct cb_log log;
    struct cb_row_files files;
    struct cb_stats stats;
    struct cb_reload reload;
    struct cb_supervise supervise;
    struct cb_stop stop;
    uint32_t generation;         /* generation of the rows taken last … */
    struct cb_config configs[2]; /* … and the newest two files, because the box's own copy may
                                    change in memory */
    uint32_t crc32s[2];          /* of their texts */
    char plc[64];
    int64_t snapshot_us;       /* time of the last snapshot */
    int snapshot_error;        /* errno of its write */
    int64_t stats_us;          /* time of the last statistics */
    bool took_beside;          /* the last row, which the full ring has counted as lost */
    struct cb_state state;     /* newest from the loop */
    uint32_t state_generation; /* generation of its lags */
    int64_t state_us;          /* time of its last write */
    int state_error;           /* errno of that write … */
    int stats_error;           /* … and of the statistics */
    struct cb_can_sockets can;
    bool reload_requested;   /* by SIGHUP */
    uint32_t status;         /* mode, reason and generation last reported to systemd … */
    uint32_t status_refused; /* … and the functions that the PLC does not support */
    bool status_reported;
    pthread_t thread;
    struct cb_bus bus;
    int bus_error;  /* of its last start; 0: none */
    int64_t bus_us; /* time of that start */
    struct cb_hand hand;
};

/* out: the coefficient file of rows of this generation; only the newest two are kept */
static const struct cb_config *config_of(const struct daemon *daemon, uint32_t generation) {
    return &daemon->configs[generation % 2];
}

/* Call it before the box of this generation runs, or right after it has taken over. */
static void keep_config(struct daemon *daemon, uint32_t generation) {
    daemon->configs[generation % 2] = daemon->loop.boxes[generation % 2].config;
    daemon->crc32s[generation % 2] = daemon->reload.loaded.facts.crc32;
    daemon->files.events.revision = daemon->configs[generation % 2].revision;
    daemon->files.events.crc32 = daemon->reload.loaded.facts.crc32;
}

static const struct cb_config *config_now(const struct daemon *daemon) {
    return config_of(daemon, daemon->generation);
}

/* out: generation of the newest row; right after a reload that is still the previous one */
static uint32_t generation_shown(const struct daemon *daemon) {
    return daemon->stats.rows > 0 ? daemon->stats.last.generation : daemon->generation;
}

static int write_snapshot(struct daemon *daemon) {
    const uint32_t generation = generation_shown(daemon);
    if (daemon->options.snapshot == NULL) return 0;
    return cb_snapshot_write(&daemon->stats, config_of(daemon, generation),
                             daemon->crc32s[generation % 2], daemon->options.snapshot);
}

/* Opens the output files, so that a wrong path is reported before the machine moves. */
static bool open_outputs(struct daemon *daemon) {
    const struct cb_options *options = &daemon->options;
    const struct cb_config *config = config_now(daemon);
    const int error = options->stats ? cb_stats_write(&daemon->stats, config, options->stats) : 0;
    return cb_row_files_is_open(options->stats, error) &&
           cb_row_files_is_open(options->snapshot, write_snapshot(daemon)) &&
           cb_row_files_start(&daemon->files, options, &daemon->log, config);
}

/* A thread of its own opens the device, because the loop must never wait for a driver. */
static bool start_serial_plc(struct daemon *daemon) {
    const struct cb_config *config = config_now(daemon);
    struct cb_linux *target = &daemon->loop.target;
    const struct cb_rtu_manners manners = cb_rtu_manners_of(&config->plc);
    snprintf(daemon->plc, sizeof daemon->plc, "%s", config->plc.serial.device);
    const int error = cb_serial_opener_start(&target->opener, &config->plc.serial);
    if (error != 0)
        fprintf(stderr, "compboxd: cannot start the thread that opens %s: %s\n", daemon->plc,
                strerror(error));
    else
        cb_rtu_start(&target->rtu, &config->plc.serial, &manners, &target->opener);
    return error == 0;
}

#if CB_HAS_LIBMODBUS
/* Its thread runs right behind the loop, which waits for none of its calls. */
static bool start_libmodbus(struct daemon *daemon) {
    struct cb_linux *target = &daemon->loop.target;
    const int before = daemon->options.priority;
    const struct cb_schedule schedule = {before > 1 ? before - 1 : before, -1};
    const struct cb_config *config = config_now(daemon);
    const int error = cb_libmodbus_start(&target->libmodbus, &config->plc, config->period_us,
                                         &schedule, &target->tcp);
    target->beside = error == 0;
    if (error != 0)
        fprintf(stderr, "compboxd: cannot start the thread of libmodbus: %s%s\n", strerror(error),
                error == EPERM ? "; without --priority it needs no permission" : "");
    return error == 0;
}
#endif

static bool start_plc(struct daemon *daemon) {
    const struct cb_plc_config *plc = &config_now(daemon)->plc;
    daemon->loop.target.transport = plc->transport;
    if (plc->transport == CB_TRANSPORT_RTU) return start_serial_plc(daemon);
    bool v6 = strchr(plc->host, ':') != NULL;
    snprintf(daemon->plc, sizeof daemon->plc, v6 ? "[%s]:%u" : "%s:%u", plc->host,
             (unsigned)plc->port);
#if CB_HAS_LIBMODBUS
    if (plc->client == CB_CLIENT_LIBMODBUS) return start_libmodbus(daemon);
#endif
    if (cb_tcp_start(&daemon->loop.target.tcp, plc->host, plc->port, plc->unit)) return true;
    fprintf(stderr, "compboxd: %s: plc.transport.tcp.host: \"%s\" is not a numeric address\n",
            daemon->options.config, plc->host);
    return false;
}

/* Reads the thermometers of the running file; the machine runs without them until that works. */
static void start_bus(struct daemon *daemon, int64_t now_us) {
    cb_bus_stop(&daemon->bus);
    const int error = cb_bus_start(&daemon->bus, config_now(daemon), daemon->generation,
                                   &daemon->loop.target.bus);
    if (error != 0 && error != daemon->bus_error)
        cb_log_limited(&daemon->log, CB_LOG_BUS, now_us,
                       "no thread for the bus: %s; trying again every second", strerror(error));
    daemon->bus_error = error;
    daemon->bus_us = now_us;
}

static void mind_the_bus(struct daemon *daemon, int64_t now_us) {
    if (daemon->bus_error != 0 && now_us - daemon->bus_us >= BUS_AGAIN_US)
        start_bus(daemon, now_us);
    cb_log_bus(&daemon->log, &daemon->bus, now_us);
}

/* Takes measurements by hand, and keeps their signals fresh. */
static void mind_the_hand(struct daemon *daemon, int64_t now_us) {
    char message[512];
    const struct cb_config *config = config_now(daemon);
    if (!daemon->hand.used) return;
    if (cb_hand_look(&daemon->hand, config, now_us, cb_unix_us(), message, sizeof message))
        cb_log_limited(&daemon->log, CB_LOG_FILES, now_us, "%s", message);
    cb_hand_put(&daemon->hand, config, daemon->generation, &daemon->loop.target.hand, now_us);
}

/* Reports what the system refuses; the box runs without it. */
static void prepare_machine(struct daemon *daemon) {
    struct cb_stats_run *run = &daemon->stats.run;
    int64_t now_us = cb_boottime_us();
    int error = cb_lock_memory();
    run->memory_locked = error == 0;
    if (error != 0)
        cb_log_line(&daemon->log, now_us, "memory may be paged, mlockall failed: %s",
                    strerror(error));
    if (!daemon->options.cpu_latency) return;
    error = cb_hold_cpu_latency();
    run->cpu_latency_held = error == 0;
    if (error != 0)
        cb_log_line(&daemon->log, now_us, "wake-ups may be slower, /dev/cpu_dma_latency: %s",
                    strerror(error));
}

/* A missing watchdog is reported; the machine is compensated without it. */
static void start_supervision(struct daemon *daemon) {
    const struct cb_options *options = &daemon->options;
    int timeout_s = options->watchdog_timeout_s;
    if (options->watchdog == NULL) return;
    const int error = cb_supervise_open_watchdog(&daemon->supervise, options->watchdog, &timeout_s);
    if (error == 0 && timeout_s != options->watchdog_timeout_s)
        cb_log_line(&daemon->log, cb_boottime_us(), "%s: resets the machine after %d s, not %d",
                    options->watchdog, timeout_s, options->watchdog_timeout_s);
    if (error != 0)
        cb_log_line(&daemon->log, cb_boottime_us(), "%s: no hardware watchdog: %s",
                    options->watchdog, strerror(error));
}

/* mind_signals() handles SIGHUP and SIGUSR1; the thread of daemon/stop.h handles the signals for a
 * stop. */
static bool start_signals(struct daemon *daemon) {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGHUP);
    sigaddset(&signals, SIGUSR1);
    pthread_sigmask(SIG_BLOCK, &signals, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN); /* a file at its size limit is reported like a full disk */
    daemon->stop.loop = &daemon->loop;
    daemon->stop.supervise = &daemon->supervise;
    const int error = cb_stop_start(&daemon->stop);
    if (error != 0)
        fprintf(stderr, "compboxd: cannot start the thread that waits for signals: %s\n",
                strerror(error));
    return error == 0;
}

static bool start_feeding(struct daemon *daemon) {
    const int error = cb_supervise_run(&daemon->supervise, &daemon->loop.target.steps);
    if (error != 0)
        fprintf(stderr, "compboxd: cannot start the thread that feeds the watchdogs: %s\n",
                strerror(error));
    return error == 0;
}

/* out: false: the thread could not be started, and the cause with its remedy is printed */
static bool start_loop(struct daemon *daemon) {
    daemon->loop.cycles = daemon->options.cycles;
    cb_ring_start(&daemon->loop.ring, CB_LOOP_ROWS);
    cb_ring_start(&daemon->loop.state_ring, CB_LOOP_STATES);
    const struct cb_schedule schedule = {daemon->options.priority, daemon->options.cpu};
    daemon->loop.clock = daemon->options.clock;
    cb_flag_raise(&daemon->stop.loop_runs);
    int error = cb_start_thread(&daemon->thread, &schedule, cb_loop_run, &daemon->loop);
    if (error == EINVAL && schedule.cpu >= 0)
        fprintf(stderr, "compboxd: --cpu %d: this processor is not available to this program\n",
                schedule.cpu);
    else if (error == EPERM)
        fprintf(stderr,
                "compboxd: --priority %d is not permitted: run as root, or give the program "
                "CAP_SYS_NICE\n",
                daemon->options.priority);
    else if (error != 0)
        fprintf(stderr, "compboxd: cannot start the loop: %s\n", strerror(error));
    return error == 0;
}

/* Resumes the state of the previous run. The file is rewritten before the machine moves, which
 * reports a wrong path and marks this run as not STOPPED. */
static bool resume_state(struct daemon *daemon) {
    const char *path = daemon->options.state;
    char message[512];
    struct cb_state_clock now;
    if (path == NULL) return true;
    cb_state_clock_read(&now);
    cb_state_read(&daemon->loop.resumed, config_now(daemon), path, &now, message, sizeof message);
    cb_log_line(&daemon->log, cb_boottime_us(), "%s", message);
    daemon->state = daemon->loop.resumed; /* a start that ends at once keeps the lags */
    daemon->state.stopped = false;
    const int error = cb_state_write(&daemon->state, config_now(daemon), path, &now);
    return cb_row_files_is_open(path, error);
}

static void write_state(struct daemon *daemon, int64_t now_us) {
    if (daemon->options.state == NULL) return;
    struct cb_state_clock now;
    cb_state_clock_read(&now);
    const int error =
        cb_state_write(&daemon->state, config_now(daemon), daemon->options.state, &now);
    cb_log_file(&daemon->log, daemon->options.state, error, &daemon->state_error, now_us);
}

/* Takes the loop's newest state and writes it when due. */
static void keep_state(struct daemon *daemon, int64_t now_us) {
    struct cb_loop *loop = &daemon->loop;
    for (int32_t slot; (slot = cb_ring_slot_to_read(&loop->state_ring)) >= 0;) {
        daemon->state = loop->states[slot];
        daemon->state_generation = loop->state_generations[slot];
        cb_ring_release(&loop->state_ring);
    }
    if (now_us - daemon->state_us < daemon->options.state_every_s * 1000000LL) return;
    /* right after a reload the newest lags still belong to the previous file */
    if (daemon->state_generation != daemon->generation) return;
    daemon->state_us = now_us;
    write_state(daemon, now_us);
}

static const char *plural(uint64_t count) {
    return count == 1 ? "" : "s";
}

/* A signed file must be of the machine of the last run, and not older, by its state: otherwise an
 * old file in its place and a restart would be a way around the rules of a reload. out: false: it
 * is not, and a sentence is printed */
static bool follows_last_run(struct daemon *daemon, const struct cb_config *config) {
    struct cb_reload *reload = &daemon->reload;
    struct cb_last_run ran;
    const char *path = daemon->options.state;
    if (!reload->loaded.is_signed || path == NULL || !cb_state_last_run(&ran, path)) return true;
    if (cb_reload_follows(reload, ran.machine, ran.revision, config)) return true;
    fprintf(stderr, "compboxd: %s (by %s)\n", reload->last, path);
    return false;
}

/* Loads the first file by the site's rules. */
static bool load(struct daemon *daemon) {
    struct cb_reload *reload = &daemon->reload;
    const struct cb_config *config = &daemon->loop.box->config;
    cb_reload_start(reload, daemon->options.config, &daemon->options.site);
    reload->allow_older = daemon->options.allow_older;
    const bool good = cb_load_file(&daemon->loop.box->config, daemon->options.config, &reload->site,
                                   &reload->loaded);
    reload->lowered = reload->loaded.lowered;
    if (!good) fprintf(stderr, "compboxd: %s\n", reload->loaded.message);
    return good && follows_last_run(daemon, config);
}

/* Logs the site's limits, or that it has none. */
static void log_ceiling(struct daemon *daemon) {
    const bool sizes = daemon->options.site.ceiling.um > 0.0f;
    const bool rates = daemon->options.site.ceiling.um_per_s > 0.0f;
    const char *both = sizes || rates ? "" : " and ";
    const int64_t now_us = cb_boottime_us();
    char names[400];
    if (!sizes || !rates)
        cb_log_line(
            &daemon->log, now_us,
            "no site ceiling for %s%s%s: the coefficient file alone limits them; set %s%s%s",
            sizes ? "" : "sizes", both, rates ? "" : "rates", sizes ? "" : "--most-um", both,
            rates ? "" : "--most-um-per-s");
    cb_lowered_names(config_now(daemon), daemon->reload.lowered, names, sizeof names);
    if (daemon->reload.lowered != 0)
        cb_log_line(&daemon->log, now_us, "the site's ceiling lowers the limits of %s", names);
}

/* Logs whether files must be signed. */
static void log_keys(struct daemon *daemon) {
    const char *keys = daemon->options.site.keys;
    const int64_t now_us = cb_boottime_us();
    if (!daemon->reload.loaded.is_signed)
        cb_log_line(&daemon->log, now_us, "no key is enrolled%s%s: unsigned files are taken",
                    keys != NULL       ? " in "
                    : CB_HAS_LIBSODIUM ? "; set --keys"
                                       : "",
                    keys != NULL ? keys : "");
    else
        cb_log_line(&daemon->log, now_us, "files must be signed by a key in %s%s", keys,
                    daemon->options.state != NULL
                        ? ""
                        : "; without --state a restart takes an older signed file");
}

/* Starts in the order of possible mistakes: file, wire, outputs, system; the loop last.
 * out: false: one of them failed, and a sentence about it is printed */
static bool start(struct daemon *daemon) {
    const struct cb_config *config = config_now(daemon);
    struct cb_stats_run *run = &daemon->stats.run;
    cb_loop_init(&daemon->loop);
    cb_supervise_start(&daemon->supervise);
    if (!load(daemon)) return false;
    keep_config(daemon, 0);
    run->config_file = daemon->options.config;
    run->ceiling = daemon->options.site.ceiling;
    run->lowered = daemon->reload.lowered;
    run->plc = daemon->plc;
    run->started_unix_s = (int64_t)time(NULL);
    run->priority = daemon->options.priority;
    if (!start_plc(daemon) || !open_outputs(daemon)) return false;
    cb_log_start(&daemon->log, daemon->plc, cb_boottime_us());
    daemon->log.events = &daemon->files.events;
    if (!start_signals(daemon)) return false;
    prepare_machine(daemon);
    start_supervision(daemon);
    daemon->files.events.file = &daemon->reload.loaded.facts;
    cb_log_line(&daemon->log, cb_boottime_us(),
                "%s, revision %u, %u term%s, %u channel%s, PLC %s, every %.6g ms", config->machine,
                (unsigned)config->revision, (unsigned)config->terms_count,
                plural(config->terms_count), (unsigned)config->channels_count,
                plural(config->channels_count), daemon->plc, (double)config->period_us * 1e-3);
    daemon->files.events.file = NULL;
    log_ceiling(daemon);
    log_keys(daemon);
    cb_can_source_start(&daemon->loop.target.can, config);
    run->can_used = cb_can_source_used(&daemon->loop.target.can);
    run->bus = &daemon->bus;
    daemon->can = (struct cb_can_sockets){.source = &daemon->loop.target.can, .log = &daemon->log};
    cb_can_sockets_serve(&daemon->can, config, cb_boottime_us());
    cb_sample_ring_start(&daemon->loop.target.bus);
    if (!resume_state(daemon)) return false;
    cb_input_record_begin(&daemon->files.inputs, &daemon->options.site.ceiling,
                          &daemon->loop.resumed);
    cb_sample_ring_start(&daemon->loop.target.hand);
    cb_hand_start(&daemon->hand, daemon->options.measured, (uint32_t)geteuid());
    cb_hand_follow(&daemon->hand, config);
    if (!start_feeding(daemon) || !start_loop(daemon)) {
        daemon->state.stopped = daemon->loop.resumed.stopped; /* nothing was written to the PLC */
        write_state(daemon, cb_boottime_us());
        return false;
    }
    start_bus(daemon, cb_boottime_us());
    return true;
}

/* Rows of another coefficient file follow. */
static void follow_reload(struct daemon *daemon, uint32_t generation) {
    if (generation == daemon->generation) return;
    daemon->generation = generation;
    keep_config(daemon, generation);
    daemon->stats.run.can_used = cb_can_source_used(&daemon->loop.target.can);
    cb_row_files_follow(&daemon->files, config_now(daemon));
}

/* Takes a row into all outputs, with the coefficient file that it belongs to. */
static void take_row(struct daemon *daemon, const struct cb_row *row) {
    follow_reload(daemon, row->generation);
    const struct cb_config *config = config_now(daemon);
    cb_stats_add(&daemon->stats, row);
    cb_row_files_add(&daemon->files, config, row);
    cb_log_row(&daemon->log, config, row);
    cb_log_can(&daemon->log, &config->can, row);
}

static void take_rows(struct daemon *daemon) {
    struct cb_loop *loop = &daemon->loop;
    for (int32_t slot; (slot = cb_ring_slot_to_read(&loop->ring)) >= 0;) {
        take_row(daemon, &loop->rows[slot]);
        cb_ring_release(&loop->ring);
    }
}

/* The last cycle's row, if the ring was full then: without it the final counters would be old. */
static void take_last_row(struct daemon *daemon) {
    if (!daemon->loop.is_beside) return;
    take_row(daemon, &daemon->loop.beside);
    daemon->took_beside = true;
}

/* out: 0, or errno of the failed write */
static int write_stats(struct daemon *daemon) {
    struct cb_stats_run *run = &daemon->stats.run;
    run->rows_lost = cb_ring_lost(&daemon->loop.ring) - (daemon->took_beside ? 1 : 0);
    run->lowered = daemon->reload.lowered;
    run->reload_pending = daemon->reload.pending;
    run->reloads_taken = daemon->reload.taken;
    run->reloads_refused = daemon->reload.refused;
    run->reload_message = daemon->reload.last;
    run->records_lost = run->rows_lost + daemon->files.record.lost;
    if (daemon->options.stats == NULL) return 0;
    return cb_stats_write(&daemon->stats, config_of(daemon, generation_shown(daemon)),
                          daemon->options.stats);
}

static void write_stats_now_and_then(struct daemon *daemon, int64_t now_us) {
    if (now_us - daemon->stats_us < STATS_EVERY_US) return;
    /* of a file that has no row yet they tell as soon as it has one */
    daemon->stats_us = generation_shown(daemon) == daemon->generation ? now_us : 0;
    cb_log_file(&daemon->log, daemon->options.stats, write_stats(daemon), &daemon->stats_error,
                now_us);
}

static void write_snapshot_now_and_then(struct daemon *daemon, int64_t now_us) {
    if (now_us - daemon->snapshot_us < daemon->options.snapshot_every_ms * 1000LL) return;
    daemon->snapshot_us = now_us;
    cb_log_file(&daemon->log, daemon->options.snapshot, write_snapshot(daemon),
                &daemon->snapshot_error, now_us);
}

/* Waits a little. SIGHUP requests a reload of the coefficient file, SIGUSR1 a file of the black
 * box. */
static void mind_signals(struct daemon *daemon) {
    const struct timespec wait = cb_timespec(LOOK_EVERY_MS * 1000000LL);
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGHUP);
    sigaddset(&signals, SIGUSR1);
    siginfo_t info;
    const int found = sigtimedwait(&signals, &info, &wait);
    if (found == SIGHUP) {
        daemon->reload_requested = true;
        daemon->reload.sender = (struct cb_sender){true, info.si_uid, info.si_pid};
    }
    if (found == SIGUSR1) cb_blackbox_request(&daemon->files.blackbox, cb_boottime_us());
}

/* in : reload->last, a sentence */
static void log_reload(struct daemon *daemon, int64_t now_us, const char *rest) {
    daemon->files.events.file = &daemon->reload.loaded.facts;
    cb_log_limited(&daemon->log, CB_LOG_FILES, now_us, "%s%s", daemon->reload.last, rest);
    daemon->files.events.file = NULL;
    daemon->stats_us = 0; /* writes the statistics at once */
}

/* The loop has taken another coefficient file. */
static void follow_taken(struct daemon *daemon, int64_t now_us) {
    take_rows(daemon); /* the remaining rows of the previous generation, whose box is spare now */
    follow_reload(daemon, daemon->loop.generation);
    if (daemon->stats.run.can_used) cb_can_sockets_renew(&daemon->can, config_now(daemon), now_us);
    start_bus(daemon, now_us);
    cb_hand_follow(&daemon->hand, config_now(daemon));
    log_reload(daemon, now_us, "");
}

/* Reads a coefficient file that changed or was requested; it takes over, is pending, or is
 * rejected. */
static void mind_the_file(struct daemon *daemon, int64_t now_us) {
    struct cb_reload *reload = &daemon->reload;
    char rest[60];
    if (cb_reload_taken(reload, &daemon->loop)) follow_taken(daemon, now_us);
    if (cb_flag_is_raised(&daemon->loop.target.stop)) return;
    if (cb_reload_file_changed(reload, now_us)) daemon->reload_requested = true;
    if (!daemon->reload_requested || !cb_reload_ready(reload, &daemon->loop)) return;
    daemon->reload_requested = false;
    const bool goes_on = !cb_loop_is_corrupt(&daemon->loop);
    snprintf(rest, sizeof rest, "; revision %u goes on", (unsigned)config_now(daemon)->revision);
    switch (cb_reload_offer(reload, &daemon->loop)) {
        case CB_RELOAD_OFFERED:
        case CB_RELOAD_SAME:
            break;
        case CB_RELOAD_PENDING:
            log_reload(daemon, now_us, "");
            break;
        case CB_RELOAD_REFUSED:
            log_reload(daemon, now_us, goes_on ? rest : "");
            break;
    }
}

/* Reports a changed mode for `systemctl status`. */
static void report_status(struct daemon *daemon) {
    const struct cb_row *row = &daemon->stats.last;
    const uint32_t status = row->generation << 16 | (uint32_t)row->reason << 8 | row->mode;
    const uint32_t refused = row->peer.refused_functions;
    const bool same = status == daemon->status && refused == daemon->status_refused;
    char text[300];
    if (daemon->stats.rows == 0 || (daemon->status_reported && same)) return;
    const unsigned function = refused == 0 ? 0 : 31u - (unsigned)__builtin_clz(refused);
    int used = snprintf(text, sizeof text, "%s: %s; revision %u", cb_mode_name(row->mode),
                        cb_reason_text(row->reason),
                        (unsigned)config_of(daemon, row->generation)->revision);
    if (refused != 0)
        snprintf(text + used, sizeof text - (size_t)used, "; the PLC does not have function %u: %s",
                 function, cb_peer_remedy((uint8_t)function));
    if (!cb_supervise_status(&daemon->supervise, text)) return;
    daemon->status = status;
    daemon->status_refused = refused;
    daemon->status_reported = true;
}

/* The normal thread's work until the loop ends; then takes its last rows and writes its last
 * state. */
static void serve(struct daemon *daemon) {
    daemon->snapshot_us = daemon->stats_us = daemon->state_us = cb_boottime_us();
    while (!cb_flag_is_raised(&daemon->loop.finished)) {
        mind_signals(daemon);
        take_rows(daemon);
        cb_row_files_flush(&daemon->files);
        mind_the_file(daemon, cb_boottime_us());
        report_status(daemon);
        cb_can_sockets_serve(&daemon->can, config_now(daemon), cb_boottime_us());
        mind_the_bus(daemon, cb_boottime_us());
        mind_the_hand(daemon, cb_boottime_us());
        const int64_t now_us = cb_boottime_us();
        take_rows(daemon); /* a disk may have held this thread: all rows up to now_us */
        cb_row_files_work(&daemon->files, now_us);
        take_rows(daemon); /* … and those that have come meanwhile */
        write_snapshot_now_and_then(daemon, cb_boottime_us());
        write_stats_now_and_then(daemon, cb_boottime_us());
        keep_state(daemon, cb_boottime_us());
        cb_log_catch_up(&daemon->log, cb_boottime_us(), false);
    }
    pthread_join(daemon->thread, NULL);
    cb_linux_stop(&daemon->loop.target);
    cb_bus_stop(&daemon->bus);
    cb_can_close(&daemon->loop.target.can.can);
    take_rows(daemon);
    take_last_row(daemon);
    follow_reload(daemon, daemon->loop.generation);
    if (cb_reload_taken(&daemon->reload, &daemon->loop)) log_reload(daemon, cb_boottime_us(), "");
    cb_state_take(&daemon->state, daemon->loop.box);
    daemon->state.stopped = cb_state_ended_stopped(daemon->loop.box);
    write_state(daemon, cb_boottime_us());
}

/* Writes the final files. out: the exit code */
static int finish(struct daemon *daemon) {
    struct cb_stats_run *run = &daemon->stats.run;
    int64_t now_us = cb_boottime_us();
    run->finished = true;
    run->stopped = daemon->loop.stopped;
    const bool complete = cb_row_files_finish(&daemon->files, now_us);
    const int stats_error = write_stats(daemon);
    cb_log_file(&daemon->log, daemon->options.snapshot, write_snapshot(daemon),
                &daemon->snapshot_error, now_us);
    if (stats_error != 0)
        cb_log_line(&daemon->log, now_us, "%s: cannot be written: %s", daemon->options.stats,
                    strerror(stats_error));
    bool confirmed = run->stopped && daemon->loop.box->life.wrote;
    if (!daemon->loop.box->life.wrote)
        cb_log_line(&daemon->log, now_us,
                    "ended without any reply of the PLC; nothing was written: check %s",
                    daemon->plc);
    else if (!confirmed)
        cb_log_line(&daemon->log, now_us,
                    "ended without the PLC's confirmation of zero: its own watchdog must remove "
                    "the offset; check %s",
                    daemon->plc);
    cb_log_catch_up(&daemon->log, now_us, true);
    cb_events_finish(&daemon->files.events);
    cb_supervise_finish(&daemon->supervise);
    const bool written = complete && stats_error == 0;
    return confirmed && written ? EXIT_OK : EXIT_BAD;
}

/* Reports whether this program would run the file. */
static int check(const struct cb_options *options) {
    static struct cb_config config;
    static struct cb_loaded loaded;
    if (cb_load_file(&config, options->config, &options->site, &loaded)) return EXIT_OK;
    fprintf(stderr, "compboxd: %s\n", loaded.message);
    return EXIT_BAD;
}

static int run(struct daemon *daemon) {
    if (start(daemon)) {
        serve(daemon);
        return finish(daemon);
    }
    cb_supervise_finish(&daemon->supervise); /* a wrong option must not reset the machine */
    return EXIT_BAD;
}

int main(int argc, char **argv) {
    static struct daemon daemon; /* a few megabytes, allocated from the start */
    switch (cb_options_parse(&daemon.options, argc, argv)) {
        case CB_OPTIONS_DONE:
            return EXIT_OK;
        case CB_OPTIONS_WRONG:
            return EXIT_USAGE;
        case CB_OPTIONS_RUN:
            break;
    }
    if (daemon.options.check) return check(&daemon.options);
    const int code = run(&daemon);
    cb_stop_finish(&daemon.stop);
    return code;
}
