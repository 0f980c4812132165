/* SPDX-License-Identifier: MIT
 * The file of statistics, as JSON. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/box/mode.h"
#include "hal/linux/daemon/bus_words.h"
#include "hal/linux/daemon/cause_words.h"
#include "hal/linux/daemon/load.h"
#include "hal/linux/daemon/output_file.h"
#include "hal/linux/daemon/stats.h"

void cb_stats_put_string(FILE *file, const char *text) {
    fputc('"', file);
    for (; *text != '\0'; text++) {
        unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\') fputc('\\', file);
        if (c < 0x20)
            fprintf(file, "\\u%04x", c);
        else
            fputc(c, file);
    }
    fputc('"', file);
}

static void put_text(FILE *file, const char *key, const char *text) {
    fprintf(file, "  \"%s\": ", key);
    cb_stats_put_string(file, text);
    fputs(",\n", file);
}

static const char *truth(bool value) {
    return value ? "true" : "false";
}

/* ns to µs with three decimals, for all times of the file. */
static double us(int64_t ns) {
    return (double)ns * 1e-3;
}

static void put_times(FILE *file, const char *key, const struct cb_histogram *times) {
    fprintf(file,
            "  \"%s\": {\"count\": %llu, \"min\": %.3f, \"mean\": %.3f, \"p50\": %.3f, "
            "\"p99\": %.3f, \"max\": %.3f},\n",
            key, (unsigned long long)times->count, us(times->min_ns),
            cb_histogram_mean(times) * 1e-3, us(cb_histogram_percentile(times, 0.5)),
            us(cb_histogram_percentile(times, 0.99)), us(times->max_ns));
}

/* Wake-ups against start + n * period, over the whole run: the error that relative sleeps would
 * accumulate. */
static int64_t drift_us(const struct cb_stats *stats, const struct cb_config *config) {
    if (stats->rows == 0) return 0;
    int64_t ticks = stats->last.tick - stats->first_tick;
    return stats->last.time_us - stats->first_us - ticks * (int64_t)config->period_us;
}

/* Writes the members about program, file and scheduling, which begin the statistics. */
static void put_run(FILE *file, const struct cb_stats *stats, const struct cb_config *config) {
    const struct cb_stats_run *run = &stats->run;
    put_text(file, "format", "compboxd-stats/1");
    put_text(file, "version", CB_VERSION);
    put_text(file, "config", run->config_file);
    put_text(file, "machine", config->machine);
    fprintf(file, "  \"revision\": %u,\n", (unsigned)config->revision);
    fprintf(file, "  \"started_unix_s\": %lld,\n", (long long)run->started_unix_s);
    fprintf(file, "  \"elapsed_s\": %.3f,\n",
            (double)(stats->last.time_us - stats->first_us) * 1e-6);
    fprintf(file, "  \"finished\": %s,\n", truth(run->finished));
    fprintf(file, "  \"stopped\": %s,\n", truth(run->stopped));
    fprintf(
        file,
        "  \"realtime\": {\"priority\": %d, \"memory_locked\": %s, \"cpu_latency_held\": %s},\n",
        run->priority, truth(run->memory_locked), truth(run->cpu_latency_held));
}

/* Writes the site's ceiling, 0 if there is none, and the channels that it limits. */
static void put_ceiling(FILE *file, const struct cb_stats_run *run,
                        const struct cb_config *config) {
    char names[1024];
    cb_lowered_names(config, run->lowered, names, sizeof names);
    fprintf(file, "  \"ceiling\": {\"um\": %.9g, \"um_per_s\": %.9g, \"lowers\": ",
            (double)run->ceiling.um, (double)run->ceiling.um_per_s);
    cb_stats_put_string(file, names);
    fputs("},\n", file);
}

static void put_reloads(FILE *file, const struct cb_stats_run *run) {
    fprintf(file, "  \"reloads\": {\"taken\": %u, \"refused\": %u, \"pending\": %s, \"last\": ",
            (unsigned)run->reloads_taken, (unsigned)run->reloads_refused,
            truth(run->reload_pending));
    cb_stats_put_string(file, run->reload_message == NULL ? "" : run->reload_message);
    fputs("},\n", file);
}

