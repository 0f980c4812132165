/* SPDX-License-Identifier: MIT
 * The coefficient file from flash: of the two slots the newest revision that is whole and that the
 * loader takes. */
#ifndef COMPBOX_HAL_STM32F405_LOAD_H
#define COMPBOX_HAL_STM32F405_LOAD_H

#include "firmware/load/load.h"
#include "firmware/load/slot.h"
#include "hal/stm32f405/app/console.h"

/* out: 'A' or 'B', *config complete, its limits at most the ceiling of this image's build, and *crc
 * that of the text; 0 when neither slot has a file that this box can run. The console prints what
 * is wrong with a slot. */
char cb_load_slots(struct cb_config *config, struct cb_load_scratch *scratch,
                   struct cb_console *console, uint32_t *crc);

/* Where the PLC's status register is, from the header of the first slot that says so, whatever its
 * text. out: false: neither does */
bool cb_load_report_place(struct cb_slot_report *report);

/* Says what lies in the slots, and the site's ceiling. */
void cb_load_report(struct cb_console *console);

#endif
