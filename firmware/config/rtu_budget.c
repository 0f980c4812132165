/* SPDX-License-Identifier: MIT */
#include "firmware/config/rtu_budget.h"

const uint32_t cb_usual_bauds[] = {1200,  2400,   4800,   9600,   19200,  38400,
                                   57600, 115200, 230400, 460800, 921600, 0};

bool cb_is_usual_baud(uint32_t baud) {
    for (const uint32_t *usual = cb_usual_bauds; *usual != 0; ++usual)
        if (*usual == baud) return true;
    return false;
}

static uint32_t read_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line,
                        const struct cb_block_config *block) {
    const struct cb_modbus_request request = cb_modbus_read(0, block->count);
    return cb_rtu_exchange_us(line, &request, plc->serial.slave_delay_us);
}

/* The writing alone, by fc16. */
static uint32_t write_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line) {
    const struct cb_modbus_request request = cb_modbus_write(0, plc->write.count, 0);
    return cb_rtu_exchange_us(line, &request, plc->serial.slave_delay_us);
}

static uint32_t write_read_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line) {
    const struct cb_modbus_request request =
        cb_modbus_write_read(0, plc->write.count, 0, 0, plc->read.count);
    return cb_rtu_exchange_us(line, &request, plc->serial.slave_delay_us);
}

uint32_t cb_rtu_cycle_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line) {
    if (plc->exchange == CB_EXCHANGE_FC23) return write_read_us(plc, line);
    return read_us(plc, line, &plc->read) + write_us(plc, line);
}

uint32_t cb_rtu_resync_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line) {
    return read_us(plc, line, &plc->read) + read_us(plc, line, &plc->write);
}

uint32_t cb_rtu_longest_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line) {
    const uint32_t cycle_us = cb_rtu_cycle_us(plc, line), resync_us = cb_rtu_resync_us(plc, line);
    return cycle_us > resync_us ? cycle_us : resync_us;
}

uint16_t cb_rtu_second_probe(const struct cb_plc_config *plc) {
    const uint16_t read = plc->read.count, write = plc->write.count;
    const uint16_t longer = read > write ? read : write, shorter = read > write ? write : read;
    const uint16_t registers = shorter == 2 ? 3 : 2;
    return registers < longer ? registers : 0;
}

struct cb_rtu_manners cb_rtu_manners_of(const struct cb_plc_config *plc) {
    const bool reads_more = plc->read.count > plc->write.count;
    const uint16_t start = reads_more ? plc->read.start : plc->write.start;
    const bool writes_behind = plc->exchange == CB_EXCHANGE_FC3_FC16;
    return (struct cb_rtu_manners){
        .line = plc->serial.line,
        .probes = {cb_modbus_read(start, 1), cb_modbus_read(start, cb_rtu_second_probe(plc))},
        .slave_delay_us = plc->serial.slave_delay_us,
        .reserve_us = writes_behind ? write_us(plc, &plc->serial.line) : 0};
}
