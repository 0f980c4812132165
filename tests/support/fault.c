/* SPDX-License-Identifier: MIT */
#include "tests/support/fault.h"

#include <string.h>

static int64_t inner_now(const struct cb_faults *faults) {
    return faults->inner.now_us(faults->inner.context);
}

static bool in_window(const struct cb_fault_rule *rule, int64_t now_us) {
    return now_us >= rule->from_us && now_us < rule->until_us;
}

/* The active rule of this kind, or NULL. */
static const struct cb_fault_rule *in_force(const struct cb_faults *faults,
                                            enum cb_fault_kind kind) {
    const int64_t now_us = inner_now(faults);
    for (size_t i = 0; i < faults->count; ++i) {
        const struct cb_fault_rule *rule = &faults->rules[i];
        const uint32_t every = rule->every > 1 ? rule->every : 1;
        const bool turn = rule->cycles == 0 || (rule->cycles - 1) % every == 0;
        if (rule->kind == kind && in_window(rule, now_us) && turn) return rule;
    }
    return NULL;
}

static bool strikes(struct cb_faults *faults, enum cb_fault_kind kind) {
    const bool now = in_force(faults, kind) != NULL;
    faults->injected += now;
    return now;
}

static void pass(struct cb_faults *faults, int64_t until_us) {
    if (faults->pass) faults->pass(faults->inner.context, until_us);
}

/* Deadlines are in the box's clock; the inner hardware has the true one. */
static int64_t clock_error(const struct cb_faults *faults) {
    const struct cb_fault_rule *rule = in_force(faults, CB_FAULT_CLOCK);
    return rule ? rule->number : 0;
}

static int64_t fault_now_us(void *context) {
    const struct cb_faults *faults = context;
    return inner_now(faults) + clock_error(faults);
}

static uint32_t fault_wait_tick(void *context) {
    struct cb_faults *faults = context;
    uint32_t missed = faults->inner.wait_tick(faults->inner.context);
    const int64_t now_us = inner_now(faults);
    for (size_t i = 0; i < faults->count; ++i)
        faults->rules[i].cycles += in_window(&faults->rules[i], now_us);
    const struct cb_fault_rule *rule = in_force(faults, CB_FAULT_MISS_TICKS);
    faults->injected += rule != NULL;
    for (int64_t i = 0; rule && i < rule->number; ++i)
        missed += 1 + faults->inner.wait_tick(faults->inner.context);
    return missed;
}

/* Changes a reading by the faults that apply to readings. */
static void spoil(struct cb_faults *faults, uint16_t start, uint16_t count, uint16_t *registers) {
    uint16_t true_reading[CB_FAULT_REGISTERS];
    const bool known = faults->last_start == start && faults->last_count == count;
    if (count > CB_FAULT_REGISTERS) return;
    memcpy(true_reading, registers, count * sizeof *registers);
    if (known && strikes(faults, CB_FAULT_TORN))
        memcpy(registers + count / 2, faults->last + count / 2,
               (count - count / 2u) * sizeof *registers);
    const struct cb_fault_rule *freeze = in_force(faults, CB_FAULT_FREEZE);
    if (known && freeze && freeze->number >= start && freeze->number < start + count) {
        registers[freeze->number - start] = faults->last[freeze->number - start];
        true_reading[freeze->number - start] = registers[freeze->number - start];
        ++faults->injected;
    }
    /* only of the first block ever read, the PLC's read block; not of a read-back */
    if (!known && faults->last_count > 0) return;
    memcpy(faults->last, true_reading, count * sizeof *registers);
    faults->last_start = start;
    faults->last_count = count;
}

/* in : result of the request at the inner hardware
 * out: result for the box; *registers of a reading unchanged unless OK */
static enum cb_transfer late(struct cb_faults *faults, enum cb_transfer transfer,
                             int64_t deadline_us) {
    if (transfer == CB_TRANSFER_FAILED || !strikes(faults, CB_FAULT_LATE)) return transfer;
    pass(faults, deadline_us);
    return CB_TRANSFER_UNKNOWN;
}

