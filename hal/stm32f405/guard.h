/* SPDX-License-Identifier: MIT
 * The stack's guards: a region below it that the MPU forbids, and a paint on it whose lowest words
 * are the canary. */
#ifndef COMPBOX_HAL_STM32F405_GUARD_H
#define COMPBOX_HAL_STM32F405_GUARD_H

#include <stdbool.h>
#include <stdint.h>

/* Call it first: paints the stack below its caller. */
void cb_guard_paint(void);

/* Forbids the region below the stack; from here on faults have their own handlers. */
void cb_guard_start(void);

/* out: true while the canary, the lowest words of the stack, is intact */
bool cb_guard_intact(void);

/* Size of the stack in bytes, and its maximum use so far. */
uint32_t cb_guard_stack_bytes(void);
uint32_t cb_guard_stack_used(void);

#endif
