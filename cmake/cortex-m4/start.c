/* SPDX-License-Identifier: MIT
 * Start-up of test programs on the Cortex-M4F; a fault ends the program instead of hanging it. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/base/assert.h"

extern char data_start[], data_end[], data_load[], bss_start[], bss_end[], stack_top[];
extern void initialise_monitor_handles(void);
extern int main(void);
void reset(void);
void fault(void);

#define CPACR (*(volatile uint32_t *)0xE000ED88u)
#define FPU_FULL_ACCESS (0xFu << 20)
enum { FPSCR_DEFAULT_NAN = 1 << 25, FPSCR_FLUSH_TO_ZERO = 1 << 24 };

/* Semihosting SYS_EXIT (0x18) with "run-time error": the emulator ends with code 1. */
void fault(void) {
    register uint32_t operation __asm__("r0") = 0x18;
    register uint32_t reason __asm__("r1") = 0x20023;
    __asm__ volatile("bkpt 0xAB" : : "r"(operation), "r"(reason) : "memory");
    for (;;) {
    }
}

void cb_assertion_failed(const char *file, int line) {
    (void)file;
    (void)line;
    for (;;) fault();
}

/* Subnormals are numbers and a NaN keeps its bits, as on every other target: both modes off. */
static void enable_fpu(void) {
    uint32_t fpscr;
    CPACR |= FPU_FULL_ACCESS;
    __asm__ volatile("dsb\n\tisb" : : : "memory");
    __asm__ volatile("vmrs %0, fpscr" : "=r"(fpscr));
    fpscr &= ~(uint32_t)(FPSCR_DEFAULT_NAN | FPSCR_FLUSH_TO_ZERO);
    __asm__ volatile("vmsr fpscr, %0" : : "r"(fpscr));
}

void reset(void) {
    memcpy(data_start, data_load, (size_t)(data_end - data_start));
    memset(bss_start, 0, (size_t)(bss_end - bss_start));
    enable_fpu();
    initialise_monitor_handles();
    exit(main());
}

struct vectors {
    void *stack;
    void (*handlers[15])(void);
};
__attribute__((section(".vectors"), used)) static const struct vectors vectors = {
    stack_top,
    {reset, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault,
     fault, fault}};
