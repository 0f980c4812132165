/* SPDX-License-Identifier: MIT */
#include "tests/support/sim.h"

#include <string.h>

void cb_sim_start(struct cb_sim *sim, const struct cb_sim_host *host, uint32_t period_us,
                  int64_t start_us) {
    memset(sim, 0, sizeof *sim);
    sim->host = *host;
    sim->period_us = period_us;
    sim->now_us = sim->tick_us = start_us;
}

void cb_sim_pass(void *context, int64_t until_us) {
    struct cb_sim *sim = context;
    if (until_us > sim->now_us) sim->now_us = until_us;
    if (sim->host.update) sim->host.update(sim->host.context, sim, sim->now_us);
}

void cb_sim_sample(struct cb_sim *sim, uint8_t signal, float raw, int64_t time_us) {
    if (sim->sample_count == CB_SIM_SAMPLES) {
        memmove(sim->samples, sim->samples + 1, (CB_SIM_SAMPLES - 1) * sizeof *sim->samples);
        --sim->sample_count;
    }
    sim->samples[sim->sample_count++] = (struct cb_sample){signal, raw, time_us};
}

static int64_t sim_now_us(void *context) {
    return ((struct cb_sim *)context)->now_us;
}

/* The first tick after now; ticks between it and the last one are missed. */
static uint32_t sim_wait_tick(void *context) {
    struct cb_sim *sim = context;
    const int64_t late_us = sim->now_us - sim->tick_us;
    const int64_t missed = late_us / sim->period_us;
    sim->tick_us += (missed + 1) * sim->period_us;
    cb_sim_pass(sim, sim->tick_us);
    return (uint32_t)missed;
}

static bool in_space(uint16_t start, uint16_t count) {
    return count > 0 && (uint32_t)start + count <= CB_SIM_REGISTERS;
}

/* Time of one request. out: OK, or FAILED when its reply would be late: it is not sent. */
static enum cb_transfer begin(struct cb_sim *sim, int64_t deadline_us) {
    if (sim->absent || sim->now_us + sim->exchange_us > deadline_us) return CB_TRANSFER_FAILED;
    cb_sim_pass(sim, sim->now_us + sim->exchange_us);
    return CB_TRANSFER_OK;
}

static void get(struct cb_sim *sim, uint16_t start, uint16_t count, uint16_t *registers) {
    ++sim->reads;
    memcpy(registers, sim->registers + start, count * sizeof *registers);
}

static void put(struct cb_sim *sim, uint16_t start, uint16_t count, const uint16_t *registers) {
    ++sim->writes;
    memcpy(sim->registers + start, registers, count * sizeof *registers);
    if (sim->host.written) sim->host.written(sim->host.context, sim, start, count, sim->now_us);
}

static enum cb_transfer sim_read(void *context, uint16_t start, uint16_t count, uint16_t *registers,
                                 int64_t deadline_us) {
    struct cb_sim *sim = context;
    const enum cb_transfer begun = begin(sim, deadline_us);
    if (begun != CB_TRANSFER_OK) return begun;
    if (!in_space(start, count)) return CB_TRANSFER_REFUSED;
    get(sim, start, count, registers);
    return CB_TRANSFER_OK;
}

static enum cb_transfer sim_write(void *context, uint16_t start, uint16_t count,
                                  const uint16_t *registers, int64_t deadline_us) {
    struct cb_sim *sim = context;
    const enum cb_transfer begun = begin(sim, deadline_us);
    if (begun != CB_TRANSFER_OK) return begun;
    if (!in_space(start, count)) return CB_TRANSFER_REFUSED;
    put(sim, start, count, registers);
    return CB_TRANSFER_OK;
}

static enum cb_transfer sim_write_read(void *context, uint16_t write_start, uint16_t write_count,
                                       const uint16_t *write_registers, uint16_t read_start,
                                       uint16_t read_count, uint16_t *read_registers,
                                       int64_t deadline_us) {
    struct cb_sim *sim = context;
    const enum cb_transfer begun = begin(sim, deadline_us);
    if (begun != CB_TRANSFER_OK) return begun;
    if (!in_space(write_start, write_count) || !in_space(read_start, read_count))
        return CB_TRANSFER_REFUSED;
    put(sim, write_start, write_count, write_registers);
    get(sim, read_start, read_count, read_registers);
    return CB_TRANSFER_OK;
}

static size_t sim_samples(void *context, struct cb_sample *samples, size_t max) {
    struct cb_sim *sim = context;
    const size_t count = sim->sample_count < max ? sim->sample_count : max;
    memcpy(samples, sim->samples, count * sizeof *samples);
    memmove(sim->samples, sim->samples + count, (sim->sample_count - count) * sizeof *samples);
    sim->sample_count -= count;
    return count;
}

static void sim_feed_watchdog(void *context) {
    ++((struct cb_sim *)context)->watchdog_fed;
}

static bool sim_stop_requested(void *context) {
    return ((struct cb_sim *)context)->stop;
}

struct cb_hal cb_sim_hal(struct cb_sim *sim) {
    const struct cb_hal hal = {.context = sim,
                               .now_us = sim_now_us,
                               .wait_tick = sim_wait_tick,
                               .read = sim_read,
                               .write = sim_write,
                               .write_read = sim_write_read,
                               .samples = sim_samples,
                               .feed_watchdog = sim_feed_watchdog,
                               .stop_requested = sim_stop_requested};
    return hal;
}
