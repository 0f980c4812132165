/* SPDX-License-Identifier: MIT
 * Arguments of the loader beside the text: the target's abilities, its message, its memory. */
#ifndef COMPBOX_FIRMWARE_CONFIG_LOADING_H
#define COMPBOX_FIRMWARE_CONFIG_LOADING_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/base/error.h"
#include "firmware/base/limits.h"

/* Abilities of the target; the loader rejects a file that needs more. */
struct cb_target {
    const char *name;   /* for messages: "compboxd", "compbox-stm32f405" */
    uint8_t sources;    /* bit set of 1 << enum cb_signal_source */
    uint8_t transports; /* bit set of 1 << enum cb_transport */
    uint8_t lacks;      /* bit set of 1 << enum cb_tcp_client: not in this build */
};

/* One sentence for a person: `terms[3].knots[7]: 1.25 is below the knot before it (1.30)`. The
 * caller adds the file's name in front and `, line N` behind. */
struct cb_message {
    char text[224];  /* path, colon, sentence; always ended by 0 */
    uint32_t line;   /* 1-based; 0: no place (an empty file) */
    uint32_t column; /* 1-based, in bytes */
};

/* Memory of the loader during its work; unused afterwards. */
struct cb_load_scratch {
    float values[CB_MAX_CURVE_POINTS]; /* control points, values or coefficients of a term */
    union {
        float knots[CB_MAX_CURVE_POINTS + 8]; /* knots or positions of a curve */
        struct {                              /* a network; maxima as in limits.h */
            float hidden_weights[CB_MAX_NET_HIDDEN * CB_MAX_NET_INPUTS];
            float hidden_bias[CB_MAX_NET_HIDDEN];
            float output_weights[CB_MAX_TERM_OUTPUTS * CB_MAX_NET_HIDDEN];
            float output_bias[CB_MAX_TERM_OUTPUTS];
            float linear_weights[CB_MAX_TERM_OUTPUTS * CB_MAX_NET_INPUTS];
            float input_center[CB_MAX_NET_INPUTS], input_scale[CB_MAX_NET_INPUTS];
            float output_center[CB_MAX_TERM_OUTPUTS], output_scale[CB_MAX_TERM_OUTPUTS];
        } net;
    };
    struct { /* the training range of each of its inputs */
        float min[CB_MAX_NET_INPUTS], max[CB_MAX_NET_INPUTS];
        float margin[CB_MAX_NET_INPUTS], fade[CB_MAX_NET_INPUTS];
    } range;
    uint8_t read_user[CB_MAX_READ_REGISTERS]; /* use of each register */
    uint8_t write_user[CB_MAX_WRITE_REGISTERS];
    char axes[CB_MAX_CHANNELS][CB_NAME_SIZE]; /* names of the machine's axes */
    char known[160]; /* the words that a key accepts, for the message about another word */
};
_Static_assert(sizeof(struct cb_load_scratch) < 32 * 1024, "the loader's scratch memory");

#endif
