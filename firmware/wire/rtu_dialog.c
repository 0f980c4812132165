/* SPDX-License-Identifier: MIT */
#include "firmware/wire/rtu_dialog.h"

enum { LATE_US = 1000 }; /* latest wake-up after the end of a wait */

void cb_rtu_dialog_start(struct cb_rtu_dialog *dialog, const struct cb_rtu_manners *manners,
                         uint32_t grace_us) {
    *dialog = (struct cb_rtu_dialog){.manners = *manners, .grace_us = grace_us, .doubtful = true};
    dialog->probe_us = cb_rtu_exchange_us(&manners->line, &manners->probes[1], 0);
}

void cb_rtu_dialog_doubt(struct cb_rtu_dialog *dialog) {
    if (dialog->doubtful) return;
    dialog->doubtful = true;
    dialog->probe ^= 1;
    dialog->probes_sent = 0;
}

void cb_rtu_dialog_begin(struct cb_rtu_dialog *dialog, const struct cb_modbus_request *request,
                         int64_t deadline_us) {
    const bool reads = request->function == CB_MODBUS_READ;
    dialog->request_us = cb_rtu_exchange_us(&dialog->manners.line, request, 0);
    dialog->deadline_us = deadline_us;
    dialog->again_until_us = deadline_us - (reads ? (int64_t)dialog->manners.reserve_us : 0);
    dialog->sent = dialog->requests = 0;
    dialog->outcome = CB_TRANSFER_FAILED;
    dialog->over = false;
}

/* Longest time of a frame and its reply. */
static int64_t most_us(const struct cb_rtu_dialog *dialog, uint32_t least_us) {
    return (int64_t)least_us + dialog->manners.slave_delay_us + dialog->grace_us;
}

/* out: longest time of the request, plus the probe where one must go first */
static int64_t all_us(const struct cb_rtu_dialog *dialog, bool doubtful) {
    const int64_t request_us = most_us(dialog, dialog->request_us);
    return doubtful ? request_us + most_us(dialog, dialog->probe_us) : request_us;
}

/* A first try needs time for the earliest possible reply, a repetition for the latest. */
static bool has_time(const struct cb_rtu_dialog *dialog, int64_t now_us) {
    const bool again = dialog->requests > 0 || (dialog->doubtful && dialog->sent > 0);
    if (again) return dialog->again_until_us - now_us >= all_us(dialog, dialog->doubtful);
    return dialog->deadline_us - now_us >=
           (int64_t)(dialog->doubtful ? dialog->probe_us : dialog->request_us);
}

enum cb_rtu_send cb_rtu_dialog_next(struct cb_rtu_dialog *dialog, int64_t now_us,
                                    int64_t *until_us) {
    dialog->sending = CB_RTU_SEND_NOTHING;
    if (dialog->over || dialog->sent >= CB_RTU_TRIES || !has_time(dialog, now_us))
        return CB_RTU_SEND_NOTHING;
    const int64_t once_more_us = dialog->again_until_us - all_us(dialog, true) - LATE_US;
    const bool twice = once_more_us - now_us >= all_us(dialog, dialog->doubtful);
    *until_us = twice ? once_more_us : dialog->deadline_us;
    dialog->sending = dialog->doubtful ? CB_RTU_SEND_PROBE : CB_RTU_SEND_REQUEST;
    return (enum cb_rtu_send)dialog->sending;
}

static void end_with(struct cb_rtu_dialog *dialog, enum cb_transfer outcome) {
    dialog->over = true;
    dialog->outcome = (uint8_t)outcome;
}

/* An exception does not name the reading that it refuses, so a late one does not end the doubt. */
static void probe_ended(struct cb_rtu_dialog *dialog, enum cb_rtu_end end) {
    if (dialog->probes_sent < 2) ++dialog->probes_sent;
    if (end == CB_RTU_END_REPLY || end == CB_RTU_END_DAMAGED) {
        dialog->doubtful = false;
        dialog->probed_twice = dialog->probes_sent > 1;
    }
    if (end == CB_RTU_END_REFUSED)
        end_with(dialog, dialog->requests > 0 ? CB_TRANSFER_UNKNOWN : CB_TRANSFER_REFUSED);
}

/* A refusal is certain only if no other request can have been refused. */
static void request_ended(struct cb_rtu_dialog *dialog, enum cb_rtu_end end) {
    const bool refused = end == CB_RTU_END_REFUSED;
    const bool certain = dialog->requests == 0 && !dialog->probed_twice;
    ++dialog->requests;
    dialog->outcome = CB_TRANSFER_UNKNOWN;
    if (end == CB_RTU_END_REPLY) end_with(dialog, CB_TRANSFER_OK);
    if (refused) end_with(dialog, certain ? CB_TRANSFER_REFUSED : CB_TRANSFER_UNKNOWN);
    if (end == CB_RTU_END_RUBBISH || end == CB_RTU_END_SILENT || (refused && dialog->probed_twice))
        cb_rtu_dialog_doubt(dialog);
}

void cb_rtu_dialog_ended(struct cb_rtu_dialog *dialog, enum cb_rtu_end end) {
    ++dialog->sent;
    if (end == CB_RTU_END_NOT_SENT)
        dialog->over = true;
    else if (end == CB_RTU_END_STRAY)
        cb_rtu_dialog_doubt(dialog);
    else if (dialog->sending == CB_RTU_SEND_PROBE)
        probe_ended(dialog, end);
    else
        request_ended(dialog, end);
}
