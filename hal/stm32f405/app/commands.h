/* SPDX-License-Identifier: MIT
 * Commands of the console. */
#ifndef COMPBOX_HAL_STM32F405_APP_COMMANDS_H
#define COMPBOX_HAL_STM32F405_APP_COMMANDS_H

#include "hal/stm32f405/app/app.h"

struct cb_command {
    const char *words, *help; /* words as typed */
    void (*run)(struct cb_app *app);
};

struct cb_command_list {
    const struct cb_command *commands;
    unsigned count;
};

/* Commands that make the box fail: of the test image (variant/test.c); the product's list is empty
 * (variant/product.c). */
extern const struct cb_command_list cb_test_commands;

#endif
