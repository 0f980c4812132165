/* SPDX-License-Identifier: MIT
 * Inside of the loader: whether the control of the file can serve it (profile.h). */
#ifndef COMPBOX_FIRMWARE_LOAD_CONTROL_H
#define COMPBOX_FIRMWARE_LOAD_CONTROL_H

#include "firmware/json/reader.h"

/* in : at: the section plc, read; its blocks too
 * out: the control answers the exchange, and one request carries each block */
bool cb_check_exchange(struct cb_loader *loader, uint32_t at);

/* in : at: the type of a number in the read block
 * out: the control can send it */
bool cb_check_signal_type(struct cb_loader *loader, uint32_t at, uint8_t type);

/* in : at: the type of a number of a channel
 * out: the control can take it */
bool cb_check_value_type(struct cb_loader *loader, uint32_t at, uint8_t type);

/* in : at: limit and scale of a channel that is read
 * out: the control has such increments, and so many of them */
bool cb_check_increments(struct cb_loader *loader, uint32_t limit_at, uint32_t scale_at,
                         const struct cb_channel_config *channel);

/* in : all channels loaded
 * out: none moves faster than its control can take over */
void cb_hold_to_steps(struct cb_config *config);

#endif
