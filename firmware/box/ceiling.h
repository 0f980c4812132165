/* SPDX-License-Identifier: MIT
 * The site's ceiling: limits that the operator of the machine sets outside the coefficient file, so
 * that no file can raise them (docs/decisions/0011-site-ceiling.md). */
#ifndef COMPBOX_FIRMWARE_BOX_CEILING_H
#define COMPBOX_FIRMWARE_BOX_CEILING_H

#include <stdint.h>

struct cb_config;

/* For a slope the same numbers apply per metre of travel: µm/m and µm/m/s. */
struct cb_ceiling {
    float um;       /* > 0: largest size of an output; 0: none */
    float um_per_s; /* > 0: largest rate of an output; 0: none */
};

/* in : config, loaded, before cb_box_start()
 * out: config->ceiling_um is set; limit_um and slew_um_per_s of every channel, slopes included, are
 *      at most the ceiling; deadband_um and the derived numbers follow. error_um stays. A slope
 *      still reaches zero within a second, so its limit is at most its slew times one second.
 *      Result: bit i is set where channel i was lowered. */
uint32_t cb_ceiling_apply(struct cb_config *config, const struct cb_ceiling *ceiling);

#endif
