/* SPDX-License-Identifier: MIT
 * The stack's guards: a region below it that the MPU forbids, and a paint on it whose lowest words
 * are the canary. */
#ifndef COMPBOX_HAL_STM32F405_GUARD_H
#define COMPBOX_HAL_STM32F405_GUARD_H

#include <stdbool.h>
#include <stdint.h>

/* Before anything else: paints the stack below its caller. */
void cb_guard_paint(void);

/* Forbids the region below the stack; faults have handlers of their own from here on. */
void cb_guard_start(void);

/* True while the canary, the lowest words of the stack, is whole. */
bool cb_guard_intact(void);

/* Bytes of the stack: all of it, and the most that were ever used. */
uint32_t cb_guard_stack_bytes(void);
uint32_t cb_guard_stack_used(void);

#endif
