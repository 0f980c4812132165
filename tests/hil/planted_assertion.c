/* SPDX-License-Identifier: MIT
 * Linked into a compboxd for the tests alone: a programmer's mistake. After two seconds of ACTIVE
 * it gives the box a mode that does not exist, which an assertion of the next step finds
 * (box/mode.c). */
#include "firmware/box/box.h"

enum { ACTIVE_STEPS = 66 };

void __real_cb_box_step(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                        struct cb_outputs *out);
void __wrap_cb_box_step(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                        struct cb_outputs *out);

void __wrap_cb_box_step(struct cb_box *box, const struct cb_inputs *in, int64_t now_us,
                        struct cb_outputs *out) {
    static unsigned active;
    active += box->mode.mode == CB_MODE_ACTIVE;
    if (active == ACTIVE_STEPS) box->mode.mode = CB_MODE_STOPPED + 1;
    __real_cb_box_step(box, in, now_us, out);
}
