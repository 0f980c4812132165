/* SPDX-License-Identifier: MIT
 * The file of statistics. */
#include <stdio.h>

#include "firmware/box/mode.h"
#include "hal/linux/files/can_words.h"
#include "hal/linux/files/cause_words.h"
#include "hal/linux/files/ceiling_words.h"
#include "hal/linux/files/stats.h"

static double us(int64_t ns) {
    return (double)ns * 1e-3;
}

static void put_times(struct cb_writer *json, const char *key, const struct cb_histogram *times) {
    cb_writer_object(json, key);
    cb_writer_whole(json, "count", (int64_t)times->count);
    cb_writer_thousandths(json, "min", us(times->min_ns));
    cb_writer_thousandths(json, "mean", cb_histogram_mean(times) * 1e-3);
    cb_writer_thousandths(json, "p50", us(cb_histogram_percentile(times, 0.5)));
    cb_writer_thousandths(json, "p99", us(cb_histogram_percentile(times, 0.99)));
    cb_writer_thousandths(json, "max", us(times->max_ns));
    cb_writer_close(json);
}

/* Wake-ups against start + n * period, over the whole run: the error that relative sleeps would
 * accumulate. */
static int64_t drift_us(const struct cb_stats *stats, const struct cb_config *config) {
    if (stats->rows == 0) return 0;
    int64_t ticks = stats->last.tick - stats->first_tick;
    return stats->last.time_us - stats->first_us - ticks * (int64_t)config->period_us;
}

/* Writes the members about program, file and scheduling, which begin the statistics. */
static void put_run(struct cb_writer *json, const struct cb_stats *stats,
                    const struct cb_config *config) {
    const struct cb_stats_run *run = &stats->run;
    cb_writer_text(json, "format", "compboxd-stats/1");
    cb_writer_text(json, "version", CB_VERSION);
    cb_writer_text(json, "config", run->config_file);
    cb_writer_text(json, "machine", config->machine);
    cb_writer_whole(json, "revision", config->revision);
    cb_writer_whole(json, "started_unix_s", run->started_unix_s);
    cb_writer_thousandths(json, "elapsed_s",
                          (double)(stats->last.time_us - stats->first_us) * 1e-6);
    cb_writer_truth(json, "finished", run->finished);
    cb_writer_truth(json, "stopped", run->stopped);
    cb_writer_object(json, "realtime");
    cb_writer_whole(json, "priority", run->priority);
    cb_writer_truth(json, "memory_locked", run->memory_locked);
    cb_writer_truth(json, "cpu_latency_held", run->cpu_latency_held);
    cb_writer_close(json);
}

/* Writes the site's ceiling, 0 if there is none, and the channels that it limits. */
static void put_ceiling(struct cb_writer *json, const struct cb_stats_run *run,
                        const struct cb_config *config) {
    char names[1024];
    cb_lowered_names(config, run->lowered, names, sizeof names);
    cb_writer_object(json, "ceiling");
    cb_writer_number(json, "um", (double)run->ceiling.um);
    cb_writer_number(json, "um_per_s", (double)run->ceiling.um_per_s);
    cb_writer_text(json, "lowers", names);
    cb_writer_close(json);
}

static void put_reloads(struct cb_writer *json, const struct cb_stats_run *run) {
    cb_writer_object(json, "reloads");
    cb_writer_whole(json, "taken", run->reloads_taken);
    cb_writer_whole(json, "refused", run->reloads_refused);
    cb_writer_truth(json, "pending", run->reload_pending);
    cb_writer_text(json, "last", run->reload_message == NULL ? "" : run->reload_message);
    cb_writer_close(json);
}

static void put_cycles(struct cb_writer *json, const struct cb_stats *stats,
                       const struct cb_config *config) {
    cb_writer_whole(json, "cycles", stats->last.box.cycles);
    cb_writer_whole(json, "overruns", stats->last.box.missed_ticks);
    cb_writer_whole(json, "period_us", config->period_us);
    put_times(json, "jitter_us", &stats->jitter);
    put_times(json, "interval_us", &stats->interval);
    put_times(json, "exchange_us", &stats->exchange);
    put_times(json, "step_us", &stats->step);
    cb_writer_whole(json, "lead_us", stats->last.lead_us);
    cb_writer_whole(json, "drift_us", drift_us(stats, config));
    cb_writer_whole(json, "rows_lost", (int64_t)stats->run.rows_lost);
    cb_writer_whole(json, "records_lost", (int64_t)stats->run.records_lost);
}

#define CB_X(name) cb_writer_whole(json, #name, counters->name);

void cb_stats_put_box(struct cb_writer *json, const char *key, const struct cb_counters *counters) {
    cb_writer_object(json, key);
    CB_COUNTERS(CB_X)
    cb_writer_close(json);
}

/* Writes the counters by signal name, without signals that have none. */
static void put_signals(struct cb_writer *json, const struct cb_config *config,
                        const struct cb_row *row) {
    cb_writer_object(json, "signals");
    for (unsigned i = 0; i < config->signals_count; i++) {
        const struct cb_row_signal *signal = &row->signals[i];
        if (signal->implausible == 0 && signal->stale == 0) continue;
        cb_writer_object(json, config->signals[i].name);
        cb_writer_whole(json, "implausible", signal->implausible);
        cb_writer_whole(json, "stale", signal->stale);
        cb_writer_close(json);
    }
    cb_writer_close(json);
}

