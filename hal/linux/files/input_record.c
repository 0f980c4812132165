/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/input_record.h"

#include <errno.h>
#include <inttypes.h>
#include <string.h>
#include <unistd.h>

#include "hal/linux/files/output_file.h"

static const char header[] =
    "number,generation,now_us,read_us,exchange_us,read_ok,last_write,held,stop,missed_ticks,"
    "samples,"
    "registers,held_registers,mode,channels,written\n";

static uint32_t bits_of(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static void put_registers(FILE *file, const uint16_t *registers, unsigned count) {
    fputc(',', file);
    for (unsigned i = 0; i < count; i++) fprintf(file, "%04x", (unsigned)registers[i]);
}

/* Writes SIGNAL:BITS:TIME_US, separated by blanks. */
static void put_samples(FILE *file, const struct cb_inputs *in) {
    fputc(',', file);
    for (unsigned i = 0; i < in->sample_count; i++) {
        const struct cb_sample *sample = &in->samples[i];
        fprintf(file, "%s%u:%08" PRIx32 ":%" PRId64, i > 0 ? " " : "", (unsigned)sample->signal,
                bits_of(sample->raw), sample->time_us);
    }
}

int cb_input_record_start(struct cb_input_record *record, const char *path) {
    *record = (struct cb_input_record){0};
    if (path == NULL) return 0;
    const int fd = cb_output_open(path);
    if (fd < 0) return errno;
    record->file = fdopen(fd, "w");
    if (record->file == NULL) {
        record->error = errno;
        close(fd);
        return record->error;
    }
    return 0;
}

/* Writes LAG:HI:LO of each lag of a bank that goes on, then SIGNAL:VALUE:TIME_US of each signal. */
static void put_bank(FILE *file, const struct cb_bank_state *bank) {
    const char *before = ",bank,";
    for (unsigned i = 0; i < CB_MAX_BANK_LAGS; i++) {
        if (!cb_bank_is_settled(bank, i)) continue;
        fprintf(file, "%s%u:%08" PRIx32 ":%08" PRIx32, before, i, bits_of(bank->lags[i].hi),
                bits_of(bank->lags[i].lo));
        before = " ";
    }
    if (before[0] == ',') return; /* none */
    for (unsigned i = 0; i < CB_MAX_SIGNALS; i++)
        fprintf(file, "%s%u:%08" PRIx32 ":%" PRId64, i == 0 ? ",inputs," : " ", i,
                bits_of(bank->value[i]), bank->time_us[i]);
}

/* Writes TERM:WORDS:TIME_US of each adapted term that goes on, WORDS being struct cb_adapt in
 * hexadecimal. */
static void put_probes(FILE *file, const struct cb_probe_state *probes) {
    const char *before = ",probes,";
    for (unsigned i = 0; i < CB_MAX_ADAPTS; i++) {
        uint32_t words[sizeof probes[i].filter / 4];
        if (!probes[i].timed) continue;
        memcpy(words, &probes[i].filter, sizeof words);
        fprintf(file, "%s%u:", before, i);
        for (unsigned k = 0; k < sizeof words / 4; k++) fprintf(file, "%08" PRIx32, words[k]);
        fprintf(file, ":%" PRId64, probes[i].grown_us);
        before = " ";
    }
}

/* Writes SIGNAL:HI:LO:INPUT:TIME_US of each lag that goes on, separated by blanks. */
static void put_state(FILE *file, const struct cb_state *state) {
    fprintf(file, "stopped,%d,beat,%d,plc_heartbeat,%u,beat_us,%" PRId64 ",lags,", state->stopped,
            state->beat, (unsigned)state->plc_heartbeat, state->beat_us);
    const char *before = "";
    for (unsigned i = 0; i < CB_MAX_SIGNALS; i++) {
        const struct cb_lag_state *lag = &state->lags[i];
        if (!lag->settled) continue;
        fprintf(file, "%s%u:%08" PRIx32 ":%08" PRIx32 ":%08" PRIx32 ":%" PRId64, before, i,
                bits_of(lag->lag.hi), bits_of(lag->lag.lo), bits_of(lag->lag.input), lag->time_us);
        before = " ";
    }
    put_bank(file, &state->bank);
    put_probes(file, state->probes);
    fputc('\n', file);
}

/* The first error ends the record: rows behind a gap could not be replayed. */
static void note_error(struct cb_input_record *record) {
    if (ferror(record->file)) record->error = errno;
}

void cb_input_record_begin(struct cb_input_record *record, const struct cb_ceiling *ceiling,
                           const struct cb_state *resumed) {
    if (record->file == NULL) return;
    fprintf(record->file, "most_um,%.9g,most_um_per_s,%.9g\n", (double)ceiling->um,
            (double)ceiling->um_per_s);
    put_state(record->file, resumed);
    fputs(header, record->file);
    note_error(record);
}

void cb_input_record_add(struct cb_input_record *record, const struct cb_config *config,
                         const struct cb_row *row) {
    FILE *file = record->file;
    const struct cb_inputs *in = &row->in;
    if (file == NULL || record->error != 0) return;
    fprintf(file, "%" PRIu64 ",%" PRIu32 ",%" PRId64 ",%" PRId64 ",%" PRIu32, row->number,
            row->generation, row->step_at_us, in->read_us, in->exchange_us);
    fprintf(file, ",%d,%u,%u,%d,%" PRIu32, in->read_ok, (unsigned)in->last_write,
            (unsigned)in->held, in->stop, in->missed_ticks);
    put_samples(file, in);
    put_registers(file, in->registers, config->plc.read.count);
    put_registers(file, in->held_registers,
                  in->held == CB_TRANSFER_OK ? config->plc.write.count : 0);
    fprintf(file, ",%u,", (unsigned)row->mode);
    for (unsigned i = 0; i < config->channels_count; i++)
        fprintf(file, "%08" PRIx32, bits_of(row->channels[i].output_um));
    put_registers(file, row->written, config->plc.write.count);
    fputc('\n', file);
    note_error(record);
}

int cb_input_record_finish(struct cb_input_record *record) {
    if (record->file == NULL) return record->error;
    const int error = fclose(record->file) == 0 ? 0 : errno;
    if (record->error == 0) record->error = error;
    record->file = NULL;
    return record->error;
}
