/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/time.h"

#include <stdbool.h>

#include "hal/stm32f405/mcu.h"
#include "hal/stm32f405/usart.h"

enum { US_PER_TICK = 1000, ENABLE_INTERRUPT_CORE = 7 };

static volatile int64_t ticks_us; /* written by the interrupt alone */
static uint32_t per_us, reload;
static cb_cell interrupts; /* all have one priority, so none interrupts another */

void cb_time_start(uint32_t core_hz) {
    per_us = core_hz / 1000000;
    reload = per_us * US_PER_TICK - 1;
    ticks_us = 0;
    cb_write(&CB_SYSTICK->rvr, reload);
    cb_write(&CB_SYSTICK->cvr, 0);
    cb_write(&CB_SYSTICK->csr, ENABLE_INTERRUPT_CORE);
}

/* Reads once: whole milliseconds, and the counter's part. The counter may have restarted while its
 * interrupt is pending. */
static int64_t look(void) {
    const int64_t whole_us = ticks_us;
    const uint32_t first = cb_read(&CB_SYSTICK->cvr);
    const bool pending = (cb_read(&CB_SCB->icsr) & CB_SCB_ICSR_PENDSTSET) != 0;
    const uint32_t value = pending ? cb_read(&CB_SYSTICK->cvr) : first;
    return whole_us + (pending ? US_PER_TICK : 0) + (int64_t)((reload - value) / per_us);
}

int64_t cb_time_us(void) {
    int64_t before_us, now_us;
    unsigned tries = 4; /* the interrupt comes once a millisecond, so one repetition is enough */
    do {
        before_us = ticks_us;
        now_us = look();
    } while (before_us != ticks_us && --tries > 0);
    return now_us;
}

uint32_t cb_time_interrupts(void) {
    return cb_read(&interrupts);
}

void cb_time_note_interrupt(void) {
    cb_write(&interrupts, cb_read(&interrupts) + 1);
}

/* No interrupt can come between the comparison and the sleep; a pending one ends the sleep. */
void cb_time_sleep(uint32_t seen) {
    cb_interrupts_off();
    if (cb_read(&interrupts) == seen) cb_wait_for_interrupt();
    cb_interrupts_on();
}

void cb_systick_handler(void) {
    cb_time_note_interrupt();
    ticks_us = ticks_us + US_PER_TICK;
    cb_usart_kick();
}
