/* SPDX-License-Identifier: MIT
 * The bus in the log and in the statistics. */
#include "hal/linux/daemon/bus_words.h"

#include "hal/linux/serial_opener.h"

/* Logs each module that stops replying, or replies again. */
static void log_modules(struct cb_log *log, const char *name, const struct cb_bus_report *before,
                        const struct cb_bus_report *now, int64_t now_us) {
    for (unsigned i = 0; now->open && i < now->turns; ++i) {
        if (now->silent[i] == before->silent[i]) continue;
        cb_log_limited(log, CB_LOG_BUS, now_us, "bus %s: module %u %s", name,
                       (unsigned)now->units[i], now->silent[i] ? "does not answer" : "answers");
    }
}

void cb_log_bus(struct cb_log *log, struct cb_bus *bus, int64_t now_us) {
    const struct cb_bus_report before = bus->last;
    if (!bus->runs || !cb_bus_look(bus)) return;
    const struct cb_bus_report *now = &bus->last;
    const char *name = bus->config->buses[0].name, *device = bus->config->buses[0].serial.device;
    if (now->connects != before.connects)
        cb_log_limited(log, CB_LOG_BUS, now_us, "bus %s: %s is open", name, device);
    if (now->disconnects != before.disconnects || (now->failures > 0 && before.failures == 0))
        cb_log_limited(log, CB_LOG_BUS, now_us, "bus %s: %s: %s; trying again", name, device,
                       cb_serial_error(now->error_number));
    log_modules(log, name, &before, now, now_us);
}

void cb_stats_put_bus(struct cb_writer *json, const struct cb_bus *bus) {
    if (bus->config == NULL) return;
    const struct cb_bus_report *now = &bus->last;
    cb_writer_object(json, "bus");
    cb_writer_text(json, "name", bus->config->buses[0].name);
    cb_writer_text(json, "device", bus->config->buses[0].serial.device);
    cb_writer_whole(json, "connects", now->connects);
    cb_writer_whole(json, "connects_failed", now->failures);
    cb_writer_whole(json, "disconnects", now->disconnects);
#define CB_X(counter) cb_writer_whole(json, #counter, now->counters.counter);
    CB_RTU_COUNTERS(CB_X)
#undef CB_X
    cb_writer_whole(json, "samples_lost", cb_ring_lost(&bus->to->ring));
    cb_writer_array(json, "modules");
    for (unsigned i = 0; i < now->turns; ++i) {
        cb_writer_object(json, NULL);
        cb_writer_whole(json, "unit", now->units[i]);
        cb_writer_truth(json, "answers", !now->silent[i]);
        cb_writer_close(json);
    }
    cb_writer_close(json);
    cb_writer_close(json);
}
