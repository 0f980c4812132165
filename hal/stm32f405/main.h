/* SPDX-License-Identifier: MIT
 * The program, called by start.c. */
#ifndef COMPBOX_HAL_STM32F405_MAIN_H
#define COMPBOX_HAL_STM32F405_MAIN_H

_Noreturn void cb_main(void);

#endif
