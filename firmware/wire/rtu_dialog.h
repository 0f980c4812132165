/* SPDX-License-Identifier: MIT
 * Chooses a master's next request on a serial line and its retries, such that no reply is accepted
 * for another request. No I/O, no clock; the wire belongs to the target.
 *
 * RTU has no transaction id, but a slave replies to requests in order. If each request got its
 * reply before the next was sent, a reply belongs to the pending request. If one did not (silence,
 * or other bytes came), its reply may still come at any time. From then on only a probe is sent: a
 * read of so few registers that no other reply has its length. Once its reply comes, all earlier
 * replies have come too, or never will. The next doubt uses a probe of another length, because the
 * reply to a second probe of this doubt may still be pending; replies to earlier probes are not, by
 * the same reasoning.
 *
 * A request with a wrong reply, or none, is retried in the same period while there is time. Reading
 * twice, or writing the same absolute values twice, is harmless. */
#ifndef COMPBOX_FIRMWARE_WIRE_RTU_DIALOG_H
#define COMPBOX_FIRMWARE_WIRE_RTU_DIALOG_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/io.h"
#include "firmware/wire/modbus_rtu.h"
#include "firmware/wire/rtu_line.h"

enum {
    CB_RTU_TRIES = 8,      /* frames sent for one request in one cycle, probes included */
    CB_RTU_MOST_PROBED = 3 /* registers */
};

/* The next frame to send. */
enum cb_rtu_send {
    CB_RTU_SEND_NOTHING, /* none, the exchange is over: cb_rtu_dialog.outcome */
    CB_RTU_SEND_REQUEST,
    CB_RTU_SEND_PROBE, /* replies that do not match it are skipped while there is time */
};

/* Result of one frame. */
enum cb_rtu_end {
    CB_RTU_END_REPLY,    /* valid reply */
    CB_RTU_END_REFUSED,  /* exception */
    CB_RTU_END_DAMAGED,  /* a reply by length and beginning, with a wrong check sum: the slave has
                            replied */
    CB_RTU_END_RUBBISH,  /* other bytes came, and ended */
    CB_RTU_END_SILENT,   /* no bytes came, or they did not end */
    CB_RTU_END_STRAY,    /* the request was not sent, because unrequested bytes came */
    CB_RTU_END_NOT_SENT, /* not sent for other reasons: the exchange is over */
};

/* Settings of the dialog, from the coefficient file. */
struct cb_rtu_manners {
    struct cb_rtu_line line;
    struct cb_modbus_request probes[2]; /* of two lengths that no block has */
    uint32_t slave_delay_us;
    uint32_t reserve_us; /* share of the cycle's time that repeated reads leave for the write */
};

struct cb_rtu_dialog {
    struct cb_rtu_manners manners;
    uint32_t grace_us;   /* longest delay from the line to the receiver */
    uint32_t probe_us;   /* shortest time of the longer probe */
    bool doubtful;       /* a reply to an earlier request may be pending */
    bool probed_twice;   /* a reply to a first probe may be pending too */
    uint8_t probe;       /* index of the current probe */
    uint8_t probes_sent; /* probes sent in this doubt, counted up to 2 */
    /* of the current exchange */
    uint32_t request_us; /* its shortest time */
    int64_t deadline_us, again_until_us;
    uint8_t sent, requests; /* frames; requests among them */
    uint8_t sending;        /* enum cb_rtu_send */
    uint8_t outcome;        /* enum cb_transfer, of the whole exchange */
    bool over;
};

/* in : manners as cb_rtu_manners_of (rtu_budget.h) makes them of a file; grace_us as above
 * out: doubtful, because requests before the start are unknown */
void cb_rtu_dialog_start(struct cb_rtu_dialog *dialog, const struct cb_rtu_manners *manners,
                         uint32_t grace_us);

/* The request for CB_RTU_SEND_PROBE. */
static inline const struct cb_modbus_request *cb_rtu_probe(const struct cb_rtu_dialog *dialog) {
    return &dialog->manners.probes[dialog->probe];
}

/* Call it when the device or the slave may have changed. */
void cb_rtu_dialog_doubt(struct cb_rtu_dialog *dialog);

/* Begins an exchange, which ends by deadline_us. in: a read or write of two registers or more */
void cb_rtu_dialog_begin(struct cb_rtu_dialog *dialog, const struct cb_modbus_request *request,
                         int64_t deadline_us);

/* out: the next frame to send; *until_us: end of the wait for its reply, which leaves time for
 *      another try where possible */
enum cb_rtu_send cb_rtu_dialog_next(struct cb_rtu_dialog *dialog, int64_t now_us,
                                    int64_t *until_us);

/* Takes the result of the last frame. */
void cb_rtu_dialog_ended(struct cb_rtu_dialog *dialog, enum cb_rtu_end end);

#endif
