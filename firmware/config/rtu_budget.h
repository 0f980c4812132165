/* SPDX-License-Identifier: MIT
 * Time of the exchange with the PLC on a serial line, which must fit the period, and the settings
 * of its dialog. */
#ifndef COMPBOX_FIRMWARE_CONFIG_RTU_BUDGET_H
#define COMPBOX_FIRMWARE_CONFIG_RTU_BUDGET_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/config/plc.h"
#include "firmware/wire/rtu_dialog.h"

/* The usual baud rates, those with a name in Linux, ascending, ended by 0. */
extern const uint32_t cb_usual_bauds[];
bool cb_is_usual_baud(uint32_t baud);

/* Time for all transfers of one cycle: 4/5 of the period; the rest is for the step and for delays.
 * in: period_us <= 1 000 000 */
static inline uint32_t cb_exchange_budget_us(uint32_t period_us) {
    return period_us * 4 / 5;
}

/* in : *plc, of which exchange, counts of both blocks and slave delay are used; a line
 * out: time of one cycle's transfers: fc3 and fc16, or fc23 */
uint32_t cb_rtu_cycle_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line);

/* Time to read both blocks by fc3, in a cycle after a loss. A line without time for it could never
 * write again. Longer than fc23, shorter than fc3 and fc16. */
uint32_t cb_rtu_resync_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line);

/* The longer of cb_rtu_cycle_us and cb_rtu_resync_us. */
uint32_t cb_rtu_longest_us(const struct cb_plc_config *plc, const struct cb_rtu_line *line);

/* Register count of the second probe, beside the first one's 1: 2 or 3, which no block has.
 * out: 0: none, because the longer block is too short */
uint16_t cb_rtu_second_probe(const struct cb_plc_config *plc);

/* in : blocks for which there is a second probe */
struct cb_rtu_manners cb_rtu_manners_of(const struct cb_plc_config *plc);

#endif
