/* SPDX-License-Identifier: MIT */
#include "hal/rtu_exchange.h"

enum cb_transfer cb_rtu_exchange_on(const struct cb_rtu_wire *wire, struct cb_rtu_dialog *dialog,
                                    const struct cb_modbus_request *request, uint16_t *registers,
                                    int64_t deadline_us) {
    uint16_t probed[CB_RTU_MOST_PROBED];
    int64_t until_us;
    cb_rtu_dialog_begin(dialog, request, deadline_us);
    for (;;) {
        const enum cb_rtu_send what =
            cb_rtu_dialog_next(dialog, wire->now_us(wire->context), &until_us);
        if (what == CB_RTU_SEND_NOTHING) return (enum cb_transfer)dialog->outcome;
        const bool probe = what == CB_RTU_SEND_PROBE;
        cb_rtu_dialog_ended(
            dialog, wire->exchange(wire->context, what, probe ? cb_rtu_probe(dialog) : request,
                                   probe ? probed : registers, until_us));
    }
}
