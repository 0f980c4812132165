/* SPDX-License-Identifier: MIT
 * The coefficient file from flash: of the two slots the newest revision that is whole and that the
 * loader accepts. */
#ifndef COMPBOX_HAL_STM32F405_LOAD_H
#define COMPBOX_HAL_STM32F405_LOAD_H

#include "firmware/load/load.h"
#include "firmware/load/slot.h"
#include "hal/stm32f405/app/console.h"

/* Reads both slots; call it once, before the others. */
void cb_load_read(void);

/* out: 'A' or 'B', *config complete, its limits at most the ceiling of this image's build, and *crc
 *      of the text; 0 when neither slot has a usable file. The console prints the fault of each
 *      slot. */
char cb_load_slots(struct cb_config *config, struct cb_load_scratch *scratch,
                   struct cb_console *console, uint32_t *crc);

/* Place of the PLC's status register, from the header of the newest whole slot, or of the other one
 * where that has none, whatever its text. out: false: neither has it */
bool cb_load_report_place(struct cb_slot_report *report);

/* Prints what cb_load_read() found, and the site's ceiling. */
void cb_load_report(struct cb_console *console);

#endif
