/* SPDX-License-Identifier: MIT
 * What the file does not say but every step needs: made once of the rest of the configuration. */
#ifndef COMPBOX_FIRMWARE_CONFIG_DERIVE_H
#define COMPBOX_FIRMWARE_CONFIG_DERIVE_H

#include "firmware/config/config.h"

/* in : config, complete but for what config.h calls derived
 * out: that too. The loader ends with it, and cb_box_start() does it anew for a configuration that
 *      was made or changed by hand. */
void cb_config_derive(struct cb_config *config);

#endif
