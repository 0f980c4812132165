/* SPDX-License-Identifier: MIT
 * Internal to the loader: checks of the file against its control (config/profile.h). */
#ifndef COMPBOX_FIRMWARE_LOAD_CONTROL_H
#define COMPBOX_FIRMWARE_LOAD_CONTROL_H

#include "firmware/json/reader.h"

struct cb_channel_config;

/* Checks return true, or false with a message. */

/* in : at, the section plc, loaded with its blocks
 * out: true if the control supports the exchange, and one request carries each block */
bool cb_check_exchange(struct cb_loader *loader, uint32_t at);

/* in : at, type, of a number in the read block
 * out: true if the control can send it */
bool cb_check_signal_type(struct cb_loader *loader, uint32_t at, uint8_t type);

/* in : at, type, of a number of a channel
 * out: true if the control can receive it */
bool cb_check_value_type(struct cb_loader *loader, uint32_t at, uint8_t type);

/* in : places of limit and scale of a loaded channel
 * out: true if the scale is an increment of the control, and the limit is in its range */
bool cb_check_increments(struct cb_loader *loader, uint32_t limit_at, uint32_t scale_at,
                         const struct cb_channel_config *channel);

/* in : all channels loaded
 * out: step_um of channels with `applied`; every slew rate is one that the control follows */
void cb_hold_to_steps(struct cb_config *config);

#endif
