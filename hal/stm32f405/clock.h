/* SPDX-License-Identifier: MIT
 * Clock tree: 168 MHz from the crystal, else from the internal oscillator, else 16 MHz directly
 * from that oscillator. Every wait for the hardware is limited. */
#ifndef COMPBOX_HAL_STM32F405_CLOCK_H
#define COMPBOX_HAL_STM32F405_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

/* X(name, text): the source of the clock. */
#define CB_CLOCKS(X)                                                    \
    X(CB_CLOCK_CRYSTAL, "168 MHz from the crystal")                     \
    X(CB_CLOCK_INTERNAL, "168 MHz from the internal oscillator")        \
    X(CB_CLOCK_SLOW, "16 MHz, the internal oscillator without the PLL") \
    X(CB_CLOCK_EMULATED, "168 MHz, emulated")

enum cb_clock_source {
#define CB_X(name, text) name,
    CB_CLOCKS(CB_X)
#undef CB_X
};

struct cb_clock {
    enum cb_clock_source source;
    uint32_t core_hz, apb1_hz, apb2_hz;
};

/* in : crystal: whether to try it (false once it has failed)
 * out: the clocks in use; the clock security system monitors the crystal */
struct cb_clock cb_clock_start(bool crystal);

const char *cb_clock_text(enum cb_clock_source source);

#endif