static void put_channels(struct cb_writer *json, const struct cb_config *config,
                         const struct cb_row *row) {
    cb_writer_object(json, "channels");
    for (unsigned i = 0; i < config->channels_count; i++) {
        const struct cb_row_channel *channel = &row->channels[i];
        if (channel->limited == 0 && channel->excessive == 0) continue;
        cb_writer_object(json, config->channels[i].name);
        cb_writer_whole(json, "limited", channel->limited);
        cb_writer_whole(json, "excessive", channel->excessive);
        cb_writer_close(json);
    }
    cb_writer_close(json);
}

static void put_state(struct cb_writer *json, uint8_t mode, uint8_t reason,
                      const struct cb_row_cause *cause) {
    char text[CB_CAUSE_TEXT];
    cb_cause_text(cause, text);
    cb_writer_text(json, "mode", cb_mode_name(mode));
    cb_writer_text(json, "reason", cb_reason_text(reason));
    cb_writer_text(json, "cause", text);
}

static void put_exceptions(struct cb_writer *json, const uint32_t *by_code, unsigned codes) {
    cb_writer_object(json, "exceptions_by_code");
    for (unsigned code = 0; code < codes; code++) {
        char name[12];
        snprintf(name, sizeof name, "%u", code);
        if (by_code[code] != 0) cb_writer_whole(json, name, by_code[code]);
    }
    cb_writer_close(json);
}

static void put_tcp(struct cb_writer *json, const struct cb_tcp_counters *counters) {
    CB_TCP_COUNTERS(CB_X)
    put_exceptions(json, counters->exceptions_by_code, CB_TCP_EXCEPTIONS);
}

static void put_rtu(struct cb_writer *json, const struct cb_rtu_counters *counters) {
    CB_RTU_COUNTERS(CB_X)
    put_exceptions(json, counters->exceptions_by_code, CB_RTU_EXCEPTIONS);
}
#undef CB_X

/* Writes members of "plc": replies that do not match, refused functions, slowest reply. */
static void put_peer(struct cb_writer *json, const struct cb_peer *peer) {
    static const char *const words[] = {
#define CB_X(name, word, sentence) [name] = word,
        CB_ODD_REPLIES(CB_X)
#undef CB_X
    };
    cb_writer_object(json, "odd_replies");
    for (unsigned kind = 0; kind < CB_ODD_COUNT; kind++)
        cb_writer_whole(json, words[kind], peer->odd[kind].count);
    cb_writer_close(json);
    cb_writer_array(json, "refused_functions");
    for (unsigned function = 0; function < 32; function++)
        if (peer->refused_functions & 1u << function) cb_writer_whole(json, NULL, function);
    cb_writer_close(json);
    cb_writer_whole(json, "slowest_reply_us", cb_peer_slowest_us(peer));
}

static void put_plc(struct cb_writer *json, const struct cb_stats *stats) {
    const struct cb_row_link *link = &stats->last.link;
    cb_writer_object(json, "plc");
    cb_writer_text(json, "address", stats->run.plc);
    cb_writer_whole(json, "connects", link->connects);
    cb_writer_whole(json, "connects_failed", link->failures);
    cb_writer_whole(json, "disconnects", link->disconnects);
    if (stats->last.transport == CB_TRANSPORT_RTU)
        put_rtu(json, &stats->last.rtu);
    else
        put_tcp(json, &stats->last.tcp);
    put_peer(json, &stats->last.peer);
    cb_writer_close(json);
}

static void put_history(struct cb_writer *json, const struct cb_stats *stats) {
    uint32_t left_out = stats->changes > CB_STATS_HISTORY ? stats->changes - CB_STATS_HISTORY : 0;
    cb_writer_whole(json, "history_left_out", left_out);
    cb_writer_array(json, "history");
    for (uint32_t i = left_out; i < stats->changes; i++) {
        const struct cb_stats_change *change = &stats->history[i % CB_STATS_HISTORY];
        cb_writer_object(json, NULL);
        cb_writer_thousandths(json, "time_s", (double)(change->time_us - stats->first_us) * 1e-6);
        put_state(json, change->mode, change->reason, &change->cause);
        cb_writer_close(json);
    }
    cb_writer_close(json);
}

struct document {
    const struct cb_stats *stats;
    const struct cb_config *config;
};

/* Writes all members, in the order of docs/compboxd.md. */
static void put_all(struct cb_writer *json, const void *from) {
    const struct document *document = from;
    const struct cb_stats *stats = document->stats;
    const struct cb_config *config = document->config;
    put_run(json, stats, config);
    put_ceiling(json, &stats->run, config);
    put_reloads(json, &stats->run);
    put_cycles(json, stats, config);
    cb_stats_put_box(json, "box", &stats->last.box);
    put_signals(json, config, &stats->last);
    put_channels(json, config, &stats->last);
    put_plc(json, stats);
    if (stats->run.can_used) cb_stats_put_can(json, &config->can, &stats->last);
    if (stats->run.bus != NULL) cb_stats_put_bus(json, stats->run.bus);
    put_history(json, stats);
    put_state(json, stats->last.mode, stats->last.reason, &stats->last.cause);
}

int cb_stats_write(const struct cb_stats *stats, const struct cb_config *config, const char *path) {
    const struct document document = {stats, config};
    return cb_writer_replace(path, true, put_all, &document);
}
