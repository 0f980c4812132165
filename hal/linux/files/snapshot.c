/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/snapshot.h"

#include <math.h>
#include <stdio.h>
#include <time.h>

#include "firmware/box/mode.h"
#include "hal/linux/files/cause_words.h"
#include "models/num.h"

struct document {
    const struct cb_stats *stats;
    const struct cb_config *config;
    uint32_t crc32;
};

static double unix_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void put_run(struct cb_writer *json, const struct document *from) {
    const struct cb_stats_run *run = &from->stats->run;
    char crc[12];
    snprintf(crc, sizeof crc, "%08x", (unsigned)from->crc32);
    cb_writer_whole(json, "snapshot", CB_SNAPSHOT_VERSION);
    cb_writer_thousandths(json, "unix_s", unix_s());
    cb_writer_whole(json, "started_unix_s", run->started_unix_s);
    cb_writer_text(json, "version", CB_VERSION);
    cb_writer_text(json, "machine", from->config->machine);
    cb_writer_whole(json, "revision", from->config->revision);
    cb_writer_text(json, "crc", crc);
    cb_writer_text(json, "plc", run->plc);
    cb_writer_truth(json, "finished", run->finished);
}

/* The cause as a sentence and in its parts; null without one. */
static void put_cause(struct cb_writer *json, const struct cb_row_cause *cause) {
    const struct cb_cause_words words = cb_cause_words_of(cause->cause.kind);
    char text[CB_CAUSE_TEXT];
    if (cause->cause.kind == CB_CAUSE_NONE) {
        cb_writer_null(json, "cause");
        return;
    }
    cb_cause_text(cause, text);
    cb_writer_object(json, "cause");
    cb_writer_text(json, "text", text);
    cb_writer_text(json, "of", words.what);
    cb_writer_text(json, "name", cause->name);
    if (words.between[0] != '\0') {
        cb_writer_number(json, "value", (double)cause->cause.value);
        cb_writer_number(json, "bound", (double)cause->cause.bound);
    }
    cb_writer_close(json);
}

static const char *state_word(uint8_t state) {
    static const char *const words[] = {
#define CB_X(name, word) [name] = word,
        CB_ROW_SIGNAL_STATES(CB_X)
#undef CB_X
    };
    return words[state];
}

/* Writes the value and the age as null where there is none. */
static void put_signals(struct cb_writer *json, const struct cb_config *config,
                        const struct cb_row *row) {
    cb_writer_array(json, "signals");
    for (unsigned i = 0; i < config->signals_count; i++) {
        const struct cb_row_signal *signal = &row->signals[i];
        const bool known = signal->state != CB_ROW_SIGNAL_NEVER;
        cb_writer_object(json, NULL);
        cb_writer_text(json, "name", config->signals[i].name);
        cb_writer_text(json, "unit", config->signals[i].unit);
        cb_writer_number(json, "value", known ? (double)signal->value : (double)NAN);
        cb_writer_number(json, "age_ms",
                         known ? 1e-3 * (double)(row->step_at_us - signal->time_us) : (double)NAN);
        cb_writer_text(json, "state", state_word(signal->state));
        cb_writer_whole(json, "implausible", signal->implausible);
        cb_writer_whole(json, "stale", signal->stale);
        cb_writer_close(json);
    }
    cb_writer_close(json);
}

/* out: standard deviation of an output, µm; NaN if none is known, as before the first cycle */
static double sigma_of(const struct cb_row *row, unsigned output) {
    return row->step_at_us != 0 ? (double)row->sigma_um[output] : (double)NAN;
}

static void put_terms(struct cb_writer *json, const struct cb_config *config,
                      const struct cb_row *row) {
    cb_writer_array(json, "terms");
    for (unsigned i = 0; i < config->outputs_count; i++) {
        cb_writer_object(json, NULL);
        cb_writer_text(json, "name", config->outputs[i].name);
        cb_writer_number(json, "value", (double)row->outputs[i]);
        cb_writer_number(json, "sigma_um", sigma_of(row, i));
        cb_writer_close(json);
    }
    cb_writer_close(json);
}

/* Writes what its probe has made of one term, and the standard deviation of its value. */
static void put_adapted(struct cb_writer *json, const struct cb_config *config, unsigned i,
                        const struct cb_row *row) {
    const struct cb_term_config *term = &config->terms[config->adapts[i]];
    const struct cb_adapt_config *adapt = &term->as.adapt;
    const struct cb_probe_state *probe = &row->probes[i];
    const struct cb_adapt *filter = &probe->filter;
    cb_writer_object(json, NULL);
    cb_writer_text(json, "name", config->outputs[term->first_output].name);
    cb_writer_text(json, "of", config->outputs[adapt->output].name);
    cb_writer_number(json, "bias_um", (double)filter->bias_um);
    cb_writer_number(json, "gain", (double)filter->gain);
    cb_writer_number(json, "sigma_um", sigma_of(row, term->first_output));
    const bool judged = filter->expected_um > 0.0f;
    cb_writer_number(json, "innovation_um", judged ? (double)filter->innovation_um : (double)NAN);
    cb_writer_number(json, "expected_um", judged ? (double)filter->expected_um : (double)NAN);
    cb_writer_number(json, "cusum", (double)cb_adapt_cusum(filter));
    cb_writer_truth(json, "asks", filter->asked == 1);
    cb_writer_whole(json, "taken", probe->taken);
    cb_writer_whole(json, "asked", probe->asked);
    cb_writer_whole(json, "refused", probe->refused);
    cb_writer_whole(json, "skipped", probe->skipped);
    cb_writer_close(json);
}

