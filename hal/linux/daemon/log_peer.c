/* SPDX-License-Identifier: MIT
 * Log of the PLC's limitations: refused requests, replies that do not match, slow replies. */
#include <math.h>
#include <stdio.h>

#include "firmware/box/mode.h"
#include "firmware/config/profile.h"
#include "hal/linux/daemon/log.h"

enum { SAME_AGAIN_US = 60000000 /* repetition for the same odd reply on another connection */ };

static void log_refused(struct cb_log *log, const struct cb_row *row) {
    static const uint8_t functions[] = {CB_MODBUS_READ, CB_MODBUS_WRITE, CB_MODBUS_WRITE_READ};
    const uint32_t fresh = row->peer.refused_functions & ~log->refused_functions;
    for (unsigned i = 0; i < sizeof functions; i++)
        if (fresh & 1u << functions[i])
            cb_log_limited(log, CB_LOG_WIRE, row->time_us,
                           "%s: the PLC does not have function %u (exception 1, illegal function): "
                           "%s",
                           log->plc, functions[i], cb_peer_remedy(functions[i]));
    log->refused_functions = row->peer.refused_functions;
}

/* Once for each kind and connection; the same reply on a new connection only after a while. */
static bool is_news(const struct cb_log_odd *odd, const struct cb_odd_reply *now,
                    const struct cb_row *row) {
    const bool same = now->got == odd->logged.got && now->expected == odd->logged.expected;
    if (now->count == odd->seen.count) return false;
    if (odd->logged.count == 0) return true;
    if (row->link.connects == odd->connects) return false;
    return !same || row->time_us - odd->logged_us >= SAME_AGAIN_US;
}

/* Logs each new kind of reply that does not match its request, and records what was logged. */
static void log_odd(struct cb_log *log, const struct cb_row *row) {
    static const char *const sentences[] = {
#define CB_X(name, word, sentence) [name] = sentence,
        CB_ODD_REPLIES(CB_X)
#undef CB_X
    };
    for (enum cb_odd kind = 0; kind < CB_ODD_COUNT; kind++) {
        const struct cb_odd_reply *now = &row->peer.odd[kind];
        struct cb_log_odd *odd = &log->odd[kind];
        const bool news = is_news(odd, now, row);
        odd->seen = *now;
        if (!news) continue;
        char text[120];
        snprintf(text, sizeof text, sentences[kind], now->got, now->expected);
        cb_log_limited(log, CB_LOG_WIRE, row->time_us, "%s: %s; it is not used", log->plc, text);
        odd->logged = *now;
        odd->connects = row->link.connects;
        odd->logged_us = row->time_us;
    }
}

/* out: the period in which that many successive requests end by the deadline, as in `compbox
 *      commission` */
static unsigned period_ms(unsigned requests, uint32_t reply_us) {
    return (unsigned)ceil(requests * (double)reply_us * 1e-3 / 0.8);
}

/* Contact is lost and replies are too slow: logs their time, and a suitable period. */
static void log_slow(struct cb_log *log, const struct cb_config *config, const struct cb_row *row) {
    const uint32_t slowest_us = cb_peer_slowest_us(&row->peer);
    const bool two = config->plc.exchange == CB_EXCHANGE_FC3_FC16;
    const unsigned needs_ms = period_ms(two ? 2 : 1, slowest_us);
    const bool lost = row->reason == CB_REASON_UNCONFIRMED || row->reason == CB_REASON_NO_PLC;
    const bool has_23 = cb_profile_answers(cb_profile_of(config->plc.profile), CB_EXCHANGE_FC23) &&
                        !(row->peer.refused_functions & 1u << CB_MODBUS_WRITE_READ);
    char other[60] = "";
    if (log->slow && lost) return;
    log->slow = lost && needs_ms * 1000u > config->period_us;
    if (!log->slow) return;
    if (two && has_23)
        snprintf(other, sizeof other, ", or \"fc23\" and %u", period_ms(1, slowest_us));
    cb_log_limited(log, CB_LOG_WIRE, row->time_us,
                   "%s: replies take up to %.1f ms: plc.exchange \"%s\" needs cycle.period_ms of "
                   "%u at least%s",
                   log->plc, slowest_us * 1e-3, two ? "fc3+fc16" : "fc23", needs_ms, other);
}

void cb_log_peer(struct cb_log *log, const struct cb_config *config, const struct cb_row *row) {
    log_refused(log, row);
    log_odd(log, row);
    log_slow(log, config, row);
}
