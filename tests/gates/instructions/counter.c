/* SPDX-License-Identifier: MIT */
#include "tests/gates/instructions/counter.h"

#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)
enum { ENABLE = 1, PROCESSOR_CLOCK = 4, TOP = 0xFFFFFF };

static uint32_t ticks_of_1000 = 1;

/* Ticks that one call takes; the counter runs downward, 24 bits wide. */
__attribute__((noipa)) static uint32_t ticks_of(void (*work)(void *argument), void *argument) {
    __asm__ volatile("" ::: "memory");
    const uint32_t before = SYST_CVR;
    work(argument);
    const uint32_t after = SYST_CVR;
    __asm__ volatile("" ::: "memory");
    return (before - after) & TOP;
}

__attribute__((noipa)) static void nothing(void *argument) {
    (void)argument;
}

#define BLOCK(name, count)                                                 \
    __attribute__((noipa)) static void name(void *argument) {              \
        (void)argument;                                                    \
        __asm__ volatile(".rept " #count "\n\tnop\n\t.endr" ::: "memory"); \
    }
BLOCK(block_of_1000, 1000)
BLOCK(block_of_2000, 2000)
BLOCK(block_of_3500, 3500)

uint32_t counter_of(void (*work)(void *argument), void *argument) {
    const uint32_t empty = ticks_of(nothing, 0);
    const uint32_t ticks = ticks_of(work, argument) - empty;
    const uint32_t call_and_return =
        2; /* the branch to it and its return, which `nothing` has too */
    return (uint32_t)(((uint64_t)ticks * 1000u + ticks_of_1000 / 2u) / ticks_of_1000) +
           call_and_return;
}

bool counter_start(void) {
    SYST_RVR = TOP;
    SYST_CVR = 0;
    SYST_CSR = ENABLE | PROCESSOR_CLOCK;
    ticks_of_1000 = ticks_of(block_of_1000, 0) - ticks_of(nothing, 0);
    if (ticks_of_1000 < 4000u || ticks_of_1000 > 1000000u) return false;
    return counter_of(block_of_1000, 0) == 1002u && counter_of(block_of_2000, 0) == 2002u &&
           counter_of(block_of_3500, 0) == 3502u;
}
