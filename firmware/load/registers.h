/* SPDX-License-Identifier: MIT
 * Internal to the loader: the user of each register of the PLC's blocks. */
#ifndef COMPBOX_FIRMWARE_LOAD_REGISTERS_H
#define COMPBOX_FIRMWARE_LOAD_REGISTERS_H

#include "firmware/json/reader.h"

/* User of a register: a code below, or that of a signal or channel. */
enum {
    CB_USER_NOBODY,
    CB_USER_COUNTER,
    CB_USER_CONTROL,
    CB_USER_PLC_HEARTBEAT,
    CB_USER_STATUS,
    CB_USER_BOX_HEARTBEAT,
    CB_USER_HANDSHAKE,
    CB_USER_DETAIL,
    CB_USER_REQUEST,
    CB_USER_SIGNAL,                                    /* + index of the signal */
    CB_USER_CHANNEL = CB_USER_SIGNAL + CB_MAX_SIGNALS, /* + index of the channel */
};
_Static_assert(CB_USER_CHANNEL + CB_MAX_CHANNELS <= 255, "codes are uint8_t");

/* The names of number types, in the file. The first two types have 8 bits and no register; the
 * names of the others begin at CB_REGISTER_WORDS. */
extern const struct cb_word cb_number_words[];
#define CB_REGISTER_WORDS (&cb_number_words[2])

/* Reserves the registers of one number in a block.
 * in : at, the key with the address, for messages; *reg, absolute address; type; user
 * out: true, and *reg is the index in the block; or false and a message, if a register is outside
 *      of the block or in use
 * Two signals of the same type may read exactly the same registers. */
bool cb_take_read(struct cb_loader *loader, uint32_t at, uint8_t type, uint8_t user, uint16_t *reg);
bool cb_take_write(struct cb_loader *loader, uint32_t at, uint8_t type, uint8_t user,
                   uint16_t *reg);

/* out: true if a register of this type holds the number, a quotient of two numbers of the file: its
 *      three roundings to float32 do not count */
bool cb_register_holds(uint8_t type, float number);

/* Reserves the first and last register of each block with counters. */
void cb_take_counters(struct cb_loader *loader);

#endif
