/* SPDX-License-Identifier: MIT */
#include "hal/linux/bus.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "firmware/config/config.h"
#include "hal/linux/clock.h"
#include "hal/linux/realtime.h"

enum {
    PAUSE_US = 5000,  /* poll interval for due modules */
    MARGIN_US = 20000 /* beyond wire and module, because this thread has no priority */
};

static void pause_a_little(void) {
    const struct timespec wait = cb_timespec(PAUSE_US * 1000LL);
    nanosleep(&wait, NULL);
}

/* Publishes the state of device, counters and modules; behind a full ring it waits for the next
 * pause. */
static void report(struct cb_bus *bus) {
    const int32_t slot = cb_ring_slot_to_write(&bus->ring);
    bus->untold = slot < 0;
    if (bus->untold) return;
    struct cb_bus_report *out = &bus->reports[slot];
    const struct cb_serial *serial = &bus->rtu.serial;
    *out = (struct cb_bus_report){.open = serial->fd >= 0,
                                  .error_number = serial->error_number,
                                  .connects = serial->connects,
                                  .failures = serial->failures,
                                  .disconnects = serial->disconnects,
                                  .counters = bus->rtu.counters,
                                  .turns = bus->turns.count};
    for (unsigned i = 0; i < bus->turns.count; ++i) {
        out->units[i] = bus->turns.turns[i].unit;
        out->silent[i] = bus->turns.turns[i].silent > 0;
    }
    cb_ring_publish(&bus->ring);
}

static void hand_over(struct cb_bus *bus, const uint16_t *registers) {
    struct cb_sample samples[CB_MAX_SIGNALS];
    const size_t count =
        cb_bus_turns_take(&bus->turns, bus->config, registers, samples, CB_MAX_SIGNALS);
    for (size_t i = 0; i < count; ++i) cb_sample_ring_put(bus->to, samples[i], bus->generation);
}

/* Sends the request of the due module. out: false: no module is due */
static bool take_turn(struct cb_bus *bus) {
    uint16_t registers[CB_MAX_READ_REGISTERS];
    struct cb_modbus_request request;
    uint8_t unit;
    const int64_t now_us = cb_boottime_us();
    const struct cb_serial_config *line = &bus->config->buses[bus->turns.bus].serial;
    if (!cb_bus_turns_next(&bus->turns, now_us, &unit, &request)) return false;
    const int64_t deadline_us =
        now_us + cb_rtu_exchange_us(&line->line, &request, line->slave_delay_us) + MARGIN_US;
    switch (cb_rtu_read_module(&bus->rtu, unit, &request, registers, deadline_us)) {
        case CB_TRANSFER_OK:
            hand_over(bus, registers);
            break;
        case CB_TRANSFER_REFUSED:
            cb_bus_turns_refused(&bus->turns);
            break;
        case CB_TRANSFER_NONE:
        case CB_TRANSFER_FAILED:
        case CB_TRANSFER_UNKNOWN:
            if (bus->rtu.serial.fd < 0) cb_bus_turns_unasked(&bus->turns);
            break;
    }
    report(bus);
    return true;
}

/* All modules are polled once the device is back. */
static void *run(void *argument) {
    struct cb_bus *bus = argument;
    uint32_t connects = 0;
    cb_settle_thread("compboxd-bus");
    while (!cb_flag_is_raised(&bus->quit)) {
        const int64_t now_us = cb_boottime_us();
        const bool open = cb_serial_ready(&bus->rtu.serial, now_us);
        const bool back = bus->rtu.serial.connects != connects;
        connects = bus->rtu.serial.connects;
        if (back) cb_bus_turns_line_is_back(&bus->turns, now_us);
        if (back || !open || bus->untold) report(bus);
        if (!open || !take_turn(bus)) pause_a_little();
    }
    cb_serial_close(&bus->rtu.serial);
    return NULL;
}

/* out: 0 or errno */
static int start_opener(struct cb_bus *bus) {
    bus->opener = calloc(1, sizeof *bus->opener);
    if (bus->opener == NULL) return ENOMEM;
    const int error = cb_serial_opener_start(bus->opener, &bus->config->buses[0].serial);
    if (error == 0) return 0;
    free(bus->opener);
    bus->opener = NULL;
    return error;
}

/* An opener whose driver hangs keeps its memory. */
static void stop_opener(struct cb_bus *bus) {
    if (cb_serial_opener_stop(bus->opener)) free(bus->opener);
    bus->opener = NULL;
}

int cb_bus_start(struct cb_bus *bus, const struct cb_config *config, uint32_t generation,
                 struct cb_sample_ring *to) {
    memset(bus, 0, sizeof *bus);
    if (config->buses_count == 0) return 0;
    bus->config = config;
    bus->generation = generation;
    bus->to = to;
    const int opener_error = start_opener(bus);
    if (opener_error != 0) return opener_error;
    cb_ring_start(&bus->ring, CB_BUS_REPORTS);
    cb_rtu_start_bus(&bus->rtu, &config->buses[0].serial, bus->opener);
    cb_bus_turns_start(&bus->turns, config, 0, cb_boottime_us());
    const int error = cb_start_thread(&bus->thread, &cb_no_hurry, run, bus);
    bus->runs = error == 0;
    if (error != 0) stop_opener(bus);
    return error;
}

void cb_bus_stop(struct cb_bus *bus) {
    if (!bus->runs) return;
    cb_flag_raise(&bus->quit);
    pthread_join(bus->thread, NULL);
    stop_opener(bus);
    bus->runs = false;
    cb_bus_look(bus);
    if (bus->untold) report(bus);
    cb_bus_look(bus);
}

bool cb_bus_look(struct cb_bus *bus) {
    bool any = false;
    for (int32_t slot; (slot = cb_ring_slot_to_read(&bus->ring)) >= 0; any = true) {
        bus->last = bus->reports[slot];
        cb_ring_release(&bus->ring);
    }
    return any;
}
