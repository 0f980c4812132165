/* SPDX-License-Identifier: MIT */
#include "hal/linux/box_hal.h"

#include "firmware/config/plc.h"
#include "hal/linux/clock.h"
#include "hal/linux/mailbox.h"

static int64_t now_us(void *context) {
    (void)context;
    return cb_boottime_us();
}

static uint32_t wait_tick(void *context) {
    struct cb_linux *target = context;
    return cb_tick_wait(&target->tick);
}

static enum cb_transfer exchange(struct cb_linux *target, const struct cb_modbus_request *request,
                                 uint16_t *registers, int64_t deadline_us) {
    if (target->transport == CB_TRANSPORT_RTU)
        return cb_rtu_exchange(&target->rtu, request, registers, deadline_us);
    return cb_tcp_exchange(&target->tcp, request, registers, deadline_us);
}

static enum cb_transfer read(void *context, uint16_t start, uint16_t count, uint16_t *registers,
                             int64_t deadline_us) {
    const struct cb_modbus_request request = cb_modbus_read(start, count);
    return exchange(context, &request, registers, deadline_us);
}

static enum cb_transfer write(void *context, uint16_t start, uint16_t count,
                              const uint16_t *registers, int64_t deadline_us) {
    const struct cb_modbus_request request = cb_modbus_write(start, count, registers);
    return exchange(context, &request, NULL, deadline_us);
}

static enum cb_transfer write_read(void *context, uint16_t write_start, uint16_t write_count,
                                   const uint16_t *write_registers, uint16_t read_start,
                                   uint16_t read_count, uint16_t *read_registers,
                                   int64_t deadline_us) {
    const struct cb_modbus_request request =
        cb_modbus_write_read(write_start, write_count, write_registers, read_start, read_count);
    return exchange(context, &request, read_registers, deadline_us);
}

static void leave(void *context) {
    struct cb_linux *target = context;
    if (target->transport == CB_TRANSPORT_TCP) cb_tcp_leave(&target->tcp);
}

static size_t samples(void *context, struct cb_sample *list, size_t max) {
    struct cb_linux *target = context;
    size_t count = cb_can_source_samples(&target->can, list, max, cb_boottime_us());
    count += cb_sample_ring_take(&target->bus, target->generation, list + count, max - count);
    return count +
           cb_sample_ring_take(&target->hand, target->generation, list + count, max - count);
}

static void feed_watchdog(void *context) {
    struct cb_linux *target = context;
    __atomic_store_n(&target->steps, target->steps + 1, __ATOMIC_RELAXED);
}

static bool stop_requested(void *context) {
    struct cb_linux *target = context;
    return cb_flag_is_raised(&target->stop);
}

#if CB_HAS_LIBMODBUS
static enum cb_transfer read_beside(void *context, uint16_t start, uint16_t count,
                                    uint16_t *registers, int64_t deadline_us) {
    struct cb_linux *target = context;
    (void)deadline_us;
    return cb_libmodbus_read(&target->libmodbus, start, count, registers);
}

static enum cb_transfer write_beside(void *context, uint16_t start, uint16_t count,
                                     const uint16_t *registers, int64_t deadline_us) {
    struct cb_linux *target = context;
    (void)deadline_us;
    return cb_libmodbus_write(&target->libmodbus, start, count, registers);
}

static struct cb_handed handed(void *context) {
    struct cb_linux *target = context;
    return cb_libmodbus_handed(&target->libmodbus);
}

static void leave_beside(void *context) {
    struct cb_linux *target = context;
    cb_libmodbus_leave(&target->libmodbus);
}

/* out: time of the loop's next tick, by the clock of ages */
static int64_t next_tick_us(const struct cb_tick *tick) {
    const int64_t tick_ns = tick->start_ns + (tick->index + 1) * tick->period_ns;
    return cb_boottime_us() + (tick_ns - cb_clock_ns(tick->clock)) / 1000;
}

static void end_cycle(void *context) {
    struct cb_linux *target = context;
    cb_libmodbus_post(&target->libmodbus, next_tick_us(&target->tick));
    feed_watchdog(context);
}

/* Exchanges the operations of the wire. */
static void put_beside(struct cb_hal *hal) {
    hal->read = read_beside;
    hal->write = write_beside;
    hal->write_read = NULL;
    hal->leave = leave_beside;
    hal->handed = handed;
    hal->feed_watchdog = end_cycle;
}
#endif

struct cb_hal cb_linux_hal(struct cb_linux *target) {
    struct cb_hal hal = {.context = target,
                         .now_us = now_us,
                         .wait_tick = wait_tick,
                         .read = read,
                         .write = write,
                         .write_read = write_read,
                         .leave = leave,
                         .samples = samples,
                         .feed_watchdog = feed_watchdog,
                         .stop_requested = stop_requested};
#if CB_HAS_LIBMODBUS
    if (target->beside) put_beside(&hal);
#endif
    return hal;
}

void cb_linux_close(struct cb_linux *target) {
    if (target->transport == CB_TRANSPORT_RTU)
        cb_serial_close(&target->rtu.serial);
    else
        cb_link_close(&target->tcp.link);
}

void cb_linux_stop(struct cb_linux *target) {
    if (target->transport == CB_TRANSPORT_RTU) (void)cb_serial_opener_stop(&target->opener);
#if CB_HAS_LIBMODBUS
    if (target->beside) (void)cb_libmodbus_stop(&target->libmodbus);
#endif
}
