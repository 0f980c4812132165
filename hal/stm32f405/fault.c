/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/fault.h"

#include <stdint.h>
#include <string.h>

#include "firmware/base/assert.h"
#include "hal/stm32f405/mcu.h"
#include "hal/stm32f405/retained.h"

extern char stack_start[], stack_top[];
void cb_fault_record(const uint32_t *frame, uint32_t exc_return);

/* The stack may be the broken part: the handler switches to one of its own before it accesses
 * memory. */
__attribute__((naked)) void cb_fault_handler(void) {
    __asm__ volatile(
        "mrs r0, msp\n\t"
        "mov r1, lr\n\t"
        "ldr r2, =fault_stack_top\n\t"
        "msr msp, r2\n\t"
        "isb\n\t"
        "b cb_fault_record\n\t"
        ".ltorg");
}

static uint32_t exception_number(void) {
    uint32_t ipsr;
    __asm__ volatile("mrs %0, ipsr" : "=r"(ipsr));
    return ipsr;
}

/* in : the stack pointer and the link register at the exception
 * The frame is read only if it is completely inside the stack. */
__attribute__((used)) void cb_fault_record(const uint32_t *frame, uint32_t exc_return) {
    struct cb_fault_registers *fault = &cb_retained.fault;
    const uintptr_t at = (uintptr_t)frame;
    memset(fault, 0, sizeof *fault);
    fault->sp = (uint32_t)at;
    fault->exc_return = exc_return;
    fault->exception = exception_number();
    fault->cfsr = cb_read(&CB_SCB->cfsr);
    fault->hfsr = cb_read(&CB_SCB->hfsr);
    fault->mmfar = cb_read(&CB_SCB->mmfar);
    fault->bfar = cb_read(&CB_SCB->bfar);
    if (at % 4 == 0 && at >= (uintptr_t)stack_start && at + 32 <= (uintptr_t)stack_top) {
        memcpy(fault->r, frame, sizeof fault->r);
        fault->r12 = frame[4];
        fault->lr = frame[5];
        fault->pc = frame[6];
        fault->psr = frame[7];
    }
    ++cb_retained.faults;
    cb_restart(CB_START_FAULT);
}

/* Records the file and line. A long name keeps its end, which distinguishes files. */
void cb_assertion_failed(const char *file, int line) {
    const size_t length = strlen(file), most = sizeof cb_retained.assertion - 1;
    const size_t from = length > most ? length - most : 0;
    memset(cb_retained.assertion, 0, sizeof cb_retained.assertion);
    memcpy(cb_retained.assertion, file + from, length - from);
    cb_retained.assertion_line = (uint32_t)line;
    cb_restart(CB_START_ASSERTION);
}

/* The crystal failed: the processor now runs from the internal oscillator, at another speed than
 * the ports are set to. It restarts and does not use the crystal. */
void cb_nmi_handler(void) {
    if (!(cb_read(&CB_RCC->cir) & CB_RCC_CIR_CSSF)) return;
    cb_set_bits(&CB_RCC->cir, CB_RCC_CIR_CSSC);
    cb_retained.crystal_failed = 1;
    cb_restart(CB_START_CLOCK);
}
