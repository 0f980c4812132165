/* SPDX-License-Identifier: MIT */
#include "tests/gates/cycle/exchange.h"

#include <stdio.h>
#include <string.h>

#include "firmware/box/box.h"
#include "firmware/wire/rtu_receiver.h"
#include "tests/gates/instructions/counter.h"

enum { UNIT = 1, BYTE_US = 96 };

struct exchange_most exchange_most;

void __real_cb_box_step(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                        struct cb_outputs *out);
void __wrap_cb_box_step(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                        struct cb_outputs *out);

/* One cycle under the counter. */
static struct {
    struct cb_box *box;
    const struct cb_inputs *in;
    struct cb_outputs *out;
    int64_t now_us;
    struct cb_modbus_request read;
    struct cb_rtu_receiver receiver;
    uint8_t reply[CB_RTU_MAX_FRAME], request[CB_RTU_MAX_FRAME];
    uint16_t registers[CB_MAX_READ_REGISTERS];
} cycle;

/* The frame by which a PLC would have told these registers. */
static size_t make_reply(const uint16_t *registers, uint16_t count) {
    uint8_t *at = cycle.reply;
    *at++ = UNIT;
    *at++ = CB_MODBUS_READ;
    *at++ = (uint8_t)(2 * count);
    for (unsigned i = 0; i < count; ++i) {
        *at++ = (uint8_t)(registers[i] >> 8);
        *at++ = (uint8_t)registers[i];
    }
    const uint16_t crc = cb_rtu_crc(cycle.reply, (size_t)(at - cycle.reply));
    *at++ = (uint8_t)crc;
    *at++ = (uint8_t)(crc >> 8);
    return (size_t)(at - cycle.reply);
}

static void receive(void *unused) {
    (void)unused;
    const size_t size = cb_rtu_reply_bytes(&cycle.read);
    uint8_t exception = 0;
    const uint8_t *const end = cycle.reply + size;
    int64_t now_us = 0;
    for (const uint8_t *at = cycle.reply; at != end; ++at, now_us += BYTE_US)
        (void)cb_rtu_receiver_byte(&cycle.receiver, *at, now_us);
    (void)cb_rtu_receiver_take(&cycle.receiver, cycle.registers, &exception);
}

static void step(void *unused) {
    (void)unused;
    __real_cb_box_step(cycle.box, cycle.in, cycle.now_us, cycle.out);
}

static void encode(void *unused) {
    (void)unused;
    const struct cb_block_config *block = &cycle.box->config.plc.write;
    const struct cb_modbus_request write =
        cb_modbus_write(block->start, block->count, cycle.out->registers);
    (void)cb_rtu_encode(UNIT, &write, cycle.request);
}

static uint32_t count_receive(void) {
    const struct cb_block_config *block = &cycle.box->config.plc.read;
    if (!cycle.in->read_ok) return 0;
    cycle.read = cb_modbus_read(block->start, block->count);
    (void)make_reply(cycle.in->registers, block->count);
    cb_rtu_receiver_expect(&cycle.receiver, UNIT, &cycle.read, 0);
    const uint32_t used = counter_of(receive, 0);
    if (memcmp(cycle.registers, cycle.in->registers, block->count * sizeof(uint16_t)) != 0)
        exchange_most.wrong = true;
    return used;
}

void __wrap_cb_box_step(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                        struct cb_outputs *out) {
    cycle.box = box;
    cycle.in = in;
    cycle.out = out;
    cycle.now_us = now_us;
    cb_rtu_receiver_start(&cycle.receiver, (struct cb_rtu_silence){750, 1750});
    struct exchange_most now = exchange_most;
    ++now.cycles;
    now.receive = count_receive();
    now.wrong = exchange_most.wrong;
    now.step = counter_of(step, 0);
    now.encode = out->write ? counter_of(encode, 0) : 0;
    now.all = now.receive + now.step + now.encode;
    if (now.all > exchange_most.all)
        exchange_most = now;
    else
        exchange_most.cycles = now.cycles;
}

int exchange_report(const char *inputs, uint32_t limit) {
    const struct exchange_most *most = &exchange_most;
    printf(
        "whole cycle, %s: %6u / %6u instructions (reply %u, step %u, request %u), largest seen of "
        "%u\n",
        inputs, (unsigned)most->all, (unsigned)limit, (unsigned)most->receive, (unsigned)most->step,
        (unsigned)most->encode, (unsigned)most->cycles);
    if (most->wrong) puts("a reply was not decoded to what it was made of");
    return most->cycles > 0 && !most->wrong && most->all <= limit ? 0 : 1;
}
