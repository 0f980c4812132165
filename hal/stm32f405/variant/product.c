/* SPDX-License-Identifier: MIT
 * The product: no command makes it fail. */
#include "hal/stm32f405/app/commands.h"

const struct cb_command_list cb_test_commands = {0, 0};
