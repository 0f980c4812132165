/* SPDX-License-Identifier: MIT
 * Lags: signals that follow another one with the thermal memory of a structure (models/lag.h).
 *
 * A lag moves when its signal has a new value, over the time since the last one, as if the signal
 * had been linear in between. A thermometer that is polled once a second, or was silent for a
 * while, therefore loses nothing. While its signal is missing the lag does not move, and its age is
 * that of the signal. */
#ifndef COMPBOX_FIRMWARE_SIGNALS_LAGS_H
#define COMPBOX_FIRMWARE_SIGNALS_LAGS_H

#include "firmware/signals/signals.h"

/* in : elapsed_us != 0. out: the gains; 0 for a clock that runs backward: the lag stays */
struct cb_lag_gains cb_lag_gains_over(int64_t elapsed_us, float tau_s);

/* in : states whose measured signals have been aged; since_us of this step's reading
 * out: the lags' value, time_us, known, fresh and used, each after its signal; the first value of a
 *      lag is its steady state. Lags that went stale are counted. Result: true when every essential
 *      lag is fresh. */
bool cb_lags_follow(const struct cb_config *config, struct cb_signal_state *states,
                    struct cb_counters *counters, int64_t since_us);

#endif
