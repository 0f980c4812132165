/* SPDX-License-Identifier: MIT
 * Values that every step needs beside the file's own numbers, computed once from the
 * configuration. */
#ifndef COMPBOX_FIRMWARE_CONFIG_DERIVE_H
#define COMPBOX_FIRMWARE_CONFIG_DERIVE_H

struct cb_config;

/* in : config, complete except for its derived fields
 * out: the derived fields. The loader ends with this call, and cb_box_start() repeats it for a
 *      configuration that was made or changed otherwise. */
void cb_config_derive(struct cb_config *config);

#endif
