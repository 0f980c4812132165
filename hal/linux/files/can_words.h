/* SPDX-License-Identifier: MIT
 * States of the CAN bus and its nodes in words, for log and statistics. */
#ifndef COMPBOX_HAL_LINUX_FILES_CAN_WORDS_H
#define COMPBOX_HAL_LINUX_FILES_CAN_WORDS_H

#include <stdint.h>

const char *cb_can_state_word(uint8_t state);     /* enum cb_can_state */
const char *cb_canopen_state_word(uint8_t state); /* enum cb_canopen_state, or any other */

#endif