static enum cb_transfer fault_read(void *context, uint16_t start, uint16_t count,
                                   uint16_t *registers, int64_t deadline_us) {
    struct cb_faults *faults = context;
    uint16_t reading[CB_FAULT_REGISTERS];
    const int64_t true_deadline_us = deadline_us - clock_error(faults);
    if (count > CB_FAULT_REGISTERS || strikes(faults, CB_FAULT_DROP)) return CB_TRANSFER_FAILED;
    if (strikes(faults, CB_FAULT_REFUSE_READ)) return CB_TRANSFER_REFUSED;
    enum cb_transfer result =
        faults->inner.read(faults->inner.context, start, count, reading, true_deadline_us);
    result = late(faults, result, true_deadline_us);
    if (result != CB_TRANSFER_OK) return result;
    spoil(faults, start, count, reading);
    memcpy(registers, reading, count * sizeof *registers);
    return CB_TRANSFER_OK;
}

/* Faults that end a write before it reaches the inner hardware. out: true and *result. */
static bool write_stopped(struct cb_faults *faults, int64_t true_deadline_us,
                          enum cb_transfer *result) {
    if (strikes(faults, CB_FAULT_DROP)) {
        *result = CB_TRANSFER_FAILED;
        return true;
    }
    if (strikes(faults, CB_FAULT_REFUSE_WRITE)) {
        *result = CB_TRANSFER_REFUSED;
        return true;
    }
    if (!strikes(faults, CB_FAULT_WRITE_LOST)) return false;
    pass(faults, true_deadline_us);
    *result = CB_TRANSFER_UNKNOWN;
    return true;
}

/* Faults that lose the reply to a write that arrived. */
static enum cb_transfer write_answered(struct cb_faults *faults, enum cb_transfer result,
                                       int64_t true_deadline_us) {
    if (result != CB_TRANSFER_FAILED && strikes(faults, CB_FAULT_WRITE_TOOK)) {
        pass(faults, true_deadline_us);
        return CB_TRANSFER_UNKNOWN;
    }
    return late(faults, result, true_deadline_us);
}

static enum cb_transfer fault_write(void *context, uint16_t start, uint16_t count,
                                    const uint16_t *registers, int64_t deadline_us) {
    struct cb_faults *faults = context;
    const int64_t true_deadline_us = deadline_us - clock_error(faults);
    enum cb_transfer result;
    if (write_stopped(faults, true_deadline_us, &result)) return result;
    result = faults->inner.write(faults->inner.context, start, count, registers, true_deadline_us);
    return write_answered(faults, result, true_deadline_us);
}

/* in : as hal.h, deadline_us in the box's clock
 * out: the result with the faults applied; read_registers unchanged unless OK */
static enum cb_transfer fault_write_read(void *context, uint16_t write_start, uint16_t write_count,
                                         const uint16_t *write_registers, uint16_t read_start,
                                         uint16_t read_count, uint16_t *read_registers,
                                         int64_t deadline_us) {
    struct cb_faults *faults = context;
    uint16_t reading[CB_FAULT_REGISTERS];
    const int64_t true_deadline_us = deadline_us - clock_error(faults);
    enum cb_transfer result;
    if (read_count > CB_FAULT_REGISTERS) return CB_TRANSFER_FAILED;
    if (write_stopped(faults, true_deadline_us, &result)) return result;
    if (strikes(faults, CB_FAULT_REFUSE_READ)) return CB_TRANSFER_REFUSED;
    result =
        faults->inner.write_read(faults->inner.context, write_start, write_count, write_registers,
                                 read_start, read_count, reading, true_deadline_us);
    result = write_answered(faults, result, true_deadline_us);
    if (result != CB_TRANSFER_OK) return result;
    spoil(faults, read_start, read_count, reading);
    memcpy(read_registers, reading, read_count * sizeof *reading);
    return CB_TRANSFER_OK;
}

static size_t fault_samples(void *context, struct cb_sample *samples, size_t max) {
    struct cb_faults *faults = context;
    const size_t count = faults->inner.samples(faults->inner.context, samples, max);
    for (size_t i = 0; i < count; ++i) samples[i].time_us += clock_error(faults);
    return count;
}

static void fault_feed_watchdog(void *context) {
    const struct cb_faults *faults = context;
    faults->inner.feed_watchdog(faults->inner.context);
}

static bool fault_stop_requested(void *context) {
    const struct cb_faults *faults = context;
    return faults->inner.stop_requested(faults->inner.context);
}

struct cb_hal cb_faults_hal(struct cb_faults *faults) {
    const struct cb_hal hal = {.context = faults,
                               .now_us = fault_now_us,
                               .wait_tick = fault_wait_tick,
                               .read = fault_read,
                               .write = fault_write,
                               .write_read = fault_write_read,
                               .samples = fault_samples,
                               .feed_watchdog = fault_feed_watchdog,
                               .stop_requested = fault_stop_requested};
    return hal;
}
