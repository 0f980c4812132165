/* SPDX-License-Identifier: MIT
 * A new coefficient file while the box runs. The normal thread loads and checks it beside the
 * running one, and the loop takes it over between two cycles, without a step (cb_box_adopt()). A
 * bad or older file, or one that needs a restart, is rejected with a sentence, and the old file
 * remains in use. A file that lets outputs go further or elsewhere is pending until the box is at
 * rest. */
#ifndef COMPBOX_HAL_LINUX_DAEMON_RELOAD_H
#define COMPBOX_HAL_LINUX_DAEMON_RELOAD_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/stat.h>

#include "hal/linux/daemon/load.h"
#include "hal/linux/daemon/loop.h"

/* Check interval of the file; a changed file is read once it is unchanged for one interval. */
enum { CB_RELOAD_LOOK_US = 1000000 };

enum { CB_RELOAD_MESSAGE_BYTES = CB_LOAD_MESSAGE_BYTES + 200 };

/* Who sent a signal. */
struct cb_sender {
    bool known;
    uint32_t user;
    int32_t pid;
};

/* What may have changed: a file, and its signature where keys are enrolled. */
struct cb_reload_look {
    struct stat file, signature;
};

struct cb_reload {
    const char *path;
    struct cb_site site;
    bool allow_older;            /* a file of a lower revision than the running one is accepted */
    struct cb_reload_look known; /* at the file's last reading */
    struct cb_reload_look seen;  /* at the last check */
    int64_t looked_us;
    bool offered;                       /* the loop has not taken it yet … */
    bool pending;                       /* … because the box is not at rest */
    uint32_t pending_crc32;             /* of the last pending file … */
    bool pending_logged;                /* … whose line was logged */
    struct cb_sender sender;            /* of the last request by SIGHUP, until the file is read */
    struct cb_loaded loaded;            /* about the last file read */
    uint32_t lowered;                   /* of the running file: struct cb_loaded */
    uint32_t taken, refused;            /* since the start */
    char last[CB_RELOAD_MESSAGE_BYTES]; /* sentence about the last file; "": none yet */
};

/* Call it before the file is first read, so that no change is missed. It does not set allow_older.
 */
void cb_reload_start(struct cb_reload *reload, const char *path, const struct cb_site *site);

/* Whether this box may run the file after another one. in: what ran before: its machine and its
 * revision; loaded: of the file `fresh`. out: true; or false, and a sentence in reload->last */
bool cb_reload_follows(struct cb_reload *reload, const char *machine, uint32_t revision,
                       const struct cb_config *fresh);

/* out: true if the file or its signature changed, and both are stable again. Checks at most every
 * CB_RELOAD_LOOK_US. */
bool cb_reload_file_changed(struct cb_reload *reload, int64_t now_us);

/* out: true: a file may be offered; a pending file, or one offered to a box whose configuration has
 *      changed in memory, is withdrawn. false: the loop is taking the previous one: retry later. */
bool cb_reload_ready(struct cb_reload *reload, struct cb_loop *loop);

enum cb_reload_outcome {
    CB_RELOAD_OFFERED, /* the loop takes it before its next cycle */
    CB_RELOAD_PENDING, /* … once the box is at rest; reload->last has the reason */
    CB_RELOAD_SAME,    /* … and the same file was pending before: no new report */
    CB_RELOAD_REFUSED, /* reload->last has the reason */
};

/* Reads the file and offers it to the loop. Requires cb_reload_ready(). The file is rejected unread
 * if the running configuration has changed in memory (cb_loop_is_corrupt()). */
enum cb_reload_outcome cb_reload_offer(struct cb_reload *reload, struct cb_loop *loop);

/* out: true, once, when the loop has taken the offer. Rows of the next generation follow. */
bool cb_reload_taken(struct cb_reload *reload, struct cb_loop *loop);

#endif