/* Only for a file with terms that probes adapt. */
static void put_all_adapted(struct cb_writer *json, const struct cb_config *config,
                            const struct cb_row *row) {
    if (config->adapts_count == 0) return;
    cb_writer_array(json, "adapted");
    for (unsigned i = 0; i < config->adapts_count; i++) put_adapted(json, config, i, row);
    cb_writer_close(json);
}

/* out: the output is still on its way to the demand */
static bool is_slewed(const struct cb_channel_config *config,
                      const struct cb_row_channel *channel) {
    const float wanted_um = cb_clamp(channel->wanted_um, -config->most_um, config->most_um);
    const float near_um = cb_max(config->deadband_um, config->unit_um);
    return cb_abs(wanted_um - channel->output_um) > near_um;
}

/* Writes the demand, what became of it, and the terms behind it. */
static void put_channel(struct cb_writer *json, const struct cb_config *config, unsigned i,
                        const struct cb_row *row) {
    const struct cb_channel_config *one = &config->channels[i];
    const struct cb_row_channel *channel = &row->channels[i];
    cb_writer_object(json, NULL);
    cb_writer_text(json, "name", one->name);
    cb_writer_number(json, "demand_um", (double)channel->wanted_um);
    cb_writer_number(json, "output_um", (double)channel->output_um);
    cb_writer_number(json, "applied_um",
                     one->has_applied ? (double)channel->applied_um : (double)NAN);
    cb_writer_number(json, "limit_um", (double)one->limit_um);
    cb_writer_number(json, "limit_used", (double)(cb_abs(channel->output_um) / one->limit_um));
    cb_writer_truth(json, "slewed", row->mode == CB_MODE_ACTIVE && is_slewed(one, channel));
    cb_writer_array(json, "terms");
    for (unsigned k = 0; k < one->sum_count; k++)
        cb_writer_text(json, NULL, config->outputs[one->sum[k]].name);
    cb_writer_close(json);
    cb_writer_whole(json, "limited", channel->limited);
    cb_writer_whole(json, "excessive", channel->excessive);
    cb_writer_close(json);
}

static void put_channels(struct cb_writer *json, const struct cb_config *config,
                         const struct cb_row *row) {
    cb_writer_array(json, "channels");
    for (unsigned i = 0; i < config->channels_count; i++) put_channel(json, config, i, row);
    cb_writer_close(json);
}

/* Counts of times up to bounds, as Prometheus has them: the last one is the count of all. */
static void put_times(struct cb_writer *json, const char *key, const struct cb_histogram *times) {
    static const int32_t bounds_us[] = {10,   20,   50,    100,   200,   500,   1000,
                                        2000, 5000, 10000, 20000, 50000, 100000};
    cb_writer_object(json, key);
    cb_writer_whole(json, "count", (int64_t)times->count);
    cb_writer_thousandths(json, "sum", times->sum_ns * 1e-3);
    cb_writer_thousandths(json, "p50", 1e-3 * (double)cb_histogram_percentile(times, 0.5));
    cb_writer_thousandths(json, "p99", 1e-3 * (double)cb_histogram_percentile(times, 0.99));
    cb_writer_thousandths(json, "max", 1e-3 * (double)times->max_ns);
    cb_writer_object(json, "up_to");
    for (unsigned i = 0; i < sizeof bounds_us / sizeof bounds_us[0]; i++) {
        char bound[12];
        snprintf(bound, sizeof bound, "%d", (int)bounds_us[i]);
        cb_writer_whole(json, bound, (int64_t)cb_histogram_up_to(times, 1000LL * bounds_us[i]));
    }
    cb_writer_close(json);
    cb_writer_close(json);
}

/* Writes all members, in the order of docs/snapshot.md. */
static void put_all(struct cb_writer *json, const void *of) {
    const struct document *from = of;
    const struct cb_stats *stats = from->stats;
    const struct cb_row *row = &stats->last;
    put_run(json, from);
    cb_writer_text(json, "mode", cb_mode_name(row->mode));
    cb_writer_text(json, "reason",
                   stats->rows == 0 ? "no cycle has run yet" : cb_reason_text(row->reason));
    put_cause(json, &row->cause);
    put_signals(json, from->config, row);
    put_terms(json, from->config, row);
    put_all_adapted(json, from->config, row);
    put_channels(json, from->config, row);
    cb_stats_put_box(json, "counters", &row->box);
    cb_writer_whole(json, "period_us", from->config->period_us);
    cb_writer_whole(json, "lead_us", row->lead_us);
    put_times(json, "jitter_us", &stats->jitter);
    put_times(json, "exchange_us", &stats->exchange);
    if (stats->run.can_used) cb_stats_put_can(json, &from->config->can, row);
    if (stats->run.bus != NULL) cb_stats_put_bus(json, stats->run.bus);
}

int cb_snapshot_write(const struct cb_stats *stats, const struct cb_config *config, uint32_t crc32,
                      const char *path) {
    const struct document document = {stats, config, crc32};
    return cb_writer_replace(path, false, put_all, &document);
}
