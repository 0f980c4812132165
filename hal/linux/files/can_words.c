/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/can_words.h"

#include "firmware/signals/canopen.h"
#include "hal/linux/can.h"

const char *cb_can_state_word(uint8_t state) {
    static const char *const words[] = {
        [CB_CAN_CLOSED] = "not there",
        [CB_CAN_UP] = "up",
        [CB_CAN_DOWN] = "down",
        [CB_CAN_BUS_OFF] = "bus-off",
    };
    return state < sizeof words / sizeof words[0] ? words[state] : "unknown";
}

const char *cb_canopen_state_word(uint8_t state) {
    switch (state) {
        case CB_CANOPEN_BOOTED:
            return "booted";
        case CB_CANOPEN_STOPPED:
            return "stopped";
        case CB_CANOPEN_OPERATIONAL:
            return "operational";
        case CB_CANOPEN_PRE_OPERATIONAL:
            return "pre-operational";
        default:
            return "unknown";
    }
}
