/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/guard.h"

#include "hal/stm32f405/mcu.h"

extern char guard_start[], stack_start[], stack_top[];

enum {
    PAINT = 0x5AFE57AC,
    CANARY_WORDS = 4,
    GUARD_256_BYTES = 7 << 1, /* 2^(7+1) */
    REGION_ENABLE = 1,
    NO_EXECUTE = 1 << 28, /* and access permission 0: no access */
    MPU_ENABLE_WITH_DEFAULT_MAP = 1 | 1 << 2,
};

static uint32_t *lowest(void) {
    return (uint32_t *)(void *)stack_start;
}

__attribute__((noinline)) void cb_guard_paint(void) {
    uintptr_t end;
    __asm__ volatile("mov %0, sp" : "=r"(end));
    for (volatile uint32_t *at = lowest(); (uintptr_t)at < end; ++at) *at = PAINT;
}

void cb_guard_start(void) {
    cb_write(&CB_MPU->rnr, 0);
    cb_write(&CB_MPU->rbar, (uint32_t)(uintptr_t)guard_start);
    cb_write(&CB_MPU->rasr, NO_EXECUTE | GUARD_256_BYTES | REGION_ENABLE);
    cb_write(&CB_MPU->ctrl, MPU_ENABLE_WITH_DEFAULT_MAP);
    cb_set_bits(&CB_SCB->shcsr, CB_SCB_SHCSR_FAULTS);
    cb_set_bits(&CB_SCB->ccr, CB_SCB_CCR_DIV_0);
    cb_barrier();
}

bool cb_guard_intact(void) {
    for (unsigned i = 0; i < CANARY_WORDS; ++i)
        if (lowest()[i] != PAINT) return false;
    return true;
}

uint32_t cb_guard_stack_bytes(void) {
    return (uint32_t)(stack_top - stack_start);
}

uint32_t cb_guard_stack_used(void) {
    const uint32_t *at = lowest();
    while (at < (const uint32_t *)(const void *)stack_top && *at == PAINT) ++at;
    return (uint32_t)(stack_top - (const char *)at);
}
