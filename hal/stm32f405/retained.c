/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/retained.h"

#include <stddef.h>
#include <string.h>

#include "hal/stm32f405/mcu.h"

enum { MAGIC = 0x43425246 };

__attribute__((section(".retained"))) struct cb_retained cb_retained;

static uint32_t sum_of(const struct cb_retained *block) {
    uint32_t words[offsetof(struct cb_retained, sum) / 4], sum = 1;
    memcpy(words, block, sizeof words);
    for (unsigned i = 0; i < sizeof words / sizeof words[0]; ++i)
        sum = (sum << 5 | sum >> 27) ^ words[i];
    return sum;
}

void cb_retained_seal(void) {
    cb_retained.magic = MAGIC;
    cb_retained.sum = sum_of(&cb_retained);
}

bool cb_start_was_fault(enum cb_start_cause cause) {
    return cause == CB_START_FAULT || cause == CB_START_ASSERTION || cause == CB_START_STACK ||
           cause == CB_START_WATCHDOG || cause == CB_START_WINDOW || cause == CB_START_LOW_POWER;
}

enum cb_start_cause cb_retained_open(enum cb_start_cause by_flags) {
    if (cb_retained.magic != MAGIC || cb_retained.sum != sum_of(&cb_retained))
        memset(&cb_retained, 0, sizeof cb_retained);
    const enum cb_start_cause noted = (enum cb_start_cause)cb_retained.cause;
    const enum cb_start_cause cause = noted != CB_START_UNKNOWN ? noted : by_flags;
    cb_retained.cause = CB_START_UNKNOWN;
    if (cb_start_was_fault(cause)) ++cb_retained.fault_starts;
    cb_retained_seal();
    return cause;
}

_Noreturn void cb_restart(enum cb_start_cause cause) {
    cb_retained.cause = cause;
    cb_retained_seal();
    cb_reset();
}

const char *cb_start_text(enum cb_start_cause cause) {
    static const char *const texts[] = {
#define CB_X(name, text) text,
        CB_STARTS(CB_X)
#undef CB_X
    };
    return cause < sizeof texts / sizeof texts[0] ? texts[cause] : "unknown";
}
