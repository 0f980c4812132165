/* SPDX-License-Identifier: MIT
 * What the PLC says it applies, and whether that is what it was given. */
#ifndef COMPBOX_FIRMWARE_APPLIED_H
#define COMPBOX_FIRMWARE_APPLIED_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/config.h"
#include "firmware/limiter.h"

/* A PLC that applies something else for so long, without moving it, does not follow; in any case it
 * has ten updates of the NC (cb_profile_update_us). */
enum { CB_UNAPPLIED_US = 1000000 };

/* Takes the values of a good reading: registers of the read block; elapsed_us since the step
 * before; judged: the PLC has to follow (the box is ACTIVE).
 * out: true: a channel has stood for too long further from the last written value than the PLC's
 *      deadband and a unit of the register */
bool cb_applied_take(const struct cb_config *config, struct cb_channel_state *channels,
                     const uint16_t *registers, uint32_t elapsed_us, bool judged);

#endif
