/* SPDX-License-Identifier: MIT
 * Vector table and start-up. */
#include <stdint.h>
#include <string.h>

#include "hal/stm32f405/fault.h"
#include "hal/stm32f405/guard.h"
#include "hal/stm32f405/main.h"
#include "hal/stm32f405/mcu.h"
#include "hal/stm32f405/time.h"
#include "hal/stm32f405/usart.h"

extern char flash_start[], data_start[], data_end[], data_load[], bss_start[], bss_end[],
    stack_top[];
void cb_start(void);
void cb_start_c(void);

#define FPU_FULL_ACCESS (0xFu << 20)
enum { FPSCR_DEFAULT_NAN = 1 << 25, FPSCR_FLUSH_TO_ZERO = 1 << 24 };

/* Clears both modes, so that subnormals are numbers and a NaN keeps its bits, as on every other
 * target. */
static void enable_fpu(void) {
    uint32_t fpscr;
    cb_set_bits(CB_CPACR, FPU_FULL_ACCESS);
    cb_barrier();
    __asm__ volatile("vmrs %0, fpscr" : "=r"(fpscr));
    fpscr &= ~(uint32_t)(FPSCR_DEFAULT_NAN | FPSCR_FLUSH_TO_ZERO);
    __asm__ volatile("vmsr fpscr, %0" : : "r"(fpscr));
}

void cb_start_c(void) {
    cb_guard_paint();
    /* a boot loader may have set another one */
    cb_write(&CB_SCB->vtor, (uint32_t)(uintptr_t)flash_start);
    memcpy(data_start, data_load, (size_t)(data_end - data_start));
    memset(bss_start, 0, (size_t)(bss_end - bss_start));
    enable_fpu();
    cb_guard_start();
    cb_main();
}

struct vectors {
    void *stack;
    void (*core[15])(void);
    void (*device[CB_IRQ_COUNT])(void);
};
__attribute__((section(".vectors"), used)) static const struct vectors vectors = {
    stack_top,
    {cb_start, cb_nmi_handler, cb_fault_handler, cb_fault_handler, cb_fault_handler,
     cb_fault_handler, cb_fault_handler, cb_fault_handler, cb_fault_handler, cb_fault_handler,
     cb_fault_handler, cb_fault_handler, cb_fault_handler, cb_fault_handler, cb_systick_handler},
    {[0 ... CB_IRQ_USART1 - 1] = cb_fault_handler,
     [CB_IRQ_USART1] = cb_usart1_handler,
     [CB_IRQ_USART2] = cb_usart2_handler,
     [CB_IRQ_USART3] = cb_usart3_handler,
     [CB_IRQ_USART3 + 1 ... CB_IRQ_COUNT - 1] = cb_fault_handler}};

/* Start of the processor, with the stack set from the table. */
void cb_start(void) {
    cb_start_c();
}