static void put_cycles(FILE *file, const struct cb_stats *stats, const struct cb_config *config) {
    fprintf(file, "  \"cycles\": %u,\n", (unsigned)stats->last.box.cycles);
    fprintf(file, "  \"overruns\": %u,\n", (unsigned)stats->last.box.missed_ticks);
    fprintf(file, "  \"period_us\": %u,\n", (unsigned)config->period_us);
    put_times(file, "jitter_us", &stats->jitter);
    put_times(file, "interval_us", &stats->interval);
    put_times(file, "exchange_us", &stats->exchange);
    put_times(file, "step_us", &stats->step);
    fprintf(file, "  \"lead_us\": %u,\n", (unsigned)stats->last.lead_us);
    fprintf(file, "  \"drift_us\": %lld,\n", (long long)drift_us(stats, config));
    fprintf(file, "  \"rows_lost\": %llu,\n", (unsigned long long)stats->run.rows_lost);
    fprintf(file, "  \"records_lost\": %llu,\n", (unsigned long long)stats->run.records_lost);
}

static void put_box(FILE *file, const struct cb_counters *box) {
    const char *comma = "";
    fputs("  \"box\": {", file);
#define CB_X(name)                                                    \
    fprintf(file, "%s\"" #name "\": %u", comma, (unsigned)box->name); \
    comma = ", ";
    CB_COUNTERS(CB_X)
#undef CB_X
    fputs("},\n", file);
}

/* Writes the counters by signal name, without signals that have none. */
static void put_signals(FILE *file, const struct cb_config *config, const struct cb_row *row) {
    const char *comma = "";
    fputs("  \"signals\": {", file);
    for (unsigned i = 0; i < config->signals_count; i++) {
        const struct cb_row_signal *counts = &row->signal_counts[i];
        if (counts->implausible == 0 && counts->stale == 0) continue;
        fprintf(file, "%s\"%s\": {\"implausible\": %u, \"stale\": %u}", comma,
                config->signals[i].name, (unsigned)counts->implausible, (unsigned)counts->stale);
        comma = ", ";
    }
    fputs("},\n", file);
}

static void put_channels(FILE *file, const struct cb_config *config, const struct cb_row *row) {
    const char *comma = "";
    fputs("  \"channels\": {", file);
    for (unsigned i = 0; i < config->channels_count; i++) {
        const struct cb_row_channel *counts = &row->channel_counts[i];
        if (counts->limited == 0 && counts->excessive == 0) continue;
        fprintf(file, "%s\"%s\": {\"limited\": %u, \"excessive\": %u}", comma,
                config->channels[i].name, (unsigned)counts->limited, (unsigned)counts->excessive);
        comma = ", ";
    }
    fputs("},\n", file);
}

static void put_cause(FILE *file, const struct cb_row_cause *cause) {
    char text[CB_CAUSE_TEXT];
    cb_cause_text(cause, text);
    fputs("\"cause\": ", file);
    cb_stats_put_string(file, text);
}

static void put_exceptions(FILE *file, const uint32_t *by_code, unsigned codes) {
    const char *comma = "";
    fputs(", \"exceptions_by_code\": {", file);
    for (unsigned code = 0; code < codes; code++) {
        if (by_code[code] == 0) continue;
        fprintf(file, "%s\"%u\": %u", comma, code, (unsigned)by_code[code]);
        comma = ", ";
    }
    fputs("}", file);
}

#define CB_X(name) fprintf(file, ", \"" #name "\": %u", (unsigned)counters->name);

static void put_tcp(FILE *file, const struct cb_tcp_counters *counters) {
    CB_TCP_COUNTERS(CB_X)
    put_exceptions(file, counters->exceptions_by_code, CB_TCP_EXCEPTIONS);
}

static void put_rtu(FILE *file, const struct cb_rtu_counters *counters) {
    CB_RTU_COUNTERS(CB_X)
    put_exceptions(file, counters->exceptions_by_code, CB_RTU_EXCEPTIONS);
}
#undef CB_X

/* Writes members of "plc": replies that do not match, refused functions, slowest reply in µs. */
static void put_peer(FILE *file, const struct cb_peer *peer) {
    static const char *const words[] = {
#define CB_X(name, word, sentence) [name] = word,
        CB_ODD_REPLIES(CB_X)
#undef CB_X
    };
    const char *comma = "";
    fputs(", \"odd_replies\": {", file);
    for (unsigned kind = 0; kind < CB_ODD_COUNT; kind++)
        fprintf(file, "%s\"%s\": %u", kind == 0 ? "" : ", ", words[kind],
                (unsigned)peer->odd[kind].count);
    fputs("}, \"refused_functions\": [", file);
    for (unsigned function = 0; function < 32; function++) {
        if (!(peer->refused_functions & 1u << function)) continue;
        fprintf(file, "%s%u", comma, function);
        comma = ", ";
    }
    fprintf(file, "], \"slowest_reply_us\": %u", (unsigned)cb_peer_slowest_us(peer));
}

static void put_plc(FILE *file, const struct cb_stats *stats) {
    const struct cb_row_link *link = &stats->last.link;
    fputs("  \"plc\": {\"address\": ", file);
    cb_stats_put_string(file, stats->run.plc);
    fprintf(file, ", \"connects\": %u, \"connects_failed\": %u, \"disconnects\": %u",
            (unsigned)link->connects, (unsigned)link->failures, (unsigned)link->disconnects);
    if (stats->last.transport == CB_TRANSPORT_RTU)
        put_rtu(file, &stats->last.rtu);
    else
        put_tcp(file, &stats->last.tcp);
    put_peer(file, &stats->last.peer);
    fputs("},\n", file);
}

static void put_change(FILE *file, const struct cb_stats *stats,
                       const struct cb_stats_change *change) {
    fprintf(file, "{\"time_s\": %.3f, \"mode\": \"%s\", \"reason\": \"%s\", ",
            (double)(change->time_us - stats->first_us) * 1e-6, cb_mode_name(change->mode),
            cb_reason_text(change->reason));
    put_cause(file, &change->cause);
    fputs("}", file);
}

static void put_history(FILE *file, const struct cb_stats *stats) {
    uint32_t left_out = stats->changes > CB_STATS_HISTORY ? stats->changes - CB_STATS_HISTORY : 0;
    fprintf(file, "  \"history_left_out\": %u,\n  \"history\": [", (unsigned)left_out);
    for (uint32_t i = left_out; i < stats->changes; i++) {
        fputs(i == left_out ? "\n    " : ",\n    ", file);
        put_change(file, stats, &stats->history[i % CB_STATS_HISTORY]);
    }
    fputs("],\n", file);
}

/* Writes the whole JSON object; the order of its members is that of docs/compboxd.md. */
static void put_all(FILE *file, const struct cb_stats *stats, const struct cb_config *config) {
    fputs("{\n", file);
    put_run(file, stats, config);
    put_ceiling(file, &stats->run, config);
    put_reloads(file, &stats->run);
    put_cycles(file, stats, config);
    put_box(file, &stats->last.box);
    put_signals(file, config, &stats->last);
    put_channels(file, config, &stats->last);
    put_plc(file, stats);
    if (stats->run.can_used) cb_stats_put_can(file, &config->can, &stats->last);
    if (stats->run.bus != NULL) cb_stats_put_bus(file, stats->run.bus);
    put_history(file, stats);
    fprintf(file, "  \"mode\": \"%s\",\n  \"reason\": \"%s\",\n  ", cb_mode_name(stats->last.mode),
            cb_reason_text(stats->last.reason));
    put_cause(file, &stats->last.cause);
    fputs("\n}\n", file);
}

/* Closes the file; out: 0 when everything is on the disk, else errno. */
static int finish(FILE *file) {
    int error = fflush(file) != 0 || ferror(file) || fsync(fileno(file)) != 0 ? errno : 0;
    if (fclose(file) != 0 && error == 0) error = errno;
    return error;
}

int cb_stats_write(const struct cb_stats *stats, const struct cb_config *config, const char *path) {
    char temporary[4096];
    const int fd = cb_output_begin(path, temporary, sizeof temporary);
    if (fd < 0) return errno;
    FILE *file = fdopen(fd, "w");
    if (file == NULL) {
        const int error = errno;
        close(fd);
        return cb_output_replace(path, temporary, error);
    }
    put_all(file, stats, config);
    return cb_output_replace(path, temporary, finish(file));
}
