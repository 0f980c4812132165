/* SPDX-License-Identifier: MIT
 * Handlers of fatal faults: they record the registers (retained.h) and restart the processor. */
#ifndef COMPBOX_HAL_STM32F405_FAULT_H
#define COMPBOX_HAL_STM32F405_FAULT_H

/* Hard fault, memory, bus, usage fault, and every unused interrupt. */
void cb_fault_handler(void);

/* The clock security system: the crystal stopped. */
void cb_nmi_handler(void);

#endif
