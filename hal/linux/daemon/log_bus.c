/* SPDX-License-Identifier: MIT
 * Log of the slow bus: its device, and modules that fall silent. */
#include "hal/linux/bus.h"
#include "hal/linux/daemon/log.h"
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
