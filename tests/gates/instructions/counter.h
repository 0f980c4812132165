/* SPDX-License-Identifier: MIT
 * Counts the instructions that a Cortex-M executes under qemu-system-arm -icount.
 *
 * With -icount every instruction takes the same virtual time, and SysTick counts that time. How
 * many ticks an instruction takes is not assumed but measured, on blocks of known length. */
#ifndef COMPBOX_TESTS_GATES_COUNTER_H
#define COMPBOX_TESTS_GATES_COUNTER_H

#include <stdbool.h>
#include <stdint.h>

/* out: true when blocks of 1 000, 2 000 and 3 500 instructions count as such, to the instruction;
 *      false without -icount, or with another SysTick. Call it first. */
bool counter_start(void);

/* out: instructions of one call of work(argument), call and return included */
uint32_t counter_of(void (*work)(void *argument), void *argument);

#endif
