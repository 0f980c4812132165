/* SPDX-License-Identifier: MIT
 * A new coefficient file while the box runs: loaded and checked beside the running one by the
 * normal thread, taken over by the loop between two cycles, without a step (cb_box_adopt()). What
 * is bad, older, or would need more than that is refused with a sentence, and the old file goes on.
 * What lets outputs go further or elsewhere is pending until the box is at rest. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_RELOAD_H
#define COMPBOX_HAL_LINUX_DAEMON_RELOAD_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/stat.h>

#include "hal/linux/daemon/load.h"
#include "hal/linux/daemon/loop.h"

/* A file is looked at this often; one that changed is read when it then stays as it is. */
enum { CB_RELOAD_LOOK_US = 1000000 };

enum { CB_RELOAD_SAID = CB_LOAD_SAID + 200 };

struct cb_reload {
    const char *path;
    struct cb_ceiling ceiling; /* of the site: every file is loaded under it */
    bool allow_older;          /* a file of a lower revision than the running one may come */
    struct stat known;         /* the file that was last read */
    struct stat seen;          /* … and as it looked last */
    int64_t looked_us;
    bool offered;              /* the loop has not taken it yet … */
    bool pending;              /* … because the box is not at rest */
    uint32_t pending_crc32;    /* of the file that was pending last, */
    bool pending_said;         /* … about which a line was logged */
    struct cb_loaded loaded;   /* about the file that was last read */
    uint32_t lowered;          /* the running file's: struct cb_loaded */
    uint32_t taken, refused;   /* since the start */
    char last[CB_RELOAD_SAID]; /* the sentence about the last one; "": none yet */
};

/* To be called before the file is first read, so that no change is overlooked. Neither ceiling nor
 * allow_older is set. */
void cb_reload_start(struct cb_reload *reload, const char *path);

/* true: the file changed and has stopped changing. Looks no more often than CB_RELOAD_LOOK_US. */
bool cb_reload_file_changed(struct cb_reload *reload, int64_t now_us);

/* true: a file may be offered; one that was pending, or offered to a box whose configuration has
 * changed in memory, is withdrawn. false: the loop is about to take
 * the one before: ask again later. */
bool cb_reload_ready(struct cb_reload *reload, struct cb_loop *loop);

enum cb_reload_outcome {
    CB_RELOAD_OFFERED, /* the loop takes it before its next cycle */
    CB_RELOAD_PENDING, /* … when the box is at rest; reload->last says why */
    CB_RELOAD_SAME,    /* … and the same file was pending before: nothing new to report */
    CB_RELOAD_REFUSED, /* reload->last says why */
};

/* Reads the file and offers it to the loop. Only where cb_reload_ready(). Refused without a look at
 * the file: the running configuration has changed in memory (cb_loop_is_corrupt()). */
enum cb_reload_outcome cb_reload_offer(struct cb_reload *reload, struct cb_loop *loop);

/* true: the loop has taken the offer; once. Rows of the next generation will come. */
bool cb_reload_taken(struct cb_reload *reload, struct cb_loop *loop);

#endif
