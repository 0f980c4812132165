/* SPDX-License-Identifier: MIT
 * What the processor does when it cannot go on: registers are recorded (retained.h) and it starts
 * anew. */
#ifndef COMPBOX_HAL_STM32F405_FAULT_H
#define COMPBOX_HAL_STM32F405_FAULT_H

/* Hard fault, memory, bus, usage fault, and every interrupt that nobody asked for. */
void cb_fault_handler(void);

/* The clock security system: the crystal stopped. */
void cb_nmi_handler(void);

#endif
