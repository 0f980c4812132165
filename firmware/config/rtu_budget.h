/* SPDX-License-Identifier: MIT
 * Whether a serial line can carry the exchange with the PLC in every period, and how it is asked.
 */
#ifndef COMPBOX_FIRMWARE_CONFIG_RTU_BUDGET_H
#define COMPBOX_FIRMWARE_CONFIG_RTU_BUDGET_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/config/config.h"
#include "firmware/wire/rtu_dialog.h"

/* The usual baud rates, ascending, ended by 0. Those that Linux knows by name. */
extern const uint32_t cb_usual_bauds[];
bool cb_is_usual_baud(uint32_t baud);

/* How long all transfers of one cycle may take: 4/5 of the period, the rest is for the step and for
 * being late. in: period_us <= 1 000 000 */
static inline uint32_t cb_exchange_budget_us(uint32_t period_us) {
    return period_us * 4 / 5;
}

/* in : *plc: exchange, counts of both blocks and slave delay are looked at; a line
 * out: what one cycle's transfers take on it: fc3 and fc16, or fc23 */
uint32_t cb_rtu_cycle_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line);

/* The reading of both blocks by fc3, in a cycle after a loss: a box whose line has no time for it
 * would never write again. Longer than fc23, shorter than fc3 and fc16. */
uint32_t cb_rtu_resync_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line);

/* The longer of the two. */
uint32_t cb_rtu_longest_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line);

/* Registers of the second probe, beside that of 1: 2 or 3, which no block has.
 * out: 0: the longer block is so short that there is no such number */
uint16_t cb_rtu_second_probe(const struct cb_plc_config *plc);

/* in : blocks for which there is a second probe */
struct cb_rtu_manners cb_rtu_manners_of(const struct cb_plc_config *plc);

#endif
