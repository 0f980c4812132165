/* SPDX-License-Identifier: MIT
 * The program, which start.c begins with. */
#ifndef COMPBOX_HAL_STM32F405_MAIN_H
#define COMPBOX_HAL_STM32F405_MAIN_H

_Noreturn void cb_main(void);

#endif
