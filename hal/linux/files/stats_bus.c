/* SPDX-License-Identifier: MIT
 * The slow bus in the statistics and the snapshot. */
#include "hal/linux/files/stats.h"

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
