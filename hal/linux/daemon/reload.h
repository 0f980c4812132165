/* SPDX-License-Identifier: MIT
 * A new coefficient file while the box runs: loaded and checked beside the running one by the
 * normal thread, taken over by the loop between two cycles, without a step (cb_box_adopt()). What
 * is bad or would need more than that is refused with a sentence, and the old file goes on. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_RELOAD_H
#define COMPBOX_HAL_LINUX_DAEMON_RELOAD_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/stat.h>

#include "hal/linux/daemon/loop.h"

/* A file is looked at this often; one that changed is read when it then stays as it is. */
enum { CB_RELOAD_LOOK_US = 1000000 };

enum { CB_RELOAD_SAID = 512 };

struct cb_reload {
    const char *path;
    struct stat known; /* the file that was last read */
    struct stat seen;  /* … and as it looked last */
    int64_t looked_us;
    bool offered;              /* the loop has not answered yet */
    uint32_t taken, refused;   /* since the start */
    char last[CB_RELOAD_SAID]; /* what was said about the last one; "": none yet */
};

/* To be called before the file is first read, so that no change is overlooked. */
void cb_reload_start(struct cb_reload *reload, const char *path);

/* true: the file changed and has stopped changing. Looks no more often than CB_RELOAD_LOOK_US. */
bool cb_reload_file_changed(struct cb_reload *reload, int64_t now_us);

/* Reads the file and offers it to the loop. out: false: it is refused, reload->last says why.
 * Not to be called while an offer is out. */
bool cb_reload_offer(struct cb_reload *reload, struct cb_loop *loop);

enum cb_reload_answer { CB_RELOAD_NONE, CB_RELOAD_TAKEN, CB_RELOAD_REFUSED };

/* What the loop says to the offer; once. TAKEN: rows of the next generation will come. */
enum cb_reload_answer cb_reload_answer(struct cb_reload *reload, struct cb_loop *loop);

#endif
