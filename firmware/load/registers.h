/* SPDX-License-Identifier: MIT
 * Inside of the loader: which register of the PLC's blocks is used for what. */
#ifndef COMPBOX_FIRMWARE_LOAD_REGISTERS_H
#define COMPBOX_FIRMWARE_LOAD_REGISTERS_H

#include "firmware/json/reader.h"

/* What a register is used for: a code below, or one of a signal or channel. */
enum {
    CB_USER_NOBODY,
    CB_USER_COUNTER,
    CB_USER_CONTROL,
    CB_USER_PLC_HEARTBEAT,
    CB_USER_STATUS,
    CB_USER_BOX_HEARTBEAT,
    CB_USER_HANDSHAKE,
    CB_USER_DETAIL,
    CB_USER_SIGNAL,                                    /* + index of the signal */
    CB_USER_CHANNEL = CB_USER_SIGNAL + CB_MAX_SIGNALS, /* + index of the channel */
};
_Static_assert(CB_USER_CHANNEL + CB_MAX_CHANNELS <= 255, "codes are uint8_t");

/* Every spelling of a number type; behind the first two, of those that lie in registers. */
extern const struct cb_word cb_number_words[];
#define CB_REGISTER_WORDS (&cb_number_words[2])

/* Takes the registers of one number of a block.
 * in : at: the key with the address, for messages; *reg: absolute address; type; user
 * out: true and *reg the index in the block: all its registers lie in the block and were free;
 *      in the read block a signal may also share exactly the registers of an earlier one with the
 *      same type */
bool cb_take_read(struct cb_loader *loader, uint32_t at, uint8_t type, uint8_t user, uint16_t *reg);
bool cb_take_write(struct cb_loader *loader, uint32_t at, uint8_t type, uint8_t user,
                   uint16_t *reg);

/* Takes the first and last register of both blocks where they carry counters. */
void cb_take_counters(struct cb_loader *loader);

#endif
