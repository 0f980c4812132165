/* SPDX-License-Identifier: MIT
 * Lags: signals that follow another one with the thermal memory of a structure (models/lag.h).
 *
 * A lag moves when its signal has a new value, from the time of the last one to that of this one,
 * as if the signal had gone straight between them. So a thermometer that is asked once a second,
 * or was silent for a while, costs nothing and loses nothing; while it is missing the lag stands
 * still, and is as old as what it follows. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_LAGS_H
#define COMPBOX_FIRMWARE_SIGNALS_LAGS_H

#include "firmware/signals/signals.h"

/* in : states of which those that are measured have been aged; since_us of this step's reading
 * out: the lags' value, time_us, known, fresh and used, each after the signal that it follows; the
 *      first value that a lag meets is its steady state. Those that went stale are counted.
 *      Result: true when every essential lag is fresh. */
bool cb_lags_follow(const struct cb_config *config, struct cb_signal_state *states,
                    struct cb_counters *counters, int64_t since_us);

#endif
