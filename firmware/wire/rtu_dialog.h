/* SPDX-License-Identifier: MIT
 * What a master on a serial line asks next, so that a reply is never taken for that to another
 * request, and what is asked again. No I/O, no clock; the wire belongs to the target.
 *
 * RTU has no transaction id. But a slave answers one request after the other: as long as each was
 * answered before the next went out, a reply is that to the request that is out. Where one was not
 * (it stayed silent, something else came), the slave may still have something to say, however late.
 * From then on nothing is asked but a probe, a reading of so few registers that no other reply has
 * its length. When its reply comes, all replies before it have come too, or never will. The probe
 * of the next doubt has another length: a second probe of this one may still be answered then, and
 * by the same reasoning none of the one before.
 *
 * What was answered wrongly, or not at all, is asked again in the same period where there is time:
 * reading twice and writing the same absolute values twice harm nobody. */
#ifndef COMPBOX_FIRMWARE_WIRE_RTU_DIALOG_H
#define COMPBOX_FIRMWARE_WIRE_RTU_DIALOG_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/io.h"
#include "firmware/wire/modbus_rtu.h"
#include "firmware/wire/rtu_line.h"

enum {
    CB_RTU_TRIES = 8,      /* frames sent for one request in one cycle, probes counted */
    CB_RTU_MOST_PROBED = 3 /* registers */
};

/* What to send now. */
enum cb_rtu_ask {
    CB_RTU_ASK_NOTHING, /* it is over: cb_rtu_dialog.outcome */
    CB_RTU_ASK_REQUEST,
    CB_RTU_ASK_PROBE, /* what is not its reply is skipped, as long as there is time */
};

/* How one frame that was to be sent ended. */
enum cb_rtu_end {
    CB_RTU_END_REPLY,    /* as asked */
    CB_RTU_END_REFUSED,  /* by an exception */
    CB_RTU_END_DAMAGED,  /* its reply by length and beginning, with a wrong check sum: the slave has
                            had its say */
    CB_RTU_END_RUBBISH,  /* something else came, and ended */
    CB_RTU_END_SILENT,   /* nothing came, or did not end */
    CB_RTU_END_STRAY,    /* a request was not sent: bytes came that nobody asked for */
    CB_RTU_END_NOT_SENT, /* for other reasons: the exchange is over */
};

/* What of a coefficient file counts for the dialog. */
struct cb_rtu_manners {
    struct cb_rtu_line line;
    struct cb_modbus_request probes[2]; /* of different lengths, that no block has */
    uint32_t slave_delay_us;
    uint32_t reserve_us; /* what repeating a reading leaves of the cycle's time, for the write */
};

struct cb_rtu_dialog {
    struct cb_rtu_manners manners;
    uint32_t grace_us;   /* by which a reply may be handed over later than the line has it */
    uint32_t probe_us;   /* what the longer probe takes at least */
    bool doubtful;       /* an earlier request may still be answered */
    bool probed_twice;   /* … or was, and a second probe may still be */
    uint8_t probe;       /* of this doubt */
    uint8_t probes_sent; /* … so often; at most 2 are counted */
    /* of the exchange that goes on */
    uint32_t request_us; /* what it takes at least */
    int64_t deadline_us, again_until_us;
    uint8_t sent, requests; /* frames; requests of them */
    uint8_t asked;          /* enum cb_rtu_ask */
    uint8_t outcome;        /* enum cb_transfer: how the whole exchange ended */
    bool over;
};

/* in : manners as cb_rtu_manners_of (rtu_budget.h) makes them of a file; grace_us as above
 * out: doubtful: nobody knows what was asked before the start */
void cb_rtu_dialog_start(struct cb_rtu_dialog *dialog, const struct cb_rtu_manners *manners,
                         uint32_t grace_us);

/* What to send for CB_RTU_ASK_PROBE. */
static inline const struct cb_modbus_request *cb_rtu_probe(const struct cb_rtu_dialog *dialog) {
    return &dialog->manners.probes[dialog->probe];
}

/* The device or the slave may be another one now. */
void cb_rtu_dialog_doubt(struct cb_rtu_dialog *dialog);

/* An exchange begins; it is over by deadline_us. in: a reading or writing of two registers or more
 */
void cb_rtu_dialog_begin(struct cb_rtu_dialog *dialog, const struct cb_modbus_request *request,
                         int64_t deadline_us);

/* out: what to send now; *until_us: how long to wait for its reply, so that there is time for
 * another try where there can be */
enum cb_rtu_ask cb_rtu_dialog_next(struct cb_rtu_dialog *dialog, int64_t now_us, int64_t *until_us);

/* What was asked for last ended so. */
void cb_rtu_dialog_ended(struct cb_rtu_dialog *dialog, enum cb_rtu_end end);

#endif
