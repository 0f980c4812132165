/* SPDX-License-Identifier: MIT
 * Facts about the chip: cause of its reset, its unique id, its brown-out level. */
#ifndef COMPBOX_HAL_STM32F405_CHIP_H
#define COMPBOX_HAL_STM32F405_CHIP_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/stm32f405/retained.h"

/* X(name, text): supply below which the chip holds itself in reset, by the option bytes. The order
 * is that of the register's field BOR_LEV. */
#define CB_BROWN_OUTS(X)                     \
    X(CB_BROWN_OUT_3, "at level 3")          \
    X(CB_BROWN_OUT_2, "at level 2, TOO LOW") \
    X(CB_BROWN_OUT_1, "at level 1, TOO LOW") \
    X(CB_BROWN_OUT_OFF, "OFF")               \
    X(CB_BROWN_OUT_UNKNOWN, "unknown, emulated")

enum cb_brown_out {
#define CB_X(name, text) name,
    CB_BROWN_OUTS(CB_X)
#undef CB_X
};

struct cb_chip {
    uint32_t unique_id[3]; /* 0 where it is emulated */
    enum cb_brown_out brown_out;
};

/* out: cause by the reset flags; call once, because it clears them. CB_START_UNKNOWN where none is
 *      set, as in the emulator. */
enum cb_start_cause cb_chip_reset_cause(void);

/* in : emulated: the emulator has no unique id, and reading it would fault */
struct cb_chip cb_chip_read(bool emulated);

/* out: whether the level holds the processor in reset below 2.7 V, the minimum for its flash at 168
 *      MHz; true where it is unknown */
bool cb_chip_is_guarded(const struct cb_chip *chip);

const char *cb_brown_out_text(enum cb_brown_out level);

#endif
