# SPDX-License-Identifier: MIT
"""Mutants (mutants.py) by somebody who knew the sources and docs, but neither the world nor its invariants: by how many
of them are found the net is judged (docs/results/mutants.md)."""

BOX, SIGNALS, LINUX = "firmware/box/", "firmware/signals/", "hal/linux/"
OUTPUT, DAEMON = LINUX + "files/", LINUX + "daemon/"

DEFECTS_BY_OTHERS = [
    ("other-last-pair-skipped", "The rule of pairs for moving outputs leaves out the last pair of the file",
     (BOX + "limiter.c",
      "                         float *output_um) {\n"
      "    for (unsigned i = 0; i < config->pairs_count; ++i) {",
      "                         float *output_um) {\n"
      "    for (unsigned i = 0; i + 1u < config->pairs_count; ++i) {")),
    ("other-ramp-at-slew", "The ramp rate is applied while the outputs stay instead of while they go to zero",
     (BOX + "box.c",
      ".ramp_um_per_s = aim == CB_AIM_ZERO ? box->config.ramp_um_per_s : 0.0f,",
      ".ramp_um_per_s = aim == CB_AIM_STAY ? box->config.ramp_um_per_s : 0.0f,")),
    ("other-went-back-kept", "After one restart of the PLC every later loss of contact starts the outputs at zero",
     (BOX + "box.c",
      "plc->confirmed = plc->went_back = false;",
      "plc->confirmed = false;")),
    ("other-only-active-at-work", "A box that was interrupted in HOLD, RAMP or FAULT starts again without permission",
     (BOX + "box.c",
      "return mode != CB_MODE_STANDBY && mode != CB_MODE_STOPPED;",
      "return mode == CB_MODE_ACTIVE;")),
    ("other-status-one-step-late",
     "The status register has the mode of the previous write beside the reason of this step",
     (BOX + "box.c",
      "out->registers[plc->status] = (uint16_t)(box->mode.mode | box->mode.reason << 8);",
      "out->registers[plc->status] = (uint16_t)(box->life.sent_mode | box->mode.reason << 8);")),
    ("other-unreferenced-no-loss", "An axis that loses its reference during ACTIVE is not a loss",
     (BOX + "mode.c",
      "state->lost = !healthy(e) || (e->enable && !e->referenced);",
      "state->lost = !healthy(e);")),
    ("other-first-beat-counts", "The first heartbeat after the start or a silence counts as a change",
     (BOX + "plc.c",
      "    if (!first && heartbeat != state->plc_heartbeat) {",
      "    (void)first;\n"
      "    if (heartbeat != state->plc_heartbeat) {")),
    ("other-quarter-lost", "The history of sent values loses the quarter before the current one",
     (BOX + "applied.c",
      "for (unsigned k = CB_SENT_SLOTS - 1; k > 0; --k) {",
      "for (unsigned k = CB_SENT_SLOTS - 1; k > 1; --k) {")),
    ("other-demand-cause-limit", "The cause of a demand fault is searched by limit_um",
     (BOX + "cause.c",
      "const float bound = kind == CB_CAUSE_DEMAND ? channel->error_um : channel->limit_um;",
      "const float bound = channel->limit_um;")),
    ("other-hold-zero-and", "The PLC is taken to hold zero if one end of the interval of its possible values is zero",
     (BOX + "channels.c",
      "if (channels[i].possible_min_um != 0.0f || channels[i].possible_max_um != 0.0f)",
      "if (channels[i].possible_min_um != 0.0f && channels[i].possible_max_um != 0.0f)")),
    ("other-refused-probe-taken",
     "A probe whose value was refused as implausible is taken with the value of the probe before",
     (BOX + "probes.c",
      "struct comparison all = {value->value, value->fresh && value->refusal == CB_CAUSE_NONE};",
      "struct comparison all = {value->value, value->fresh};")),
    ("other-lag-time-lost", "After a restart the lags continue with their value but without its time",
     (BOX + "state.c",
      "        box->signals[i].time_us = lag->time_us;\n",
      "")),
    ("other-counters-lost-on-reload", "A reload starts all counters at zero",
     (BOX + "adopt.c",
      "    fresh->counters = old->counters;\n",
      "")),
    ("other-ceiling-of-rate", "The site's ceiling of the rate is taken from its ceiling of the size",
     (BOX + "ceiling.c",
      "if (lower(&channel->slew_um_per_s, ceiling->um_per_s)) lowered = true;",
      "if (lower(&channel->slew_um_per_s, ceiling->um)) lowered = true;")),
    ("other-plain-rate-unchecked",
     "A PLC signal that was accepted in the reading before is accepted again however fast it changed",
     (SIGNALS + "signals.c",
      "    const float change = cb_abs(value - state->value);\n"
      "    if (!(value > signal->min && value < signal->max)) return false;\n"
      "    if (cb_signal_too_fast(signal, change, elapsed_s)) return false;\n",
      "    (void)elapsed_s;\n"
      "    if (!(value > signal->min && value < signal->max)) return false;\n")),
    ("other-unknown-is-recent", "A signal without a value is recent by its old time",
     (SIGNALS + "signals.h",
      "return state->known && now_us - state->time_us <= (int64_t)signal->max_age_ms * 1000;",
      "return now_us - state->time_us <= (int64_t)signal->max_age_ms * 1000;")),
    ("other-disagreement-adds-up", "The time of disagreement of a sensor is not reset when it agrees",
     (SIGNALS + "sensors.c",
      "                           : 0;\n",
      "                           : state->us[j];\n")),
    ("other-faded-not-degraded",
     "A term that fades because its signal is missing is not reported: the reason stays all is well",
     ("firmware/terms/terms.c",
      "    step->verdict.degraded = true;\n",
      "")),
    ("other-stale-curve-lives", "Plain curves are evaluated at the last value of a signal that is not fresh any more",
     ("firmware/terms/terms.c",
      "if (!signal->fresh || (!holds && !follow(config, grid, x, &states[grid->term].span))) {",
      "if (!holds && !follow(config, grid, x, &states[grid->term].span)) {")),
    ("other-margin-ignored",
     "A trained model is weakened from the end of its training range on instead of beyond the margin",
     ("models/training_range.c",
      "const float beyond = cb_max(above, below) - range->margin;",
      "const float beyond = cb_max(above, below);")),
    ("other-step-of-probe", "One probe may move a term by bias_max_um instead of step_max_um",
     ("models/adapt.c",
      "const float part = size > settings->step_max_um ? settings->step_max_um / size : 1.0f;",
      "const float part = size > settings->bias_max_um ? settings->bias_max_um / size : 1.0f;")),
    ("other-silence-no-doubt", "On a serial line a request without a reply raises no doubt",
     ("firmware/wire/rtu_dialog.c",
      "if (end == CB_RTU_END_RUBBISH || end == CB_RTU_END_SILENT || (refused && dialog->probed_twice))",
      "if (end == CB_RTU_END_RUBBISH || (refused && dialog->probed_twice))")),
    ("other-crc-unchecked", "The receiver of a serial line accepts a reply with a wrong check sum",
     ("firmware/wire/rtu_receiver.c",
      "if (wanted == 0 || !crc_fits(candidate, wanted)) continue;",
      "if (wanted == 0) continue;")),
    ("other-slew-raised", "A slew rate above what the control's largest step allows stays",
     ("firmware/load/control.c",
      "if (most > 0.0f && channel->slew_um_per_s > most) channel->slew_um_per_s = most;",
      "if (most > 0.0f && channel->slew_um_per_s < most) channel->slew_um_per_s = most;")),
    ("other-last-referenced-bit", "Of several referenced bits only the last one of the list must be set",
     ("firmware/load/plc.c",
      "*mask = (uint16_t)(*mask | 1u << bit);",
      "*mask = (uint16_t)(1u << bit);")),
    ("other-read-time-after", "The time of a reading is taken behind the PLC's reply instead of before the request",
     ("hal/cycle.c",
      "    cycle->in.read_ok = cycle->read == CB_TRANSFER_OK;\n"
      "    if (hal->handed) take_handed(cycle, hal, made_from_us);",
      "    cycle->in.read_us = now(hal);\n"
      "    cycle->in.read_ok = cycle->read == CB_TRANSFER_OK;\n"
      "    if (hal->handed) take_handed(cycle, hal, made_from_us);")),
    ("other-stale-write-result", "The result of an earlier cycle's write is not reset",
     ("hal/cycle.c",
      "    cycle->read = cycle->write = CB_TRANSFER_FAILED;\n"
      "    if (sound)",
      "    cycle->read = CB_TRANSFER_FAILED;\n"
      "    if (sound)")),
    ("other-tick-already-past",
     "After an overrun the loop waits for the tick that has just passed instead of the next one",
     (LINUX + "tick.c",
      "    return (now_ns - tick->start_ns) / tick->period_ns + 1;",
      "    return (now_ns - tick->start_ns) / tick->period_ns;")),
    ("other-can-socket-leak",
     "The CAN socket that a reload replaces is not returned to be closed: each reload leaks a descriptor",
     (LINUX + "can.c",
      "    if (replaces) __atomic_store_n(&can->returned, can->fd, __ATOMIC_RELEASE);\n",
      "")),
    ("other-can-nodes-kept", "A reload compares only the number of CANopen nodes",
     (LINUX + "can_source.c",
      "    const bool same = memcmp(&source->config, &config->can, sizeof config->can) == 0;",
      "    const bool same = source->config.nodes_count == config->can.nodes_count;")),
    ("other-bus-device-not-closed",
     "The thread of the slow bus ends without closing its device, whose lock then keeps "
     "the next thread from opening it after a reload",
     (LINUX + "bus.c",
      "    cb_serial_close(&bus->rtu.serial);\n"
      "    return NULL;",
      "    return NULL;")),
    ("other-bytes-of-old-connection",
     "The bytes of a reply that broke off with its connection stay in the buffer and are "
     "taken for the head of the first reply on the next connection",
     (LINUX + "tcp.c",
      "    tcp->failures_in_row = 0;\n"
      "    tcp->have = 0;",
      "    tcp->failures_in_row = 0;")),
    ("other-connect-timeout-unit", "The time for an attempt to connect is in the unit of milliseconds",
     (LINUX + "link.c",
      "    CONNECT_TIMEOUT_US = 1000000,",
      "    CONNECT_TIMEOUT_US = 1000,")),
    ("other-module-exception-is-reading", "A module's exception on the slow bus counts as a reading",
     (LINUX + "rtu.c",
      "        case CB_RTU_END_REPLY:\n"
      "            return CB_TRANSFER_OK;\n"
      "        case CB_RTU_END_REFUSED:\n"
      "            return CB_TRANSFER_REFUSED;",
      "        case CB_RTU_END_REPLY:\n"
      "        case CB_RTU_END_REFUSED:\n"
      "            return CB_TRANSFER_OK;")),
    ("other-damaged-key-is-no-key", "A folder of keys with one that cannot be read passes for a folder without keys",
     (LINUX + "enrolled.c",
      "    if (keys <= 0) return keys < 0 ? CB_ENROLLED_REFUSED : CB_ENROLLED_NONE;",
      "    if (keys <= 0) return CB_ENROLLED_NONE;")),
    ("other-write-start-by-reload", "A reload does not compare the first register of the write block",
     (DAEMON + "reload.c",
      "    if (a->write.start != b->write.start || a->write.count != b->write.count) return "
      "\"plc.write\";",
      "    if (a->write.count != b->write.count) return \"plc.write\";")),
    ("other-pending-not-reset",
     "A pending file that is withdrawn for another one stays pending in the statistics, "
     "also after that one was refused",
     (DAEMON + "reload.c",
      "    reload->offered = reload->pending = false;",
      "    reload->offered = false;")),
    ("other-no-step-is-smallest", "A channel without a largest step counts as one of step 0 in the comparison",
     (DAEMON + "widening.c",
      "    return channel->step_um > 0.0f ? channel->step_um : INFINITY;",
      "    return channel->step_um;")),
    ("other-at-rest-sticks", "Once a file had to wait for rest, each later one waits for it too, unreported",
     (DAEMON + "loop.c",
      "    loop->at_rest_only = at_rest_only;",
      "    loop->at_rest_only = loop->at_rest_only || at_rest_only;")),
    ("other-still-stopped-after-start",
     "The state file that is written at the start keeps the STOPPED of the previous run",
     (DAEMON + "main.c",
      "    daemon->state.stopped = false;\n",
      "")),
    ("other-files-time-from-request",
     "The time for the last files counts from the request to stop instead of from the loop's end",
     (DAEMON + "stop.c",
      "        *idle_us = now_us;\n"
      "        if (now_us >= give_up_us)",
      "        if (now_us >= give_up_us)")),
    ("other-other-signal-unreported",
     "When another signal fails in the same way as the one that was reported, neither the "
     "log nor the events have a line about it",
     (DAEMON + "log.c",
      "    return a->kind != b->kind || a->index != b->index;",
      "    return a->kind != b->kind;")),
    ("other-samples-of-old-file", "Samples from before a reload are not dropped",
     (LINUX + "sample_ring.h",
      "        if (from->generations[slot] == generation) samples[count++] = from->samples[slot];",
      "        (void)generation;\n"
      "        samples[count++] = from->samples[slot];")),
    ("other-state-not-synced", "The state file is renamed over the old one without fsync",
     (OUTPUT + "state.c",
      "    return cb_output_whole(path, &file, fill(&file, state, config, now), true);",
      "    return cb_output_whole(path, &file, fill(&file, state, config, now), false);")),
    ("other-second-event-cut", "A HOLD or FAULT during the file of an earlier event does not prolong it",
     (OUTPUT + "blackbox.c",
      "    if (box->word == NULL || word == requested) box->word = word;\n",
      "    if (box->word != NULL && word != requested) return;\n"
      "    box->word = word;\n")),
    ("other-events-end-unsynced", "The events file is closed at the end without a sync",
     (OUTPUT + "events.c",
      "    cb_events_sync(events, INT64_MAX);\n",
      "")),
    ("other-history-without-reasons",
     "The history of the statistics has an entry for another mode only, not for another "
     "reason in the same mode",
     (OUTPUT + "stats.c",
      "    if (stats->rows > 0 && row->mode == stats->last.mode && row->reason == stats->last.reason)\n"
      "        return;",
      "    if (stats->rows > 0 && row->mode == stats->last.mode) return;")),
    ("other-short-read-is-end", "A read that returns fewer bytes than asked for is taken for the end of the file",
     (LINUX + "whole_file.c",
      "        if (got == 0) break;\n"
      "        length += (size_t)got;",
      "        const size_t asked = size - length;\n"
      "        length += (size_t)got;\n"
      "        if ((size_t)got < asked) break;")),
    ("other-late-write-unit",
     "The time for which a write without a reply may still take effect counts the PLC's "
     "timeout in ms as µs",
     (BOX + "limiter.c",
      "(uint64_t)config->plc.heartbeat_timeout_ms * 1000u + 2u * (uint64_t)config->period_us;",
      "(uint64_t)config->plc.heartbeat_timeout_ms + 2u * (uint64_t)config->period_us;")),
    ("other-heartbeat-behind-silence", "The first heartbeat behind a long silence counts as a change",
     (BOX + "plc.c",
      "const bool first = !cb_plc_readable(config, state, in->read_us);",
      "const bool first = !state->readable;")),
    ("other-unapplied-never", "The time outside ends at the very bound that it has to exceed",
     (BOX + "applied.c",
      "const uint32_t most_us = 2 * config->applied_quarter_us;",
      "const uint32_t most_us = config->applied_quarter_us;")),
    ("other-probe-output-sign", "Without an applied value a probe adds the box's own output instead of removing it",
     (BOX + "probes.c",
      "return (struct comparison){value_um - um, outputs->known",
      "return (struct comparison){value_um + um, outputs->known")),
    ("other-bank-lag-index", "An input of a bank without a value does not skip its lags",
     (SIGNALS + "bank.c",
      "            if (signal->known) follow(state, lag, lagged(bank), &way, paces.gains);\n",
      "            if (!signal->known) continue;\n"
      "            follow(state, lag, lagged(bank), &way, paces.gains);\n")),
    ("other-degraded-ends", "DEGRADED ends as soon as the term that is missing has faded to zero",
     ("firmware/terms/terms.c",
      "    step->verdict.degraded = true;",
      "    step->verdict.degraded = step->verdict.degraded || output[0] != 0.0f;")),
    ("other-asks-for-ever", "A probe inside the gate does not end the request for another probe",
     ("models/adapt.c",
      "    state->pending = 0;\n"
      "    state->asked = 0;\n"
      "    return CB_ADAPT_TAKEN;",
      "    state->pending = 0;\n"
      "    return CB_ADAPT_TAKEN;")),
    ("other-doubted-sensor-counts", "A doubted sensor takes part in the next passes with its own reading",
     (SIGNALS + "sensors.c",
      "if (is_doubted(state, j) || !cb_signal_is_recent(&config->signals[index], signal, now_us))",
      "if (!cb_signal_is_recent(&config->signals[index], signal, now_us))")),
    ("other-bus-backoff", "A silent module's pause grows by one step too many, to twice its maximum",
     (SIGNALS + "bus_turns.c",
      "if (turn->silent < CB_BUS_BACKOFF_MAX) ++turn->silent;",
      "if (turn->silent <= CB_BUS_BACKOFF_MAX) ++turn->silent;")),
    ("other-adopt-bank-index",
     "A reload takes the last input of a bank from the new file's index, not from the old one's",
     (BOX + "adopt.c",
      "fresh->bank.value[i] = old->bank.value[k];",
      "fresh->bank.value[i] = old->bank.value[i];")),
    ("other-outlived-unit", "Outputs from before a suspend are still written by fc23",
     ("hal/cycle.c",
      "cycle->tick_us - cycle->step_at_us > clock_us(box);",
      "cycle->tick_us - cycle->step_at_us > clock_us(box) * 1000;")),
    ("other-file-not-synced", "A file that is replaced as a whole is renamed before its bytes are on the disk",
     (OUTPUT + "output_file.c",
      "    error = cb_output_close(fd, error, durable);",
      "    error = cb_output_close(fd, error, false);")),
    ("other-lag-time-of-old-boot", "A lag that goes on after a reboot has its time by the clock of the boot before",
     (OUTPUT + "state.c",
      "*time_us = to->now->boottime_us - pause_us;",
      "*time_us = record->boottime_us;")),
    ("other-boot-id-leak", "Each look at the boot's id leaves a descriptor open",
     (OUTPUT + "state.c",
      "    if (fd >= 0) close(fd);\n"
      "    const bool whole",
      "    const bool whole")),
    ("other-lost-rows-count", "A failed write of the record counts one lost row, however many were waiting",
     (OUTPUT + "record.c",
      "record->lost += record->waiting;",
      "record->lost++;")),
    ("other-blackbox-removes-newest", "For want of room the black box removes the newest file, not the oldest",
     (OUTPUT + "blackbox.c",
      "if (all->count == 0 || number < all->lowest) {",
      "if (all->count == 0 || number > all->lowest) {")),
    ("other-same-revision-refused", "A file with the running file's revision is refused as older",
     (DAEMON + "reload.c",
      "if (fresh->revision >= revision || reload->allow_older) return true;",
      "if (fresh->revision > revision || reload->allow_older) return true;")),
    ("other-hand-age-sign",
     "The age of a measurement by hand has the wrong sign: old ones are \"from the future\", "
     "future ones are taken",
     (LINUX + "hand.c",
      "const int64_t age_s = look->unix_s - line->unix_s;",
      "const int64_t age_s = line->unix_s - look->unix_s;")),
    ("other-can-overflow-base", "A new CAN socket keeps the old one's count of lost frames",
     (LINUX + "can.c",
      "    can->fd = fd;\n"
      "    can->lost_in_queue = 0;\n",
      "    can->fd = fd;\n")),
    ("other-ramp-forgets-loss",
     "An input that is missing during a ramp is no loss any more, so an enable that came meanwhile starts the "
     "box without permission.",
     (BOX + "mode.c",
      "    state->lost = state->lost || !healthy(e);\n",
      "")),
    ("other-heartbeat-wrap-is-restart",
     "A heartbeat that wraps around 65535 while contact is lost is taken for a PLC that has restarted, so the "
     "outputs begin at zero although the PLC holds others.",
     (BOX + "plc.c",
      "const bool behind = (uint16_t)(state->plc_heartbeat - heartbeat - 1) < 0x7FFF;",
      "const bool behind = heartbeat < state->plc_heartbeat;")),
    ("other-older-late-write-stale",
     "The first write without a reply leaves the lower end of the older late writes at its old value, so a "
     "positive output is held back as if the PLC might hold that.",
     (BOX + "limiter.c",
      "state->late_min_um = state->older_min_um = sent_um;",
      "state->late_min_um = sent_um;")),
    ("other-bank-time-by-new-index",
     "At a reload the time of a bank's input is taken by the index of the new file, so with another order of "
     "signals a thermal lag jumps to its steady state.",
     (BOX + "adopt.c",
      "fresh->bank.time_us[i] = old->bank.time_us[k];",
      "fresh->bank.time_us[i] = old->bank.time_us[i];")),
    ("other-foreign-after-lost-write",
     "A read-back is compared with the sent values also when the last write was not confirmed, so a lost write "
     "is reported as another client that writes.",
     (BOX + "box.c",
      "if (in->held != CB_TRANSFER_OK || in->last_write != CB_TRANSFER_OK) return;",
      "if (in->held != CB_TRANSFER_OK) return;")),
    ("other-lead-window-without-beats",
     "The window in which the PLC's beats are counted is not restarted while there are none, so after a stop of "
     "the PLC's program the measured lead is far too long.",
     (SIGNALS + "lead.c",
      "    if (state->beats > 0) {\n        const", "    if (state->beats == 0) return;\n    {\n        const"),
     (SIGNALS + "lead.c", "was_us > 0 && us > 2 * was_us ? 2 * was_us : us", "us"),
     (BOX + "box.c", "    if (box->plc.alive)\n        cb_lead_take", "    if (true)\n        cb_lead_take")),
    ("other-sensors-read-for-ever",
     "The set of sensors that read is not cleared at the start of a pass, so a doubted or silent one is not "
     "predicted and its old reading accuses the others.",
     (SIGNALS + "sensors.c",
      "    state->reads = 0;\n",
      "")),
    ("other-int16-le-sign",
     "A signed little-endian 16-bit number is decoded without its sign, so temperatures below zero are implausible.",
     ("firmware/wire/number.c",
      "            return signed_16(swap_bytes(r[0]));",
      "            return (float)swap_bytes(r[0]);")),
    ("other-run-without-write-not-stopped",
     "A run that wrote nothing does not keep the STOPPED of the run before, so the next start at a PLC that "
     "refuses the read-back needs permission.",
     (BOX + "state.c",
      "return box->life.wrote ? box->life.stop_confirmed : box->life.stopped_before;",
      "return box->life.stop_confirmed;")),
    ("other-slope-stays-in-hold",
     "In HOLD the slope of a tangent stays too, so the offset still moves with the axis during an outage.",
     (BOX + "channels.c",
      "target_um[i] = config->channels[i].is_slope ? 0.0f : channels[i].output_um;",
      "target_um[i] = channels[i].output_um;")),
    ("other-probe-hours-are-minutes",
     "The time between probes is handed over in minutes where hours are expected, so the uncertainty of an "
     "adapted term grows sixty times too fast.",
     (BOX + "probes.c",
      "cb_adapt_wait(settings, &probe->filter, cb_seconds(us) / 3600.0f);",
      "cb_adapt_wait(settings, &probe->filter, cb_seconds(us) / 60.0f);")),
    ("other-lag-ramp-branches-swapped",
     "The two formulas of a lag's ramp gain are swapped, so after an outage of several time constants the "
     "truncated series diverges and the lag is far off.",
     ("models/lag.c",
      "gains.ramp = h <= 1.0f ? ramp_series(h) : 1.0f - gains.gain / h;",
      "gains.ramp = h > 1.0f ? ramp_series(h) : 1.0f - gains.gain / h;")),
    ("other-even-power-through-zero",
     "The range of an even power ignores that the signal passes through zero, so a squared lag near zero is held "
     "at the square of the nearer end.",
     ("models/power.h",
      "    const bool through_zero = min < 0.0f && max > 0.0f;\n"
      "    return (struct cb_interval){through_zero ? 0.0f : cb_min(a, b), cb_max(a, b)};",
      "    return (struct cb_interval){cb_min(a, b), cb_max(a, b)};")),
    ("other-chain-misses-last-axis",
     "The last axis of a kinematic chain is missing in the levers of the axes that carry the workpiece.",
     ("models/volumetric.c",
      "for (unsigned j = from; j < CB_AXES + 1; ++j) {",
      "for (unsigned j = from; j < CB_AXES; ++j) {")),
    ("other-outlier-stays-pending",
     "A good probe does not drop the pending outlier, so a much later outlier that agrees with it is taken at once.",
     ("models/adapt.c",
      "    state->pending = 0;\n"
      "    state->asked = 0;\n"
      "    return CB_ADAPT_TAKEN;",
      "    state->asked = 0;\n"
      "    return CB_ADAPT_TAKEN;")),
    ("other-dot-misses-last",
     "A scalar product whose length is no multiple of four misses its last number, so the linear path of a "
     "network loses its last input.",
     ("models/bpnet_layers.h",
      "    float sum = (s[0] + s[1]) + (s[2] + s[3]);\n"
      "    for (; i < count; ++i) sum += w[i] * v[i];",
      "    float sum = (s[0] + s[1]) + (s[2] + s[3]);\n"
      "    for (; i + 1 < count; ++i) sum += w[i] * v[i];")),
    ("other-reload-widens-error",
     "A reload that only raises error_um is not seen as wider, so it is taken at once while the machine is "
     "compensated.",
     (DAEMON + "widening.c",
      "                                   {\"error_um\", was->error_um, is->error_um},\n",
      "")),
    ("other-reload-keeps-lowered",
     "After a reload the statistics still name the channels that the site's ceiling lowered in the file before.",
     (DAEMON + "reload.c",
      "    reload->lowered = reload->loaded.lowered;\n",
      "")),
    ("other-can-active-again-unseen",
     "A CAN controller that restarts by itself and only reports that it is active stays bus-off, so its nodes "
     "get no start command and never send.",
     (LINUX + "can.c",
      "if (frame->can_id & CAN_ERR_RESTARTED || controller & CAN_ERR_CRTL_ACTIVE) come_up(can);",
      "if (frame->can_id & CAN_ERR_RESTARTED) come_up(can);")),
    ("other-tcp-proven-by-old-connection",
     "The replies of a closed connection still count for the next one, so a PLC that answers only readings is "
     "reconnected again and again without a pause.",
     (LINUX + "tcp.c",
      "tcp->awaiting = tcp->read_answered = tcp->write_answered = false;",
      "tcp->awaiting = false;")),
    ("other-rtu-probe-not-awaited-again",
     "After a late reply that comes before that of the probe the receiver does not wait for the probe's reply "
     "any more, so the exchange is lost too.",
     (LINUX + "rtu.c",
      "            cb_rtu_receiver_expect(&rtu->receiver, rtu->unit, cb_rtu_probe(&rtu->dialog), now_us);\n",
      "")),
    ("other-bus-generation-cleared",
     "The generation of the file is set before the struct of the sensor bus is cleared, so all its samples are "
     "dropped after the first reload.",
     (LINUX + "bus.c",
      "    memset(bus, 0, sizeof *bus);\n"
      "    if (config->buses_count == 0) return 0;\n"
      "    bus->config = config;\n"
      "    bus->generation = generation;\n",
      "    bus->generation = generation;\n"
      "    memset(bus, 0, sizeof *bus);\n"
      "    if (config->buses_count == 0) return 0;\n"
      "    bus->config = config;\n")),
    ("other-record-not-repositioned",
     "After a failed write the record is cut, but the file position stays behind the cut, so the next rows "
     "follow a gap of zero bytes.",
     (OUTPUT + "record.c",
      "lseek(record->fd, record->whole_size, SEEK_SET) < 0;", "lseek(record->fd, 0, SEEK_CUR) < 0;")),
    ("other-hold-ignores-withdrawal",
     "In HOLD a withdrawn enable is not noticed: the outputs stay until the hold time is over.",
     (BOX + "mode.c",
      "const bool leave = e->stop || withdrawn(e) || state->hold_us >= max_hold_us;",
      "const bool leave = e->stop || state->hold_us >= max_hold_us;")),
    ("other-pair-waits-with-wrong-states",
     "When the second channel of a pair is the upper one, the rule of pairs takes the last outputs of the two "
     "channels the wrong way round and drags the slower one along.",
     (BOX + "limiter.c",
      "wait_for_other(b_unit_um, a_unit_um, most, b, a, b_um, a_um);",
      "wait_for_other(b_unit_um, a_unit_um, most, a, b, b_um, a_um);")),
    ("other-stop-time-by-faster-rate",
     "The longest time of a stop is computed with the faster of slew and ramp, so a slow ramp is cut off before "
     "zero.",
     (BOX + "box.c",
      "return channel->is_slope ? slew - lost : cb_min(slew - lost, config->ramp_um_per_s);",
      "return channel->is_slope ? slew - lost : cb_max(slew - lost, config->ramp_um_per_s);")),
    ("other-memory-pass-never-compared",
     "The slow pass over the whole configuration never ends (off by one), so a change of the pool in memory is "
     "not detected.",
     (BOX + "check.c",
      "if (box->words_checked < CHECK_WORDS) return true;",
      "if (box->words_checked <= CHECK_WORDS) return true;")),
    ("other-ceiling-size-or-rate",
     "Where the site's ceiling lowers the size of a channel, it no longer lowers its rate (short circuit).",
     (BOX + "ceiling.c",
      "    bool lowered = lower(&channel->limit_um, ceiling->um);\n"
      "    if (lower(&channel->slew_um_per_s, ceiling->um_per_s)) lowered = true;\n",
      "    bool lowered = lower(&channel->limit_um, ceiling->um) ||\n"
      "                   lower(&channel->slew_um_per_s, ceiling->um_per_s);\n")),
    ("other-refused-value-refreshes-age",
     "The time of a value is taken before the check of its rate, so a signal whose values are refused as too "
     "fast stays fresh with its old value.",
     (SIGNALS + "signals.c",
      "    const float change = value - state->value;\n"
      "    if (state->known) {\n",
      "    const float change = value - state->value;\n"
      "    state->time_us = time_us;\n"
      "    if (state->known) {\n")),
    ("other-doubted-sensor-keeps-streak",
     "A doubted PLC signal keeps its streak, so the quick path accepts it and it remains fresh.",
     (SIGNALS + "sensors.c",
      "        signal->streak = 0;\n",
      "")),
    ("other-banks-remember-too-early",
     "Each bank remembers its inputs at once, so the lags of a second bank with the same input do not move.",
     (SIGNALS + "bank.c",
      "    for (unsigned b = 0; b < config->banks_count; ++b)\n"
      "        follow_bank(config, &config->banks[b], signals, state);\n"
      "    for (unsigned b = 0; b < config->banks_count; ++b)\n"
      "        remember(config, &config->banks[b], signals, state);\n",
      "    for (unsigned b = 0; b < config->banks_count; ++b) {\n"
      "        follow_bank(config, &config->banks[b], signals, state);\n"
      "        remember(config, &config->banks[b], signals, state);\n"
      "    }\n")),
    ("other-volumetric-takes-faded-errors",
     "A term that fades does not end `all_live`, so the volumetric term goes on computing with errors that are "
     "missing.",
     ("firmware/terms/terms.c",
      "    step->e.all_live = false;\n",
      "")),
    ("other-int32-cdab-unsigned",
     "An int32 in the order CDAB is decoded without its sign: negative positions and read-backs are huge.",
     ("firmware/wire/number.c",
      "return signed_32(wide(r[1], r[0]));",
      "return (float)wide(r[1], r[0]);")),
    ("other-reload-drops-adapted-values",
     "After a reload an adapted term begins again at bias and gain 0 and moves to its targets at the ramp.",
     (BOX + "adopt.c",
      "    fresh->terms[index].adapted = old->terms[was].adapted;\n",
      "")),
    ("other-suspend-writes-old-outputs",
     "With fc23 the first request after a suspend writes the outputs from before it.",
     ("hal/cycle.c",
      "/* out: the last step is so long ago that the next one takes all its inputs as stale: mode and\n"
      " * outputs that it computed are not written any more */\n"
      "static bool outlived(const struct cb_cycle *cycle, const struct cb_box *box) {\n"
      "    return cycle->tick_us - cycle->step_at_us > clock_us(box);\n"
      "}\n"
      "\n",
      ""),
     ("hal/cycle.c",
      "const bool combined = has_outputs && !outlived(cycle, box);",
      "const bool combined = has_outputs;")),
    ("other-lag-holds-old-input",
     "Over a gap longer than its time constant a lag follows the old input alone, as if the new one had not been "
     "approached.",
     ("models/lag.c",
      "if (h > 0.0f) gains.ramp = h <= 1.0f ? ramp_series(h) : 1.0f - gains.gain / h;",
      "if (h > 0.0f && h <= 1.0f) gains.ramp = ramp_series(h);")),
    ("other-curve-extrapolates",
     "Beyond its ends a piecewise curve is extrapolated by its last piece instead of held.",
     ("models/ppoly.c",
      "return (struct cb_curve_value){cb_ppoly_value_in(curve, inside, here), 0.0f, inside != x};",
      "return (struct cb_curve_value){cb_ppoly_value_in(curve, x, here), 0.0f, inside != x};")),
    ("other-tcp-failures-never-forgiven",
     "A valid reply does not reset the failures in a row, so every third lost reply drops the connection.",
     (LINUX + "tcp.c",
      "    tcp->counters.replies++;\n"
      "    tcp->failures_in_row = 0;\n",
      "    tcp->counters.replies++;\n")),
    ("other-connect-without-timeout",
     "An attempt to connect that gets no answer is never given up by the box.",
     (LINUX + "link.c",
      "    if (poll(&wait, 1, 0) <= 0) {\n"
      "        if (now_us - link->since_us > CONNECT_TIMEOUT_US) attempt_failed(link, ETIMEDOUT, now_us);\n"
      "        return;\n"
      "    }\n",
      "    if (poll(&wait, 1, 0) <= 0) return;\n")),
    ("other-resumed-lag-skips-pause",
     "After a restart the resumed lags count as followed until now, so the pause is left out.",
     (OUTPUT + "state.c",
      "    *time_us = to->now->boottime_us - pause_us;\n",
      "    *time_us = to->now->boottime_us;\n")),
    ("other-state-never-stopped",
     "The last state is taken after its mark for STOPPED was set, which clears the mark: no run ends STOPPED by "
     "the state file.",
     (DAEMON + "main.c",
      "    cb_state_take(&daemon->state, daemon->loop.box);\n"
      "    daemon->state.stopped = cb_state_ended_stopped(daemon->loop.box);\n",
      "    daemon->state.stopped = cb_state_ended_stopped(daemon->loop.box);\n"
      "    cb_state_take(&daemon->state, daemon->loop.box);\n")),
    ("other-widening-misses-slopes",
     "A reload that widens the limit or the rate of a slope is taken at work, because only the channels are "
     "compared.",
     (DAEMON + "widening.c",
      "for (unsigned i = 0; i < cb_all_channels(fresh); i++)",
      "for (unsigned i = 0; i < fresh->channels_count; i++)")),
    ("other-can-return-not-noticed",
     "When the CAN bus is back, CANopen nodes are not told to start again.",
     (LINUX + "can.c",
      "    can->state = CB_CAN_UP;\n"
      "    can->is_back = true;\n",
      "    can->state = CB_CAN_UP;\n")),
    ("other-limiter-wrong-end-of-interval",
     "A falling output is bounded by the lowest instead of the highest value that the PLC may hold.",
     (BOX + "limiter.c",
      "state->possible_max_um - reach_um);",
      "state->possible_min_um - reach_um);")),
    ("other-applied-beyond-never-reset",
     "Readings of a foreign applied value need not be successive for fault 21, and its cause is never gone.",
     (BOX + "applied.c",
      "    if (bounded || inside)\n"
      "        state->beyond = 0;\n"
      "    else if (state->beyond < CB_BEYOND_READINGS)\n",
      "    if (!bounded && !inside && state->beyond < CB_BEYOND_READINGS)\n")),
    ("other-box-restart-of-plc-ignored",
     "After the PLC has restarted, outputs go on from the old value of its register instead of zero.",
     (BOX + "box.c",
      "in->held == CB_TRANSFER_OK && !box->plc.went_back && cb_is_finite(held_um)",
      "in->held == CB_TRANSFER_OK && cb_is_finite(held_um)")),
    ("other-adopt-bank-time-forgotten",
     "A reload forgets when the input of a bank's lags was last seen, so the lags jump to their steady state.",
     (BOX + "adopt.c",
      "        fresh->bank.time_us[i] = old->bank.time_us[k];\n",
      "")),
    ("other-channels-zero-by-upper-end-only",
     "Zero counts as confirmed while a late write of a negative value may still take effect.",
     (BOX + "channels.c",
      "        if (channels[i].possible_min_um != 0.0f || channels[i].possible_max_um != 0.0f)\n"
      "            return false;\n",
      "        if (channels[i].possible_max_um != 0.0f) return false;\n")),
    ("other-state-bias-without-target",
     "After a restart the bias of an adapted term is restored, but not its target, so it fades to zero.",
     (BOX + "state.c",
      "adapted->bias_um = adapted->to_bias_um = box->probes[i].filter.bias_um;",
      "adapted->bias_um = box->probes[i].filter.bias_um;")),
    ("other-signals-refusal-kept",
     "A signal that was refused once stays marked as refused after good values.",
     (SIGNALS + "signals.c",
      "    state->time_us = time_us;\n"
      "    state->refusal = CB_CAUSE_NONE;\n",
      "    state->time_us = time_us;\n")),
    ("other-lags-time-set-before-difference",
     "The slow path of a lag stores the new time before it takes the difference, so the lag does not move.",
     (SIGNALS + "lags.c",
      "    const int64_t elapsed_us = signal->time_us - state->time_us;\n"
      "    state->time_us = signal->time_us;\n",
      "    state->time_us = signal->time_us;\n"
      "    const int64_t elapsed_us = signal->time_us - state->time_us;\n")),
    ("other-linear-missing-input-skipped",
     "A linear term leaves a missing input out of its sum instead of fading.",
     ("firmware/terms/linear.c",
      "        if (!signal->fresh) return CB_TERM_MISSING;\n",
      "        if (!signal->fresh) continue;\n")),
    ("other-profile-quarter-is-whole",
     "The quarter of the window of sent values is the whole window, so a foreign applied value is reported late.",
     ("firmware/config/profile.c",
      "    return cb_profile_step_window_us(config) / 4;\n",
      "    return cb_profile_step_window_us(config);\n")),
    ("other-modbus-echo-of-other-register",
     "A reply to a write is accepted although it names another start register.",
     ("firmware/wire/modbus.c",
      "    return length == 5 && get_u16(pdu + 1) == request->write_start &&\n"
      "           get_u16(pdu + 3) == request->write_count;\n",
      "    return length == 5 && get_u16(pdu + 3) == request->write_count;\n")),
    ("other-link-backoff-without-end",
     "The pause between attempts to connect doubles without its upper bound.",
     (LINUX + "link.c",
      "    link->backoff_us = doubled > MAX_BACKOFF_US ? MAX_BACKOFF_US : doubled;\n",
      "    link->backoff_us = doubled;\n"),
     (LINUX + "link.c",
      "    MAX_BACKOFF_US = 1000000,\n",
      "")),
    ("other-can-no-other-socket",
     "After a CAN adapter disappeared its socket is returned, but no other one is requested.",
     (LINUX + "can.c",
      "    cb_can_revoke(can); /* the kernel reports this once */\n"
      "    (void)obey_revocation(can);\n",
      "    cb_can_leave(can);\n")),
    ("other-events-size-not-counted",
     "The file of events does not count its own lines, so it never rotates and a full disk cuts off good lines.",
     (OUTPUT + "events.c",
      "        events->bytes += (int64_t)bytes;\n",
      "")),
    ("other-loop-pending-taken-at-work",
     "A pending file that widens limits is taken while the box is not at rest.",
     (DAEMON + "loop.c",
      "    const bool may = !loop->at_rest_only || cb_box_at_rest(loop->box);\n"
      "    const bool taken = may && cb_box_adopt(spare, loop->box);\n",
      "    const bool taken = cb_box_adopt(spare, loop->box);\n")),
    ("other-main-exit-in-spite-of-lost-rows",
     "The exit code is 0 although the record could not be written.",
     (DAEMON + "main.c",
      "    const bool complete = cb_row_files_finish(&daemon->files, now_us);\n",
      "    cb_row_files_finish(&daemon->files, now_us);\n"),
     (DAEMON + "main.c",
      "    const bool written = complete && stats_error == 0;\n",
      "    const bool written = stats_error == 0;\n")),
    ("other-reload-reads-while-written",
     "A changed coefficient file is read at the first look, without waiting until it stops changing.",
     (DAEMON + "reload.c",
      "    const bool stays = is_same_look(&now, &reload->seen);\n",
      ""),
     (DAEMON + "reload.c",
      "    return stays && !is_same_look(&now, &reload->known);\n",
      "    return !is_same_look(&now, &reload->known);\n")),
    ("other-adapt-foreign-place",
     "After a reload or restart with another model, the place of the old model's last probe is compared "
     "with the new model's place instead of taking the new model's whole variance",
     ("models/adapt.c",
      "    if (own->model != state->model)\n"
      "        return cb_max",
      "    if (state->model == 0)\n"
      "        return cb_max")),
    ("other-adapt-pending-age",
     "The age of a pending probe never grows, so the drift between it and its repetition is not allowed "
     "for and repetitions after a while count as disagreeing",
     ("models/adapt.c",
      "    if (state->since_h < FLT_MAX) state->since_h += h;\n"
      "    state->pending_h += h;\n",
      "    if (state->since_h < FLT_MAX) state->since_h += h;\n")),
    ("other-adapt-cusum-unclamped",
     "A normalised innovation enters the drift sums without its bound of 3, so one confirmed change of the "
     "machine raises the alarm that the model no longer fits",
     ("models/adapt.c",
      "    const float x = cb_clamp(innovation_um / state->expected_um, -3.0f, 3.0f);",
      "    const float x = innovation_um / state->expected_um;")),
    ("other-direction-start-forward",
     "At the start the unknown direction of travel counts as forward at once, instead of the mean of both "
     "branches",
     ("models/direction.c",
      "    direction->extreme = x + 0.5f * width;",
      "    direction->extreme = x - 0.5f * width;")),
    ("other-lag-long-step-held",
     "For a step longer than the time constant (a thermometer that was silent) the lag takes the input as "
     "held at its new value all the time, not as linear in between",
     ("models/lag.c",
      "ramp_series(h) : 1.0f - gains.gain / h;",
      "ramp_series(h) : gains.gain;")),
    ("other-sigma-floor-unit",
     "The variance of a model at a state adds the floor in um instead of its square",
     ("models/sigma.h",
      "    return at->floor_um * at->floor_um +",
      "    return at->floor_um +")),
    ("other-volumetric-own-axis",
     "For an axis that carries the workpiece its own position does not add to its lever",
     ("models/volumetric.c",
      "    const unsigned from = i < f ? i : i + 1;",
      "    const unsigned from = i + 1;")),
    ("other-adopt-direction-unknown",
     "A reload copies the direction of travel of a curve with branches but not that it is known, so the "
     "output goes to the mean of both branches",
     (BOX + "adopt.c",
      "    fresh->terms[index].directed = true;\n",
      "")),
    ("other-limiter-older-turn",
     "At the end of a turn the late writes are not kept as those of the older turn: they are forgotten at "
     "once, and the first one holds the output for as long as replies are lost",
     (BOX + "limiter.c",
      "    state->older_min_um = state->late_min_um;\n"
      "    state->older_max_um = state->late_max_um;\n",
      "")),
    ("other-probe-before-time",
     "A probe is judged before the time since the last one has passed for its filter, so the interval and "
     "the growth of the covariance count only for the next one",
     (BOX + "probes.c",
      "        if (first || measured) pass_time(&adapt->settings, probe, now_us);\n"
      "        if (measured) take(config, term, signals, outputs, states, probe, counters);",
      "        if (measured) take(config, term, signals, outputs, states, probe, counters);\n"
      "        if (first || measured) pass_time(&adapt->settings, probe, now_us);")),
    ("other-ceiling-short-circuit",
     "Where the site's ceiling lowers a channel's limit it no longer lowers its rate",
     (BOX + "ceiling.c",
      "    if (lower(&channel->slew_um_per_s, ceiling->um_per_s)) lowered = true;",
      "    lowered = lowered || lower(&channel->slew_um_per_s, ceiling->um_per_s);")),
    ("other-bank-skips-unknown",
     "An input of a bank without a value yet is skipped with its lags' places, so the inputs behind it "
     "move the wrong lags until it has one",
     (SIGNALS + "bank.c",
      "        if (signal->known) take_pace(config, bank, elapsed_us, &paces);",
      "        if (!signal->known) continue;\n"
      "        take_pace(config, bank, elapsed_us, &paces);")),
    ("other-canopen-start-unwatched",
     "A node whose heartbeat is not watched, and which only sent its boot-up message, gets the start "
     "command every second for ever",
     (SIGNALS + "canopen.c",
      "    return watched && !runs && node->state != CB_CANOPEN_UNKNOWN;",
      "    return !runs && node->state != CB_CANOPEN_UNKNOWN;")),
    ("other-sensors-third",
     "One sensor fewer than a third of all may be doubted where the number is a multiple of three: of "
     "three sensors none",
     (SIGNALS + "sensors.c",
      "    if (!wrong || 3u * (doubts(state) + 1u) > count) return;",
      "    if (!wrong || 3u * (doubts(state) + 1u) >= count) return;")),
    ("other-rtu-reserve-swapped",
     "On a serial line repeated writes leave time for another write and repeated reads leave none, so on a "
     "disturbed line the write has no time left",
     ("firmware/wire/rtu_dialog.c",
      "deadline_us - (reads ? (int64_t)dialog->manners.reserve_us : 0);",
      "deadline_us - (reads ? 0 : (int64_t)dialog->manners.reserve_us);")),
    ("other-slope-sign",
     "The slope of a channel does not take over the channel's sign, so on an axis with sign -1 it points "
     "the wrong way",
     ("firmware/load/tangent.c",
      "    slope->sign = channel->sign;\n",
      "")),
    ("other-check-links",
     "The check of each step omits the list of the terms' inputs, so a changed index is used until the "
     "slow pass over the whole configuration finds it",
     (BOX + "check.c",
      "    sum = add(sum, config->links, config->links_count);\n",
      "")),
    ("other-fc23-exchange-from-itself",
     "With fc23 the time of an exchange is measured from the reading of the same request, not from the one "
     "behind the outputs, so a measured lead is a period too short",
     ("hal/cycle.c",
      "    const int64_t made_from_us = cycle->in.read_ok ? cycle->in.read_us : 0;\n"
      "    const struct cb_block_config *read = &exchange->plc->read, *write = &exchange->plc->write;\n"
      "    cycle->in.read_us = now(hal);",
      "    cycle->in.read_us = now(hal);\n"
      "    const int64_t made_from_us = cycle->in.read_ok ? cycle->in.read_us : 0;\n"
      "    const struct cb_block_config *read = &exchange->plc->read, *write = &exchange->plc->write;")),
    ("other-can-watch-only-up",
     "While the CAN bus is down or off the heartbeats of its nodes are not watched, so silent nodes stay "
     "operational in log and files",
     (LINUX + "can_source.c",
      "    cb_canopen_watch(&source->config, source->nodes, now_us);\n"
      "    if (source->can.state != CB_CAN_UP) return;",
      "    if (source->can.state != CB_CAN_UP) return;\n"
      "    cb_canopen_watch(&source->config, source->nodes, now_us);")),
    ("other-hand-group-writable",
     "A file of measurements by hand that users of its group can write is accepted",
     (LINUX + "hand.c",
      "    if (file->st_mode & (S_IWGRP | S_IWOTH)) return",
      "    if (file->st_mode & S_IWOTH) return")),
    ("other-keys-damaged-passed-over",
     "A damaged or unreadable key in the folder is passed over, so with it as the only one the box takes "
     "unsigned files",
     (LINUX + "enrolled.c",
      "        if (!ask(path, question, &answer, message)) answer.keys = -1;",
      "        (void)ask(path, question, &answer, message);")),
    ("other-link-attempt-time",
     "The time limit of an attempt to connect counts from the begin of the pause before it, so behind the "
     "longest pause an attempt ends at once",
     (LINUX + "link.c",
      "    link->state = CB_LINK_CONNECTING;\n"
      "    link->since_us = now_us;\n",
      "    link->state = CB_LINK_CONNECTING;\n")),
    ("other-tcp-proven-by-one",
     "A connection counts as proven when reads or writes are answered, so a PLC that answers only one of "
     "them is reconnected again and again without a pause",
     (LINUX + "tcp.c",
      "    if (tcp->read_answered && tcp->write_answered) cb_link_proven",
      "    if (tcp->read_answered || tcp->write_answered) cb_link_proven")),
    ("other-events-behind-stderr",
     "A line is added to the events only behind the check that stderr takes one, so a reader of the log "
     "that has stopped stops the events too",
     (DAEMON + "log.c",
      "    cb_events_add(log->events, words[kind], text, kind == CB_LOG_MODE ? log->row : NULL);\n"
      "    if (!cb_stderr_is_ready()) {\n"
      "        log->limits[kind].left_out++;\n"
      "        return;\n"
      "    }\n",
      "    if (!cb_stderr_is_ready()) {\n"
      "        log->limits[kind].left_out++;\n"
      "        return;\n"
      "    }\n"
      "    cb_events_add(log->events, words[kind], text, kind == CB_LOG_MODE ? log->row : NULL);\n")),
    ("other-row-last-write",
     "The row of a cycle has the result of the write behind its step, not that of the write before, which "
     "the step had as input: the recording of inputs cannot be replayed",
     (DAEMON + "loop.c",
      "    row->in.last_write = cycle->step_last_write;\n",
      "")),
    ("other-events-file-stays",
     "Behind a reload every later event has the facts of that coefficient file and who brought it",
     (DAEMON + "main.c",
      "    cb_log_limited(&daemon->log, CB_LOG_FILES, now_us, \"%s%s\", daemon->reload.last, rest);\n"
      "    daemon->files.events.file = NULL;\n",
      "    cb_log_limited(&daemon->log, CB_LOG_FILES, now_us, \"%s%s\", daemon->reload.last, rest);\n")),
    ("other-ready-before-cycle",
     "READY is sent to systemd before the loop has completed its first cycle",
     (DAEMON + "supervise.c",
      "    if (steps == 0) return;\n",
      "")),
    ("other-archive-trim-order",
     "The size of an old record is asked after it was removed, so once the limit is reached all old "
     "records but the newest are removed",
     (OUTPUT + "archive.c",
      "        bytes = cb_rotate_bytes(archive->path, last);\n"
      "        if (bytes < 0 || cb_rotate_remove(archive->path, last) != 0) return;",
      "        if (cb_rotate_remove(archive->path, last) != 0) return;\n"
      "        bytes = cb_rotate_bytes(archive->path, last);")),
    ("other-record-old-wall-clock",
     "The record keeps the wall clock's distance of the start, so unix_s stays wrong when the clock is set "
     "later",
     (OUTPUT + "record.c",
      "    record->wall_us = cb_unix_us() - cb_boottime_us();\n"
      "    if (record->fd < 0 || record->used == 0) return;",
      "    if (record->fd < 0 || record->used == 0) return;")),
    ("other-history-not-rolled",
     "After 256 changes of mode or reason the history of the statistics begins at the array's start "
     "instead of at its oldest entry, so its order is wrong",
     (OUTPUT + "stats_json.c",
      "    for (uint32_t i = left_out; i < stats->changes; i++) {\n"
      "        const struct cb_stats_change *change = &stats->history[i % CB_STATS_HISTORY];",
      "    for (uint32_t i = 0; i < stats->changes - left_out; i++) {\n"
      "        const struct cb_stats_change *change = &stats->history[i];")),
    ("other-snapshot-age-at-tick",
     "The snapshot computes the age of a signal at the wake-up before its reading, so signals of the PLC "
     "have negative ages",
     (OUTPUT + "snapshot.c",
      "1e-3 * (double)(row->step_at_us - signal->time_us)",
      "1e-3 * (double)(row->time_us - signal->time_us)")),
    ("other-lag-remainder-lost",
     "The part of a lag below float32's resolution is dropped in each step: lags of hours stop moving as "
     "soon as some tenths of a degree remain, so the thermal compensation stays wrong for hours",
     ("models/lag.h",
      "    lag->lo = error - (lag->hi - sum);",
      "    lag->lo = 0.0f;")),
    ("other-cold-side-not-faded",
     "A model input below its training range and margin no longer weakens the model, only one above it "
     "does: a thermometer that lies far too low leaves the model at full weight, and the mode is not "
     "DEGRADED",
     ("models/training_range.c",
      "    const float beyond = cb_max(above, below) - range->margin;",
      "    const float beyond = above - range->margin;")),
    ("other-cusum-below-sign",
     "The sum of innovations to the negative side adds the positive ones instead: a model whose probes are "
     "always below the prediction never raises MODEL_DRIFTED",
     ("models/adapt.c",
      "    state->below = cb_clamp(state->below - x - slack, 0.0f, most);",
      "    state->below = cb_clamp(state->below + x - slack, 0.0f, most);")),
    ("other-quarter-keeps-old-extremes",
     "A new quarter of sent values does not begin with the value sent last, so the range of accepted "
     "applied values only grows: a PLC that is stuck at a value of long ago is never reported as UNAPPLIED "
     "or FOREIGN",
     (BOX + "applied.c",
      "        state->sent_max_um[k] = state->sent_max_um[k - 1];\n"
      "    }\n"
      "    state->sent_min_um[0] = state->sent_max_um[0] = sent_um;\n"
      "}",
      "        state->sent_max_um[k] = state->sent_max_um[k - 1];\n"
      "    }\n"
      "    (void)sent_um;\n"
      "}")),
    ("other-unread-not-successive",
     "A read-back that succeeds does not reset the count of those without a reply: after three lost ones "
     "in the whole run the box never reads back again, and another client that writes is not noticed",
     (BOX + "box.c",
      "    plc->unread = in->held == CB_TRANSFER_OK ? 0 : (uint8_t)(plc->unread + 1);",
      "    if (in->held != CB_TRANSFER_OK && plc->unread < UINT8_MAX) ++plc->unread;")),
    ("other-late-values-pile-up",
     "At the end of a turn the late writes are not emptied: while replies are lost again and again, every "
     "value ever sent without a reply stays possible, and the outputs freeze between them instead of "
     "following",
     (BOX + "limiter.c",
      "    state->older_max_um = state->late_max_um;\n"
      "    state->late_min_um = FLT_MAX;\n"
      "    state->late_max_um = -FLT_MAX;\n"
      "    state->turn_us = turn_us;",
      "    state->older_max_um = state->late_max_um;\n"
      "    state->turn_us = turn_us;")),
    ("other-count-reference-kept",
     "The last count of a probe stays the reference while its signal is missing: after a restart of the "
     "PLC its count begins at zero, and that difference is taken as a measurement that nobody made",
     (BOX + "probes.c",
      "    if (!count->fresh || count->refusal != CB_CAUSE_NONE) {\n"
      "        probe->counted = false;\n"
      "        return false;\n"
      "    }",
      "    if (!count->fresh || count->refusal != CB_CAUSE_NONE) return false;")),
    ("other-doubts-cascade",
     "When one sensor is doubted, the times of disagreement of the others, which it caused, are not "
     "started anew: in the next pass an innocent sensor is doubted too",
     (SIGNALS + "sensors.c",
      "    if (!wrong || 3u * (doubts(state) + 1u) > count) return;\n"
      "    for (unsigned j = 0; j < count; ++j) {\n"
      "        if (!is_doubted(state, j)) state->us[j] = 0;\n"
      "    }\n",
      "    if (!wrong || 3u * (doubts(state) + 1u) > count) return;\n")),
    ("other-bus-unit-ignored",
     "The reply of one module is also given to the signals of other modules with the same register "
     "addresses: two Pt100 modules show each other's temperatures in turn",
     (SIGNALS + "bus_turns.c",
      "    return turn->unit == signal->bus_unit && signal->reg >= turn->start &&\n"
      "           end_of(signal) <= (uint32_t)turn->start + turn->count;",
      "    return signal->reg >= turn->start &&\n"
      "           end_of(signal) <= (uint32_t)turn->start + turn->count;")),
    ("other-margin-absolute",
     "Without a margin in the file it is 0.1 in the input's unit instead of a tenth of the trained range: "
     "models fade, and the mode is DEGRADED, as soon as an input leaves its range a little",
     ("firmware/terms/ranges.c",
      "    range->margin = extends ? scratch->range.margin[input] : 0.1f * trained;",
      "    range->margin = extends ? scratch->range.margin[input] : 0.1f;")),
    ("other-direction-of-extrapolated",
     "The direction of travel follows the position with its lead instead of the reading: an axis that "
     "stops seems to come back, and the curve changes to the wrong branch at each stop",
     ("firmware/terms/curves.h",
      "    cb_direction_step(&state->direction, signal->value, curve->reversal_mm);",
      "    cb_direction_step(&state->direction, signal->used, curve->reversal_mm);")),
    ("other-late-reply-still-fails",
     "A late reply does not end the row of failures: with a PLC that answers each request a little too "
     "late the connection is dropped every three exchanges instead of kept",
     (LINUX + "tcp.c",
      "        cb_peer_note_time(&tcp->peer, cb_boottime_us() - tcp->sent_us);\n"
      "        tcp->failures_in_row = 0;\n"
      "        use_up(tcp);",
      "        cb_peer_note_time(&tcp->peer, cb_boottime_us() - tcp->sent_us);\n"
      "        use_up(tcp);")),
    ("other-serial-without-pause",
     "A failed attempt to open a serial device does not start the pause: a missing adapter is opened again "
     "in every cycle, and the failures count by the thousands",
     (LINUX + "serial.c",
      "        serial->error_number = opened->error;\n"
      "        serial->since_us = now_us;\n",
      "        serial->error_number = opened->error;\n")),
    ("other-hand-file-in-part",
     "The lines of a file of measurements by hand are taken one by one before all of it is checked: the "
     "lines before a wrong one are taken although the message says that nothing is",
     (LINUX + "hand.c",
      "        line += length + more;\n"
      "    }\n"
      "    for (unsigned i = 0; i < count; ++i) take_line(look, &lines[i]);\n"
      "}",
      "        take_line(look, &lines[count - 1]);\n"
      "        line += length + more;\n"
      "    }\n"
      "}")),
    ("other-other-host-taken",
     "A reload with another address of the PLC is not rejected as one that takes a restart: at rest it is "
     "reported as running, and the box goes on writing to the old PLC",
     (DAEMON + "reload.c",
      "        a->client != b->client || memcmp(a->host, b->host, sizeof a->host) != 0 ||\n"
      "        serial_differs",
      "        a->client != b->client ||\n"
      "        serial_differs")),
    ("other-pair-gone-unnoticed",
     "A file that no longer has a pair does not count as one that widens limits: it is taken while ACTIVE, "
     "and the two motors of the stage may move apart at once",
     (DAEMON + "widening.c",
      "            return pair->max_difference_um;\n"
      "    }\n"
      "    return INFINITY;",
      "            return pair->max_difference_um;\n"
      "    }\n"
      "    return 0.0f;")),
    ("other-start-empties-the-state",
     "The first write of the state file at the start has no lags and no probes instead of those just "
     "resumed: a power cut in the first seconds of a run loses the thermal memory and the adapted bias",
     (DAEMON + "main.c",
      "    daemon->state = daemon->loop.resumed; /* a start that ends at once keeps the lags */\n",
      "")),
    ("other-exit-code-without-record",
     "Rows of the record that could not be written no longer change the exit code: after a full disk the "
     "program ends with 0",
     (DAEMON + "row_files.c",
      "    return record_error == 0 && inputs_error == 0;",
      "    return inputs_error == 0;")),
    ("other-logged-cause-not-kept",
     "The cause of the last line about the mode is not remembered: while a signal is missing, every cycle "
     "looks like another missing signal, and log and events are flooded with the same line",
     (DAEMON + "log.c",
      "    log->reason = row->reason;\n"
      "    log->cause = *cause;\n",
      "    log->reason = row->reason;\n")),
    ("other-clock-of-now-trusted",
     "After a boot the pause is measured by the wall clock even if it is not synchronised now: on a board "
     "whose clock begins where it was switched off, lags of the last evening go on as if there was no "
     "pause",
     (OUTPUT + "state.c",
      "    return now->synchronised ? PAUSE_WALL_CLOCK : PAUSE_UNSYNC_NOW;",
      "    return PAUSE_WALL_CLOCK;")),
    ("other-power-not-compared",
     "The records of a bank's lags are found without comparing their power: after a restart the lag of the "
     "square of a speed goes on with the value of the lag of the speed",
     (OUTPUT + "state.c",
      "           strncmp(record->lag_of, lag->lag_of, CB_NAME_SIZE) == 0 && record->power == lag->power &&\n"
      "           record->tau_s == lag->tau_s;",
      "           strncmp(record->lag_of, lag->lag_of, CB_NAME_SIZE) == 0 &&\n"
      "           record->tau_s == lag->tau_s;")),
    ("other-record-with-a-hole",
     "After the torn part of a row is cut off, the place to write is not set back: once the disk has room "
     "again the record continues behind a hole of NUL bytes",
     (OUTPUT + "record.c",
      "lseek(record->fd, record->whole_size, SEEK_SET) < 0;",
      "lseek(record->fd, record->whole_size, SEEK_CUR) < 0;")),
    ("other-events-not-counted",
     "The bytes of a written event are not added to the size of the file: it is never rotated, and a full "
     "disk cuts it back to its size at the start, so the events since then are lost",
     (OUTPUT + "events.c",
      "    if (cb_output_write(events->fd, line, bytes) == bytes) {\n"
      "        events->bytes += (int64_t)bytes;\n"
      "        return 0;\n"
      "    }",
      "    if (cb_output_write(events->fd, line, bytes) == bytes) return 0;")),
    ("other-trim-to-one",
     "The bytes of a removed old record are not subtracted: as soon as all records exceed their limit, all "
     "old ones but the newest are removed instead of the oldest one",
     (OUTPUT + "archive.c",
      "        all -= bytes;\n",
      "")),
    ("other-short-file-replaces",
     "A write error is forgotten when the temporary file is closed: on a full disk an incomplete file "
     "replaces the good state, statistics or snapshot",
     (OUTPUT + "output_file.c",
      "    error = cb_output_close(fd, error, durable);\n"
      "    if (error == 0 && rename",
      "    error = cb_output_close(fd, 0, durable);\n"
      "    if (error == 0 && rename")),
    ("other-cause-names-output",
     "The name of a term in a cause is that of the output with the term's index: behind a term with "
     "several outputs, or another order of the terms, log, snapshot and events name a term that is not "
     "faded or drifted",
     (OUTPUT + "cause_words.c",
      "config->outputs[config->terms[i].first_output].name",
      "config->outputs[i].name")),
    ("other-unread-never-reset",
     "Failed read-backs add up over the whole contact, so a few single ones end the search for other "
     "clients for ever",
     (BOX + "box.c",
      "plc->unread = in->held == CB_TRANSFER_OK ? 0 : (uint8_t)(plc->unread + 1);",
      "plc->unread = (uint8_t)(plc->unread + (in->held != CB_TRANSFER_OK));")),
    ("other-alarm-count-order",
     "The state of the NC alarm is updated before its rise is counted, so nc_alarms stays 0",
     (BOX + "plc.c",
      "    counters->nc_alarms += alarm && !state->nc_alarm;\n"
      "    state->nc_alarm = alarm;\n",
      "    state->nc_alarm = alarm;\n"
      "    counters->nc_alarms += alarm && !state->nc_alarm;\n")),
    ("other-outside-kept",
     "The time outside of what was sent is kept while nothing is judged, so UNAPPLIED appears too early in "
     "the next ACTIVE",
     (BOX + "applied.c",
      "state->outside_us = judged ? outside_us(state->outside_us, inside, elapsed_us, most_us) : 0;",
      "if (judged) state->outside_us = outside_us(state->outside_us, inside, elapsed_us, most_us);")),
    ("other-went-back-unknown",
     "The first heartbeat is compared with one that was never read, so a PLC whose count is in the upper "
     "half passes for restarted and its held values are taken as zero",
     (BOX + "plc.c",
      "state->contact != CB_CONTACT_KNOWN && state->beat && behind)",
      "state->contact != CB_CONTACT_KNOWN && behind)")),
    ("other-older-not-reset",
     "The first write without a reply does not reset the older late writes, so the values of an earlier "
     "time hold the output back",
     (BOX + "limiter.c",
      "        state->late_min_um = state->older_min_um = sent_um;\n"
      "        state->late_max_um = state->older_max_um = sent_um;\n",
      "        state->late_min_um = sent_um;\n"
      "        state->late_max_um = sent_um;\n")),
    ("other-waits-first",
     "A node counts as waited for before its time begins, so it is lost at once at the start",
     (SIGNALS + "canopen.c",
      "        if (!node->waits) node->heard_us = now_us;\n"
      "        node->waits = true;\n",
      "        node->waits = true;\n"
      "        if (!node->waits) node->heard_us = now_us;\n")),
    ("other-boot-not-commanded",
     "A boot-up message does not ask for another start command, so a node without a heartbeat time stays "
     "pre-operational after a reset",
     (SIGNALS + "canopen.c",
      "    ++node->boots;\n"
      "    node->commanded = false;\n",
      "    ++node->boots;\n")),
    ("other-due-after-backoff",
     "A module that answers again keeps the long pause of its silence for one more turn, so its signals "
     "come late and go stale",
     (SIGNALS + "bus_turns.c",
      "    turn->silent = 0;\n"
      "    turn->due_us = turns->requested_us + turns->every_us;\n",
      "    turn->silent = 0;\n")),
    ("other-old-velocity",
     "A reported velocity is used however old it is, so a position leads by a stale velocity",
     (SIGNALS + "signals.c",
      "    const struct cb_signal_config *source = &ageing->config->signals[signal->velocity];\n"
      "    const struct cb_signal_state *reported",
      "    const struct cb_signal_state *reported"),
     (SIGNALS + "signals.c",
      "    const bool usable =\n"
      "        signal->velocity_scale > 0.0f && cb_signal_is_recent(source, reported, ageing->now_us);\n",
      "    const bool usable = signal->velocity_scale > 0.0f && reported->known;\n")),
    ("other-stale-tool-length",
     "A volumetric term does not ask whether the tool length is fresh, so it goes on with an old length "
     "instead of fading",
     ("firmware/terms/volumetric.c",
      "return there && e->signals[config->signals[TOOL]].fresh;",
      "return there;")),
    ("other-blending-sign",
     "The slope within the reversal has the wrong sign of the blending, so a tangent points the wrong way "
     "behind a reversal",
     ("models/direction.c",
      "(forward.value - backward.value) / width",
      "(backward.value - forward.value) / width")),
    ("other-margin-unremarked",
     "An input within the margin of its training range is not counted as extrapolated, so reason and "
     "counter are missing",
     ("models/training_range.c",
      "    ++verdict->extrapolated;\n"
      "    if (beyond <= 0.0f) return;\n",
      "    if (beyond <= 0.0f) return;\n"
      "    ++verdict->extrapolated;\n")),
    ("other-second-register-free",
     "Only the first register of a number in the read block is reserved, so a file is accepted whose "
     "numbers overlap in the second one",
     ("firmware/load/registers.c",
      "    for (uint32_t i = first; i < first + width; ++i) users[i] = user;\n",
      "    users[first] = user;\n")),
    ("other-deadband-of-profile",
     "The profile's deadband replaces the one in the file, so foreign values are judged by the wrong bound",
     ("firmware/load/plc.c",
      "if (slots[PLC_DEADBAND] == CB_ABSENT) plc->deadband_um = facts->deadband_um;",
      "if (facts->deadband_um > 0.0f) plc->deadband_um = facts->deadband_um;")),
    ("other-byte-count-ignored",
     "The byte count of a reading's reply is not compared, so a reply that contradicts itself is used and "
     "not counted as invalid",
     ("firmware/wire/modbus.c",
      "return length == 2 + bytes && pdu[1] == bytes;",
      "(void)pdu;\n"
      "    return length == 2 + bytes;")),
    ("other-whole-forgotten",
     "The channel of an adapted term overwrites that its probe measures the whole error, so the output is "
     "subtracted from it",
     ("firmware/load/probes.c",
      "adapt->measures = (uint8_t)((adapt->measures & CB_ADAPT_WHOLE) | i);",
      "adapt->measures = i;")),
    ("other-backoff-before-look",
     "Whether a lost connection was proven is asked after its pause was made longer, so it is never made "
     "again at once",
     (LINUX + "link.c",
      "    bool at_once = link->backoff_us == 0;\n"
      "    go_down(link, cause, error_number, now_us);\n"
      "    longer_backoff(link);\n",
      "    go_down(link, cause, error_number, now_us);\n"
      "    longer_backoff(link);\n"
      "    bool at_once = link->backoff_us == 0;\n")),
    ("other-same-count-same-line",
     "A measurement by hand counts as known if its count is, so one with the same count and a later time "
     "is passed over",
     (LINUX + "hand.c",
      "const bool same = of->line.count == line->count && of->line.unix_s == line->unix_s;",
      "const bool same = of->line.count == line->count;")),
    ("other-refused-is-silent",
     "A module that answers with an exception is treated as one that does not answer, so it is polled less "
     "and less and reported as silent",
     (LINUX + "bus.c",
      "        case CB_TRANSFER_REFUSED:\n"
      "            cb_bus_turns_refused(&bus->turns);\n"
      "            break;\n",
      "        case CB_TRANSFER_REFUSED:\n")),
    ("other-nodes-anew",
     "Each reload forgets the CANopen nodes, so their counters begin at 0 and operational nodes get "
     "another start command",
     (LINUX + "can_source.c",
      "    const bool same = memcmp(&source->config, &config->can, sizeof config->can) == 0;\n",
      ""),
     (LINUX + "can_source.c",
      "    if (!same) cb_canopen_start(source->nodes);\n",
      "    cb_canopen_start(source->nodes);\n")),
    ("other-waiting-adds-up",
     "The rows that wait are not reset after they were written, so one failed write counts all rows of the "
     "run as lost",
     (OUTPUT + "record.c",
      "    record->used = 0;\n"
      "    record->waiting = 0;\n",
      "    record->used = 0;\n")),
    ("other-history-by-reason",
     "The history of the statistics looks at the reason alone, so a change of the mode with the same "
     "reason is missing",
     (OUTPUT + "stats.c",
      "    if (stats->rows > 0 && row->mode == stats->last.mode && row->reason == stats->last.reason)\n"
      "        return;\n",
      "    if (stats->rows > 0 && row->reason == stats->last.reason) return;\n")),
    ("other-events-not-lost",
     "Lines that the log's limit leaves out are not counted for the events, so lost_before is missing "
     "behind them",
     (DAEMON + "log.c",
      "        limit->left_out++;\n"
      "        if (log->events != NULL) log->events->lost++;\n",
      "        limit->left_out++;\n")),
    ("other-archive-not-woken",
     "A record that is put aside does not begin the compression again, so only the files of the start are "
     "compressed",
     (OUTPUT + "archive.c",
      "    trim(archive, archive->most_bytes - 2 * cb_archive_piece(archive));\n"
      "    archive->number = 1;\n",
      "    trim(archive, archive->most_bytes - 2 * cb_archive_piece(archive));\n")),
    ("other-hand-not-followed",
     "A reload does not tell the measurements by hand about the new file, so signals that it adds never "
     "get a value",
     (DAEMON + "main.c",
      "    start_bus(daemon, now_us);\n"
      "    cb_hand_follow(&daemon->hand, config_now(daemon));\n",
      "    start_bus(daemon, now_us);\n")),
    ("other-quarters-upward",
     "The quarters of sent values are shifted in ascending order, so the newest one overwrites all older "
     "ones and a value that the NC took over late counts as not sent: UNAPPLIED in a sound machine.",
     (BOX + "applied.c",
      "    for (unsigned k = CB_SENT_SLOTS - 1; k > 0; --k) {\n",
      "    for (unsigned k = 1; k < CB_SENT_SLOTS; ++k) {\n")),
    ("other-late-time-once",
     "The time of late writes starts with the first unanswered write only, so a later unanswered value "
     "leaves the interval of possible values too early and rule (B) is broken.",
     (BOX + "limiter.c",
      "        state->turn_us = 2u * late_us;\n"
      "    }\n",
      "        state->turn_us = 2u * late_us;\n"
      "        state->late_us = late_us;\n"
      "    }\n"),
     (BOX + "limiter.c",
      "    state->late_max_um = cb_max(state->late_max_um, sent_um);\n"
      "    state->late_us = late_us;\n",
      "    state->late_max_um = cb_max(state->late_max_um, sent_um);\n")),
    ("other-fault-permission",
     "FAULT no longer keeps the need of a permission, so an enable that rises during the fault clears it, "
     "and after the reset the outputs move without a new permission.",
     (BOX + "mode.c",
      "    state->lost = true;\n"
      "    if (may_end(e)) return wait_in(CB_MODE_STOPPED, state, e);\n"
      "    if (gone",
      "    if (may_end(e)) return wait_in(CB_MODE_STOPPED, state, e);\n"
      "    if (gone")),
    ("other-slope-until-error",
     "The slope goes to zero only beyond error_um instead of limit_um, so the PLC extrapolates an output "
     "that is at its limit beyond the limit.",
     (BOX + "tangent.c",
      "    if (!(cb_abs(wanted_um) <= channel->limit_um)) return 0.0f;\n",
      "    if (!(cb_abs(wanted_um) <= channel->error_um)) return 0.0f;\n")),
    ("other-probe-unknown-output",
     "A measurement is comparable if the contact is known OR the possible values are close, so it is "
     "corrected by an output that the PLC may not have and the model learns from it.",
     (BOX + "probes.c",
      "outputs->known && off_um <= sigma_um};\n", "outputs->known || off_um <= sigma_um};\n")),
    ("other-bus-backoff-endless",
     "The pause of a silent module doubles without an end, so a thermometer that was unplugged for an hour "
     "is not read again for another hour.",
     (SIGNALS + "bus_turns.c",
      "        if (turn->silent < CB_BUS_BACKOFF_MAX) ++turn->silent;\n",
      "        if (turn->silent < 31) ++turn->silent;\n")),
    ("other-node-lost-once",
     "A heartbeat does not end the loss of a CANopen node, so a second loss of it is neither noticed nor "
     "counted and its state stays that of the last heartbeat.",
     (SIGNALS + "canopen.c",
      "    node->waits = true;\n"
      "    node->lost = false;\n",
      "    node->waits = true;\n")),
    ("other-one-doubt-more",
     "The bound of a third of the sensors counts only those doubted so far, so one sensor more than "
     "permitted is doubted and the majority may be judged by the minority.",
     (SIGNALS + "sensors.c",
      "    if (!wrong || 3u * (doubts(state) + 1u) > count) return;\n",
      "    if (!wrong || 3u * doubts(state) >= count) return;\n")),
    ("other-agrees-with-first",
     "A probe is compared with the first pending innovation instead of the newest one, so two equal probes "
     "after a wrong one do not confirm each other and a changed machine is learned late and by the median.",
     ("models/adapt.c",
      "    const float off = innovation_um - state->pending_um[state->pending - 1];\n",
      "    const float off = innovation_um - state->pending_um[0];\n")),
    ("other-fade-slope-sign",
     "The slope of a model's fading weight has the wrong sign on both sides of the training range, so the "
     "tangent that the PLC follows leans the wrong way there.",
     ("models/training_range.c",
      "    const float slope = above > below ? -range->inverse_fade : range->inverse_fade;\n",
      "    const float slope = above > below ? range->inverse_fade : -range->inverse_fade;\n")),
    ("other-one-weight-for-powers",
     "The slope of columns without a lag does not go on to the weights of the next power, so the tangent "
     "of a model with x and x^2 uses the weight of x for both.",
     ("firmware/terms/columns.c",
      "        for (unsigned k = 0; k < term->outputs; ++k) slope[k] += of_power[k * columns] * rate;\n"
      "        of_power += bank->taus_count;\n",
      "        for (unsigned k = 0; k < term->outputs; ++k) slope[k] += of_power[k * columns] * rate;\n")),
    ("other-partial-place",
     "A pass of sigma that a stale input breaks off counts as whole, so a partial sum becomes the place of "
     "the model's state and sigma and the adaptation by probes are wrong.",
     ("firmware/terms/sigma.c",
      "        end_bank(config, state, false);\n",
      "        end_bank(config, state, true);\n")),
    ("other-slew-of-whole-step",
     "The rate of a control with a largest step is computed from the whole step and not one unit less, so "
     "outputs a window apart may differ by one unit more than the NC accepts.",
     ("firmware/config/profile.c",
      "(float)(config->plc.step_units - 1u) * channel->scale;\n",
      "(float)config->plc.step_units * channel->scale;\n")),
    ("other-slope-positive",
     "A slope does not take over the sign of its channel, so on a channel with sign -1 the PLC corrects by "
     "the slope in the wrong direction.",
     ("firmware/load/tangent.c",
      "    slope->sign = channel->sign;\n",
      "    slope->sign = 1;\n")),
    ("other-refusal-never-certain",
     "The request is counted before it is asked whether it was the only one, so on RTU no refusal is ever "
     "certain and a PLC that refuses writes never leads to the fault that reports it.",
     ("firmware/wire/rtu_dialog.c",
      "    const bool certain = dialog->requests == 0 && !dialog->probed_twice;\n"
      "    ++dialog->requests;\n",
      "    ++dialog->requests;\n"
      "    const bool certain = dialog->requests == 0 && !dialog->probed_twice;\n")),
    ("other-stray-on-bus",
     "Bytes of a frame that nobody requested end the turn of a module also on the bus of thermometers, "
     "where nothing repeats it, so each stray frame makes a module miss its turn and back off.",
     (LINUX + "rtu.c",
      "    if (silence == CB_RTU_END_STRAY && rtu->has_dialog && what == CB_RTU_SEND_REQUEST)\n"
      "        return silence;\n",
      "    if (silence == CB_RTU_END_STRAY && what == CB_RTU_SEND_REQUEST) return silence;\n")),
    ("other-fed-without-cycles",
     "The number of cycles at the last feed is not kept, so both watchdogs are fed although the loop "
     "hangs, and nothing resets the machine.",
     (DAEMON + "supervise.c", "        supervise->notify_steps = steps;\n", ""),
     (DAEMON + "supervise.c", "        supervise->watchdog_steps = steps;\n", "")),
    ("other-silence-is-enable-edge",
     "A short silence of the PLC counts as if enable had been off, so its unchanged level afterwards is taken "
     "for a new rising edge and the box goes from HOLD to ACTIVE without permit resume",
     (BOX + "mode.c",
      "    state->enable_was = events->enable;\n",
      "    state->enable_was = events->enable && events->plc_ok;\n")),
    ("other-foreign-names-first",
     "The FAULT for a foreign applied value names the first channel that is merely unapplied, not the one that "
     "is beyond error_um",
     (BOX + "applied.c",
      "    if ((foreign && !verdict->foreign) || (unapplied && verdict->channel == CB_NONE)) {\n",
      "    if ((foreign || unapplied) && verdict->channel == CB_NONE) {\n")),
    ("other-reload-bank-input-zero",
     "After a reload the lags of a bank go on from an input of 0 instead of the last value of their signal",
     (BOX + "adopt.c",
      "        fresh->bank.time_us[i] = old->bank.time_us[k];\n"
      "        fresh->bank.value[i] = old->bank.value[k];\n",
      "        fresh->bank.time_us[i] = old->bank.time_us[k];\n")),
    ("other-eight-digits-eleven-bits",
     "A CAN identifier of eight digits below 0x800, such as 0x00000181, is taken for an 11-bit one",
     ("firmware/load/signals.c",
      "    *id = flags | (value > 0x7FF || digits == 8 ? value | CB_CAN_EXTENDED : value);\n",
      "    *id = flags | (value > 0x7FF ? value | CB_CAN_EXTENDED : value);\n")),
    ("other-slope-ramps-in-um",
     "In RAMP and FAULT the slope for the control falls at ramp_um_per_s, as if it were in um, instead of at "
     "its own slew",
     (BOX + "limiter.c",
      "    const bool ramps = ramp > 0.0f && !channel->is_slope; /* a slope is not in µm */\n",
      "    const bool ramps = ramp > 0.0f;\n")),
    ("other-own-pair-placed-apart",
     "When contact returns after a reload, the box's own values of a pair are forced within the new difference "
     "at once, in one step, because they are kept before the pair rule and not after it",
     (BOX + "limiter.c",
      "    join_targets(config, &ignored, place_um);\n"
      "    for (unsigned i = 0; i < cb_all_channels(config); ++i)\n"
      "        if (pair_is_own(config, channels, start, i)) place_um[i] = start[i].um;\n",
      "    for (unsigned i = 0; i < cb_all_channels(config); ++i)\n"
      "        if (pair_is_own(config, channels, start, i)) place_um[i] = start[i].um;\n"
      "    join_targets(config, &ignored, place_um);\n")),
    ("other-old-stop-still-counts",
     "A run that wrote and ended without confirmation is stored as STOPPED if the run before it had ended "
     "STOPPED",
     (BOX + "state.c",
      "    return box->life.wrote ? box->life.stop_confirmed : box->life.stopped_before;\n",
      "    return box->life.stop_confirmed || box->life.stopped_before;\n")),
    ("other-asked-probe-widens",
     "A probe that is not taken, but asked for again, leaves the variance of the bias widened by the distance "
     "of the state, once more with each such probe",
     ("models/adapt.c",
      "    const float narrow_d = state->bias_d;\n"
      "    state->bias_d = widened(state, own);\n",
      "    state->bias_d = widened(state, own);\n"),
     ("models/adapt.c",
      "    if (cb_adapt_was_taken(outcome))\n"
      "        remember(state, own);\n"
      "    else\n"
      "        state->bias_d = narrow_d;\n",
      "    if (cb_adapt_was_taken(outcome)) remember(state, own);\n")),
    ("other-squareness-slope-of-position",
     "The derivative of a volumetric term multiplies the squareness towards Z by the position of Z instead of "
     "its rate",
     ("models/volumetric.c",
      "    const float y = rate->position_mm[CB_AXIS_Y], z = rate->position_mm[CB_AXIS_Z];\n",
      "    const float y = rate->position_mm[CB_AXIS_Y], z = state->position_mm[CB_AXIS_Z];\n")),
    ("other-span-never-above",
     "On nearly uniform breaks the computed span is corrected downward only, so some positions are evaluated "
     "with the polynomial of the span before theirs",
     ("models/ppoly.c",
      "    const uint32_t above = (x >= curve->breaks[span + 1]) & (span < last);\n"
      "    return span - below + above;\n",
      "    return span - below;\n")),
    ("other-ramp-after-long-pause",
     "After a pause longer than its time constant a lag weighs the change of its input by gain / h instead of "
     "1 - gain / h",
     ("models/lag.c",
      "    if (h > 0.0f) gains.ramp = h <= 1.0f ? ramp_series(h) : 1.0f - gains.gain / h;\n",
      "    if (h > 0.0f) gains.ramp = h <= 1.0f ? ramp_series(h) : gains.gain / h;\n")),
    ("other-file-known-after-load",
     "The version of the coefficient file is noted after it was read and not before, so a file that replaces "
     "it meanwhile is never loaded",
     (DAEMON + "reload.c",
      "    char why[200];\n"
      "    look(reload, &reload->known);\n"
      "    reload->seen = reload->known;\n"
      "    if (cb_loop_is_corrupt(loop)) return refuse_corrupt(reload);\n"
      "    if (load(reload, &spare->config) && check(reload, now, &spare->config)) {\n",
      "    char why[200];\n"
      "    const bool corrupt = cb_loop_is_corrupt(loop);\n"
      "    const bool good =\n"
      "        !corrupt && load(reload, &spare->config) && check(reload, now, &spare->config);\n"
      "    look(reload, &reload->known);\n"
      "    reload->seen = reload->known;\n"
      "    if (corrupt) return refuse_corrupt(reload);\n"
      "    if (good) {\n")),
    ("other-sender-sticks",
     "The sender of a SIGHUP is not forgotten, so events about all later files, which the daemon noticed by "
     "itself, name him as the one who requested them",
     (DAEMON + "reload.c",
      "    reload->sender.known = false;\n",
      "")),
    ("other-state-under-new-names",
     "Right after a reload the state file is written with lags that still belong to the previous file, under "
     "the names of the new one",
     (DAEMON + "main.c",
      "    /* right after a reload the newest lags still belong to the previous file */\n"
      "    if (daemon->state_generation != daemon->generation) return;\n",
      "")),
    ("other-probe-pause-boot-clock",
     "After a reboot the age of an adapted term is measured by the clock of the boot, not by the wall clock, "
     "so its uncertainty grows by a wrong time",
     (OUTPUT + "state.c",
      "        if (pause == PAUSE_WALL_CLOCK) pause_us = now->unix_us - probe.unix_us;\n",
      "        if (pause == PAUSE_WALL_CLOCK) pause_us = now->boottime_us - probe.boottime_us;\n")),
    ("other-event-sync-put-off",
     "Each event starts the second until the events are on the disk again, so a box that logs all the time "
     "never syncs them",
     (OUTPUT + "events.c",
      "    if (events->error == 0 && events->sync_us == 0) events->sync_us = now.boottime_us;\n",
      "    if (events->error == 0) events->sync_us = now.boottime_us;\n")),
    ("other-snapshot-crc-last-read",
     "The snapshot has the CRC of the file that was read last, also one that is refused or pending, beside the "
     "revision of the running one",
     (DAEMON + "main.c",
      "                             daemon->crc32s[generation % 2], daemon->options.snapshot);\n",
      "                             daemon->reload.loaded.facts.crc32, daemon->options.snapshot);\n")),
    ("other-bus-forgets-delay",
     "The deadline of a request on the sensor bus leaves the slave's delay out, so slow modules never reply in "
     "time",
     (LINUX + "bus.c",
      "        now_us + cb_rtu_exchange_us(&line->line, &request, line->slave_delay_us) + MARGIN_US;\n",
      "        now_us + cb_rtu_exchange_us(&line->line, &request, 0) + MARGIN_US;\n")),
    ("other-failures-outlive-connection",
     "The count of successive failures survives the connection, so the first late reply on a new one drops "
     "that too",
     (LINUX + "tcp.c",
      "    tcp->awaiting = tcp->read_answered = tcp->write_answered = false;\n"
      "    tcp->failures_in_row = 0;\n",
      "    tcp->awaiting = tcp->read_answered = tcp->write_answered = false;\n")),
    ("other-write-after-slow-connect",
     "With libmodbus the outputs of a cycle are still written when a slow connect has passed the next tick",
     (LINUX + "libmodbus.c",
      "    const bool writes = job->write.count > 0 && cb_boottime_us() < job->due_us;\n",
      "    const bool writes = job->write.count > 0;\n")),
    ("other-rename-before-sync",
     "A whole file takes its name before it is synced and closed, so an error of the disk, or a power cut, "
     "replaces the good file by an incomplete one",
     (OUTPUT + "output_file.c",
      "    error = cb_output_close(fd, error, durable);\n"
      "    if (error == 0 && rename(temporary, path) != 0) error = errno;\n",
      "    if (error == 0 && rename(temporary, path) != 0) error = errno;\n"
      "    error = cb_output_close(fd, error, durable);\n")),
    ("other-older-late-dropped",
     "The largest late write of the turn before is left out of what the PLC may hold, so an output can be too "
     "far from it",
     (BOX + "limiter.c",
      "    state->possible_max_um = cb_max(high_um, cb_max(state->late_max_um, state->older_max_um));",
      "    state->possible_max_um = cb_max(high_um, state->late_max_um);")),
    ("other-slope-before-slew",
     "The site's ceiling bounds a slope by its rate before the rate itself is lowered, so the slope cannot "
     "reach zero within a second",
     (BOX + "ceiling.c",
      "    if (lower(&channel->slew_um_per_s, ceiling->um_per_s)) lowered = true;\n"
      "    /* a slope must reach zero within a second (load/tangent.c) */\n"
      "    if (channel->is_slope && lower(&channel->limit_um, channel->slew_um_per_s)) lowered = true;\n",
      "    /* a slope must reach zero within a second (load/tangent.c) */\n"
      "    if (channel->is_slope && lower(&channel->limit_um, channel->slew_um_per_s)) lowered = true;\n"
      "    if (lower(&channel->slew_um_per_s, ceiling->um_per_s)) lowered = true;\n")),
    ("other-lead-whole-line",
     "The measured lead contains the whole time of interpolation instead of half of it",
     (SIGNALS + "lead.c",
      "(config->period_us + line_us) / 2 +",
      "config->period_us / 2 + line_us +")),
    ("other-last-term-counts",
     "A probe is comparable if only the last other term of the sum is live",
     (BOX + "probes.c",
      "        rest.good = rest.good && states[config->output_terms[output]].live;",
      "        rest.good = states[config->output_terms[output]].live;")),
    ("other-doubts-one-more",
     "The box doubts one sensor more than a third of them",
     (SIGNALS + "sensors.c",
      "3u * (doubts(state) + 1u) > count",
      "3u * doubts(state) > count")),
    ("other-doubt-inherited",
     "A signal that was doubted stays doubted for ever behind a reload to a file without sensors",
     (BOX + "adopt.c",
      "        fresh->signals[i].doubted = false;\n",
      "")),
    ("other-reset-edge-kept",
     "Without a reading the reset edge of the last one counts again, so a fault whose cause goes later is "
     "reset without a new edge",
     (BOX + "plc.c",
      "    state->reset_edge = false;\n",
      "")),
    ("other-refusal-certain",
     "On a serial line a refusal counts as certain although it may belong to an earlier request, so a value "
     "that the PLC may have is taken as not written",
     ("firmware/wire/rtu_dialog.c",
      "    const bool certain = dialog->requests == 0 && !dialog->probed_twice;",
      "    const bool certain = dialog->requests == 0;")),
    ("other-squareness-by-position",
     "The slope of a volumetric term takes Y's position instead of Y's rate for the squareness of X and Y",
     ("models/volumetric.c",
      "    const float y = rate->position_mm[CB_AXIS_Y], z = rate->position_mm[CB_AXIS_Z];",
      "    const float y = state->position_mm[CB_AXIS_Y], z = rate->position_mm[CB_AXIS_Z];")),
    ("other-handed-age",
     "With libmodbus a reading is as young as the cycle that takes it, not as its request",
     ("hal/cycle.c",
      "    if (cycle->in.read_ok) cycle->in.read_us = handed.read_us;\n",
      "")),
    ("other-offer-before-rule",
     "The loop may take an offered file before it is stored that the file has to wait for rest",
     (DAEMON + "loop.c",
      "    loop->at_rest_only = at_rest_only;\n"
      "    __atomic_store_n(&loop->offer, CB_LOOP_OFFER_MADE, __ATOMIC_RELEASE);\n",
      "    __atomic_store_n(&loop->offer, CB_LOOP_OFFER_MADE, __ATOMIC_RELEASE);\n"
      "    loop->at_rest_only = at_rest_only;\n")),
    ("other-file-still-growing",
     "A coefficient file is read while it still changes, because it is compared with itself",
     (DAEMON + "reload.c",
      "    const bool stays = is_same_look(&now, &reload->seen);\n"
      "    reload->seen = now;\n",
      "    reload->seen = now;\n"
      "    const bool stays = is_same_look(&now, &reload->seen);\n")),
    ("other-partial-write-repeats",
     "Behind a partial write the beginning of the text is written again instead of its rest",
     (OUTPUT + "output_file.c",
      "write(fd, (const char *)bytes + done, size - done)",
      "write(fd, bytes, size - done)")),
    ("other-slewed-at-limit",
     "The snapshot says of a channel at its limit that its output is still on its way",
     (OUTPUT + "snapshot.c",
      "    const float wanted_um = cb_clamp(channel->wanted_um, -config->most_um, config->most_um);\n",
      "    const float wanted_um = channel->wanted_um;\n")),
    ("other-damaged-key-skipped",
     "A key that cannot be read is passed over, so a folder with one damaged key takes unsigned files",
     (LINUX + "enrolled.c",
      "    if (!read_key(path, &key, message)) return false;",
      "    if (!read_key(path, &key, message)) return true;")),
    ("other-records-lost-less",
     "records_lost of the statistics leaves out the rows that never reached the normal thread",
     (DAEMON + "main.c",
      "    run->records_lost = run->rows_lost + daemon->files.record.lost;",
      "    run->records_lost = daemon->files.record.lost;")),
    ("other-cross-product-sign",
     "The Y part of an axis' rotation times its lever has the wrong sign at the tool tip",
     ("models/volumetric.c",
      "    sum[1] += a[2] * b[0] - a[0] * b[2];\n",
      "    sum[1] += a[0] * b[2] - a[2] * b[0];\n")),
    ("other-logsig-bias-whole",
     "The bias of a hidden unit of a logsig network counts twice, because it is not halved with its weights",
     ("models/bpnet.c",
      "    struct sum bias = {source->hidden_bias[i] * half, 0.0f};\n",
      "    struct sum bias = {source->hidden_bias[i], 0.0f};\n")),
    ("other-margin-not-used",
     "An input outside of the trained range is held at the end of that range instead of the end of its margin, "
     "so no model extrapolates",
     ("models/training_range.c",
      "    return cb_clamp(x, range->min - range->margin, range->max + range->margin);\n",
      "    return cb_clamp(x, range->min, range->max);\n")),
    ("other-blend-not-completed",
     "An axis that travels on beyond its furthest position keeps the blend of the two branches that it had, "
     "instead of going to one branch",
     ("models/direction.c",
      "        direction->blend = sense;\n",
      "")),
    ("other-lag-ramp-of-long-steps",
     "After a pause longer than its time constant a lag takes too little of the way that its input has made "
     "meanwhile",
     ("models/lag.c",
      "    if (h > 0.0f) gains.ramp = h <= 1.0f ? ramp_series(h) : 1.0f - gains.gain / h;\n",
      "    if (h > 0.0f) gains.ramp = h <= 1.0f ? ramp_series(h) : 1.0f - gains.gain;\n")),
    ("other-rest-of-probe-is-all",
     "After a probe that step_max_um has shortened, the whole innovation stays pending and not its rest, so a "
     "next probe that confirms the rest is asked for again",
     ("models/adapt.c",
      "    state->pending_um[0] = rest_um;\n",
      "    state->pending_um[0] = innovation_um;\n")),
    ("other-late-writes-need-a-heartbeat",
     "While the PLC's heartbeat stands, confirmed writes do not age a write without a reply, so it holds the "
     "outputs on their way to zero for ever",
     (BOX + "limiter.c",
      "    const uint32_t served_us = result == CB_TRANSFER_OK ? elapsed_us : lived_us;\n",
      "    const uint32_t served_us = lived_us;\n")),
    ("other-flicker-forgiven",
     "Time in which `applied` is right counts back at once instead of at a quarter, so a second writer whose "
     "value flickers is never reported by reason 13",
     (BOX + "applied.c",
      "    const uint32_t inside_us = elapsed_us / 4, outside_us = cb_add_us(before_us, elapsed_us);\n",
      "    const uint32_t inside_us = elapsed_us, outside_us = cb_add_us(before_us, elapsed_us);\n")),
    ("other-probe-adds-the-other-terms",
     "The other terms of the channel's sum are added to the probed value instead of subtracted",
     (BOX + "probes.c",
      "        rest.um -= terms[output];\n",
      "        rest.um += terms[output];\n")),
    ("other-cause-of-fault-moves-on",
     "In FAULT the detail word and the cause are searched anew in each step, instead of staying those of the "
     "first one",
     (BOX + "box.c",
      "    const bool was_fault = mode == CB_MODE_FAULT && before == CB_MODE_FAULT;\n"
      "    if (!was_fault) box->cause = cb_box_find_cause(box);\n",
      "    box->cause = cb_box_find_cause(box);\n")),
    ("other-repeated-reading-takes-the-write",
     "On a serial line to the PLC a reading is repeated although no time is left for the write behind it",
     ("firmware/wire/rtu_dialog.c",
      "    const bool reads = request->function == CB_MODBUS_READ;\n"
      "    dialog->request_us = cb_rtu_exchange_us(&dialog->manners.line, request, 0);\n"
      "    dialog->deadline_us = deadline_us;\n"
      "    dialog->again_until_us = deadline_us - (reads ? (int64_t)dialog->manners.reserve_us : 0);\n",
      "    dialog->request_us = cb_rtu_exchange_us(&dialog->manners.line, request, 0);\n"
      "    dialog->deadline_us = deadline_us;\n"
      "    dialog->again_until_us = deadline_us;\n")),
    ("other-statistics-need-both-counts",
     "The statistics leave out a signal that was only implausible or only stale",
     (OUTPUT + "stats_json.c",
      "        if (signal->implausible == 0 && signal->stale == 0) continue;\n",
      "        if (signal->implausible == 0 || signal->stale == 0) continue;\n")),
    ("other-exit-code-of-one-file",
     "The exit code is 0 although the statistics, or else record or inputs, could not be written",
     (DAEMON + "main.c",
      "    const bool written = complete && stats_error == 0;\n",
      "    const bool written = complete || stats_error == 0;\n")),
    ("other-record-without-header",
     "A record that takes the place of one with other columns at a start has no header",
     (OUTPUT + "record.c",
      "    record->before_unix_us = record->whole_size = 0;\n",
      "    record->before_unix_us = 0;\n")),
    ("other-events-lost-without-count",
     "Events that could not be written are missing from lost_before of the next one",
     (OUTPUT + "events.c",
      "    events->lost = events->error == 0 ? 0 : events->lost + 1;\n",
      "    events->lost = 0;\n")),
    ("other-no-silence-before-a-request",
     "A request on a serial line begins without the 3.5 characters of silence behind the frame before it",
     (LINUX + "rtu.c",
      "        if (got == 0 && now_us >= rtu->line_free_us) break;\n",
      "        if (got == 0) break;\n")),
    ("other-direction-full-width",
     "A curve with two branches starts on the backward branch instead of the mean of both: the direction of "
     "travel starts a whole width behind the extreme, not half of one",
     ("models/direction.c",
      "    direction->extreme = x + 0.5f * width;\n",
      "    direction->extreme = x + width;\n")),
    ("other-adapt-first-early",
     "The first probe of a run is refused as early if it comes within min_interval_s of the start, because the "
     "start counts as a probe that was taken",
     ("models/adapt.c",
      "    *state = (struct cb_adapt){.bias_d = 1.0f, .gain_d = 0.25f, .since_h = FLT_MAX};\n",
      "    *state = (struct cb_adapt){.bias_d = 1.0f, .gain_d = 0.25f};\n")),
    ("other-volumetric-workpiece-lever",
     "The position of an axis that carries the workpiece does not add to its own lever, so its rotations act "
     "over a wrong arm",
     ("models/volumetric.c",
      "    const unsigned from = i < f ? i : i + 1; /* workpiece side: the axis itself and all to its\n"
      "                                                right */\n",
      "    const unsigned from = i + 1;\n")),
    ("other-polynomial-to",
     "A polynomial with `to` but without `from` goes on to the signal's max, and one with `from` but without "
     "`to` ends at 0 or is refused",
     ("firmware/terms/polynomial.c",
      "    if (slots[TO] == CB_ABSENT) curve->to = signal->max;\n",
      "    if (slots[FROM] == CB_ABSENT) curve->to = signal->max;\n")),
    ("other-fade-first-output",
     "Of a term with several outputs whose input is missing only the first output fades; the others stay where "
     "they were",
     ("firmware/terms/terms.c",
      "    fade(output, term->outputs, step->e.fade_um);\n",
      "    fade(output, 1, step->e.fade_um);\n")),
    ("other-sigma-along-first",
     "Every output of a bank has the along_um of the first output, so sigma of the others is wrong away from "
     "the middle of the training",
     ("firmware/terms/sigma.c",
      "    sigma.along_um = config->pool[bank->sigma + bank->outputs + k];\n",
      "    sigma.along_um = config->pool[bank->sigma + bank->outputs];\n")),
    ("other-product-of-faded",
     "A product whose factor fades does not fade itself: it stays live and goes with the factor, at the ramp "
     "times the way of its signal",
     ("firmware/terms/product.c",
      "    if (!signal->fresh || !cb_output_is_live(e, product->output)) return CB_TERM_MISSING;\n",
      "    if (!signal->fresh) return CB_TERM_MISSING;\n")),
    ("other-late-turn-restarts",
     "Each write without a reply begins its turn anew, so outputs stand still for as long as replies are lost "
     "now and then",
     (BOX + "limiter.c",
      "        state->late_max_um = state->older_max_um = sent_um;\n"
      "        state->turn_us = 2u * late_us;\n"
      "    }\n",
      "        state->late_max_um = state->older_max_um = sent_um;\n"
      "    }\n"
      "    state->turn_us = 2u * late_us;\n")),
    ("other-applied-forgets",
     "A cycle without a reading clears the verdict about the applied values, so reasons 13 and 21 come and go "
     "with each lost reading",
     (BOX + "applied.c",
      "    if (registers) state->verdict = verdict;\n",
      "    state->verdict = verdict;\n")),
    ("other-restart-adapt-ramps",
     "After a restart an adapted term begins at its bare model and ramps to the stored bias and gain, instead "
     "of going on with them",
     (BOX + "state.c",
      "        adapted->bias_um = adapted->to_bias_um = box->probes[i].filter.bias_um;\n"
      "        adapted->gain = adapted->to_gain = box->probes[i].filter.gain;\n",
      "        adapted->to_bias_um = box->probes[i].filter.bias_um;\n"
      "        adapted->to_gain = box->probes[i].filter.gain;\n")),
    ("other-interpolate-whole-period",
     "A file whose interpolate_ms equals period_ms is refused, which is the value that the manual recommends",
     ("firmware/load/plc.c",
      "    if (config->plc.interpolate_us <= config->period_us) return true;\n",
      "    if (config->plc.interpolate_us < config->period_us) return true;\n")),
    ("other-rtu-no-reserve",
     "On a serial line repeated readings take the time of the write, so a lost reply costs the write of its "
     "cycle too",
     ("firmware/wire/rtu_dialog.c",
      "    const bool reads = request->function == CB_MODBUS_READ;\n"
      "    dialog->request_us = cb_rtu_exchange_us(&dialog->manners.line, request, 0);\n"
      "    dialog->deadline_us = deadline_us;\n"
      "    dialog->again_until_us = deadline_us - (reads ? (int64_t)dialog->manners.reserve_us : 0);\n",
      "    dialog->request_us = cb_rtu_exchange_us(&dialog->manners.line, request, 0);\n"
      "    dialog->deadline_us = dialog->again_until_us = deadline_us;\n")),
    ("other-velocity-over-gap",
     "After a gap of more than three periods a position leads by the velocity from before the gap, not from 0",
     (SIGNALS + "signals.c",
      "    if (elapsed_us > (int64_t)CB_LEAD_PERIODS * config->period_us) return 0.0f;\n",
      "    if (elapsed_us > (int64_t)CB_LEAD_PERIODS * config->period_us) return velocity;\n")),
    ("other-lead-whole-ms",
     "A lead_ms with a fraction is rounded to whole milliseconds",
     ("firmware/load/load.c",
      "    config->lead_us = (uint32_t)(lead_ms * 1000.0f + 0.5f);\n",
      "    config->lead_us = (uint32_t)(lead_ms + 0.5f) * 1000u;\n")),
    ("other-link-pause-unbounded",
     "The pause between attempts to connect doubles without end, so after a long outage the box comes back "
     "minutes late",
     (LINUX + "link.c",
      "    uint32_t doubled = link->backoff_us == 0 ? FIRST_BACKOFF_US : 2 * link->backoff_us;\n"
      "    link->backoff_us = doubled > MAX_BACKOFF_US ? MAX_BACKOFF_US : doubled;\n",
      "    link->backoff_us = link->backoff_us == 0 ? FIRST_BACKOFF_US : 2 * link->backoff_us;\n")),
    ("other-can-frame-from-future",
     "CAN frames that wait in the queue while the wall clock is set back get a time in the future, and the box "
     "drops their values as unknown samples",
     (LINUX + "can.c",
      "    return time_us > now_us ? now_us : time_us;\n",
      "    return time_us;\n")),
    ("other-reload-generation-behind",
     "After a reload the loop drops all samples of the bus and of measurements by hand, because it expects "
     "those of the previous file",
     (DAEMON + "loop.c",
      "    loop->target.generation = loop->generation + 1;\n"
      "    __atomic_store_n(&loop->generation, loop->target.generation, __ATOMIC_RELEASE);\n",
      "    loop->target.generation = loop->generation;\n"
      "    __atomic_store_n(&loop->generation, loop->generation + 1, __ATOMIC_RELEASE);\n")),
    ("other-blackbox-rows-twice",
     "A file of the black box begins with the oldest row in memory, so rows that are in the file before it are "
     "written again",
     (OUTPUT + "blackbox.c",
      "    box->next = box->written > oldest ? box->written : oldest;\n",
      "    box->next = oldest;\n")),
    ("other-notify-whole-interval",
     "systemd's watchdog is fed once in its whole timeout instead of at half of it, and ends a healthy box",
     (DAEMON + "supervise.c",
      "    return strtoll(text, NULL, 10) / 2;\n",
      "    return strtoll(text, NULL, 10);\n")),
    ("other-training-range-held-at-max",
     "An input above its trained maximum is held at the maximum instead of at maximum + margin, so a network "
     "does not extrapolate within its upper margin and writes a wrong value there",
     ("models/training_range.c",
      "    return cb_clamp(x, range->min - range->margin, range->max + range->margin);",
      "    return cb_clamp(x, range->min - range->margin, range->max);")),
    ("other-drift-names-another-term",
     "The cause of reason 22 has the index among the adapt terms instead of the index among all terms, so the "
     "detail word, the log and the snapshot name another term",
     (BOX + "cause.c",
      "    return (struct cb_cause){CB_CAUSE_DRIFTED, box->config.adapts[i],",
      "    return (struct cb_cause){CB_CAUSE_DRIFTED, (uint8_t)i,")),
    ("other-deadband-keeps-rest-at-zero",
     "A demand of zero within the deadband keeps the last output, so an offset of up to deadband_um stays at "
     "the PLC although the demand is zero",
     (BOX + "channels.c",
      "    return cb_channel_nearest(channel, wanted_um) == 0.0f ? wanted_um : state->output_um;",
      "    return state->output_um;")),
    ("other-age-from-the-reply",
     "The time of a reading is taken behind the reply instead of before the request, so a slow PLC's values "
     "look younger than they are and the measured lead is too short",
     ("hal/cycle.c",
      "    cycle->in.read_us = now(hal);\n"
      "    cycle->read = hal->read(hal->context, read->start, read->count, cycle->in.registers,\n"
      "                            exchange->deadline_us);\n"
      "    cycle->in.read_ok = cycle->read == CB_TRANSFER_OK;\n"
      "    if (hal->handed)",
      "    cycle->read = hal->read(hal->context, read->start, read->count, cycle->in.registers,\n"
      "                            exchange->deadline_us);\n"
      "    cycle->in.read_us = now(hal);\n"
      "    cycle->in.read_ok = cycle->read == CB_TRANSFER_OK;\n"
      "    if (hal->handed)")),
    ("other-same-second-same-measurement",
     "A line of compbox measured counts as known if its count or its time is that of the last one, so a second "
     "measurement within the same second is silently dropped",
     (LINUX + "hand.c",
      "    const bool same = of->line.count == line->count && of->line.unix_s == line->unix_s;",
      "    const bool same = of->line.count == line->count || of->line.unix_s == line->unix_s;")),
    ("other-archive-without-room",
     "The kept records are trimmed to the whole limit without room for the next file and its compression, so "
     "all records together exceed --record-most",
     (OUTPUT + "archive.c",
      "    trim(archive, archive->most_bytes - 2 * cb_archive_piece(archive));",
      "    trim(archive, archive->most_bytes);")),
    ("other-record-goes-on-before-its-end",
     "A record whose last row is later than the wall clock is continued instead of put aside as FILE.1, so "
     "unix_s jumps back within one file and the pause in time_s is invented",
     (OUTPUT + "record.c",
      "    return record->before_unix_us < cb_unix_us();",
      "    return true;")),
    ("other-lag-goes-on-after-a-long-pause",
     "A lag is resumed after a pause of up to its whole time constant instead of a quarter of it, so an old "
     "state is used and the log states that it goes on",
     (OUTPUT + "state.c",
      "    if (pause_us < 0 || (double)pause_us * 1e-6 * (double)CB_STATE_PAUSES > (double)lag->tau_s)",
      "    if (pause_us < 0 || (double)pause_us * 1e-6 > (double)lag->tau_s)")),
    ("other-link-at-output-replaced",
     "A symbolic link at the path of statistics, snapshot or state is followed by the check, so it is not "
     "refused and the rename replaces it",
     (OUTPUT + "output_file.c",
      "    if (lstat(path, &there) != 0) return errno == ENOENT ? 0 : errno;",
      "    if (stat(path, &there) != 0) return errno == ENOENT ? 0 : errno;")),
    ("other-rest-ignores-what-the-plc-may-hold",
     "A channel counts as at rest although a write without a reply may have left another value than zero in the "
     "PLC: a pending file with another register, sign or larger limit is taken then, and the late value acts as "
     "a step under the new meaning",
     (BOX + "adopt.c",
      "    return state->output_um == 0.0f && state->sent_um == 0.0f && state->possible_min_um == 0.0f &&\n"
      "           state->possible_max_um == 0.0f;\n",
      "    return state->output_um == 0.0f && state->sent_um == 0.0f;\n")),
    ("other-velocity-survives-a-clock-jump",
     "A jump of the clock forgets values but not velocities: after a suspend in a fast move the first positions "
     "are looked ahead by the speed from before it, although the axis stands",
     (SIGNALS + "signals.c",
      "        state->value = state->velocity = state->used = 0.0f;\n",
      "        state->value = state->used = 0.0f;\n")),
    ("other-stale-signal-is-shown-as-refused",
     "A signal whose newest reading was implausible keeps the state `refused` (an older value is in use) in the "
     "snapshot also when that older value is stale and not used any more, so page and alarms show a dead sensor "
     "as one in use",
     (DAEMON + "loop.c",
      "    if (!signal->fresh) return CB_ROW_SIGNAL_STALE;\n"
      "    return signal->refusal == CB_CAUSE_NONE ? CB_ROW_SIGNAL_FRESH : CB_ROW_SIGNAL_REFUSED;\n",
      "    if (signal->refusal != CB_CAUSE_NONE) return CB_ROW_SIGNAL_REFUSED;\n"
      "    return signal->fresh ? CB_ROW_SIGNAL_FRESH : CB_ROW_SIGNAL_STALE;\n")),
    ("other-file-changed-while-read-is-missed",
     "The version of the coefficient file (and its signature) is noted behind its reading instead of before it: "
     "a file or signature that is renamed into place while the old one is read and checked counts as known, and "
     "is never loaded",
     (DAEMON + "reload.c",
      "    look(reload, &reload->known);\n"
      "    reload->seen = reload->known;\n"
      "    if (cb_loop_is_corrupt(loop)) return refuse_corrupt(reload);\n"
      "    if (load(reload, &spare->config) && check(reload, now, &spare->config)) {\n",
      "    const bool corrupt = cb_loop_is_corrupt(loop);\n"
      "    const bool good = !corrupt && load(reload, &spare->config);\n"
      "    look(reload, &reload->known);\n"
      "    reload->seen = reload->known;\n"
      "    if (corrupt) return refuse_corrupt(reload);\n"
      "    if (good && check(reload, now, &spare->config)) {\n")),
    ("other-other-sign-is-no-widening",
     "A file with another sign of a channel is no longer pending: if the channel's output is just zero, it "
     "takes over in ACTIVE, and from then on the axis is moved the wrong way",
     (DAEMON + "widening.c",
      "    if (was->sign != is->sign) return \"sign\";\n",
      "")),
    ("other-clock-now-vouches-for-clock-then",
     "Across a reboot the pause counts as known if the wall clock is synchronised now, even if it was not when "
     "the state was written: lags of a board without a battery clock go on after a pause that is hours wrong",
     (OUTPUT + "state.c",
      "    if (header->synchronised != 1) return PAUSE_UNSYNC_THEN;\n",
      "    if (header->synchronised != 1 && !now->synchronised) return PAUSE_UNSYNC_THEN;\n")),
    ("other-plain-record-removed-first",
     "The plain old record is removed before its compressed form has its name: a power cut or a refused rename "
     "in between loses that file, because the next start removes PATH.gz.new",
     (OUTPUT + "archive.c",
      "    if (rename(archive->temporary, compressed) != 0) return errno;\n"
      "    cb_output_sync_folder(compressed);\n"
      "    return unlink(plain) == 0 ? 0 : errno;\n",
      "    if (unlink(plain) != 0 || rename(archive->temporary, compressed) != 0) return errno;\n"
      "    cb_output_sync_folder(compressed);\n"
      "    return 0;\n")),
    ("other-failed-black-box-counts-as-written",
     "Rows of a black-box file that failed (full disk) and was removed count as written: the file of the next "
     "event begins behind them, so the ten minutes before the first event are in no file",
     (OUTPUT + "blackbox.c",
      "    if (error != 0) unlink(temporary);\n"
      "    if (error != 0) return error;\n"
      "    cb_output_sync_folder(path);\n"
      "    box->written = box->next;\n",
      "    box->written = box->next;\n"
      "    if (error != 0) unlink(temporary);\n"
      "    if (error != 0) return error;\n"
      "    cb_output_sync_folder(path);\n")),
    ("other-pending-write-has-the-fate-of-the-last",
     "With libmodbus the result of a write is not cleared for the next one: a write that still hangs is "
     "reported as confirmed because the one before it was, so the limiter takes for certain a value that the "
     "PLC may never get",
     (LINUX + "libmodbus.c",
      "        client->ended = CB_TRANSFER_NONE;\n",
      "")),
    ("other-exchange-times-without-timeouts",
     "exchange_us in statistics and snapshot counts only cycles whose reading succeeded: cycles that waited for "
     "the PLC until the deadline are missing, so max and p99 look well while requests time out",
     (OUTPUT + "stats.c",
      "    if (row->read != CB_TRANSFER_FAILED || row->write != CB_TRANSFER_FAILED)\n",
      "    if (row->read == CB_TRANSFER_OK)\n")),
    ("other-bank-term-lives-on-stale-inputs",
     "A linear term with a bank does not check whether its inputs are fresh: after a thermometer has failed it "
     "goes on with the last value for ever instead of fading, and the box is not reported as degraded",
     ("firmware/terms/columns.c",
      "        if (!signal->fresh) return CB_TERM_MISSING;\n"
      "        const float x =\n",
      "        const float x =\n")),
    ("other-can-field-at-the-end-is-short",
     "A CAN frame whose last byte is the last byte of the field counts as too short: signals at the end of "
     "their frame are never read, become stale, and short_frames rises",
     (SIGNALS + "can.c",
      "        if (field->offset + cb_number_bytes(field->type) > length) {\n",
      "        if (field->offset + cb_number_bytes(field->type) >= length) {\n")),
    ("other-write-of-fewer-registers-is-confirmed",
     "The reply to FC16 is accepted whatever number of registers it confirms: a PLC or gateway that took only a "
     "part of the block counts as having all outputs",
     ("firmware/wire/modbus.c",
      "    return length == 5 && get_u16(pdu + 1) == request->write_start &&\n"
      "           get_u16(pdu + 3) == request->write_count;\n",
      "    return length == 5 && get_u16(pdu + 1) == request->write_start;\n")),
    ("other-step-bound-in-units-not-um",
     "The largest step of the control is taken as a number of increments instead of micrometres: with a scale "
     "below 1 the outputs may be many times further from the applied value than the control accepts, with one "
     "above 1 they move too slowly",
     ("firmware/load/control.c",
      "        if (channel->has_applied) channel->step_um = (float)config->plc.step_units * channel->scale;\n",
      "        if (channel->has_applied) channel->step_um = (float)config->plc.step_units;\n")),
    ("other-changed-beat-behind-a-silence-is-life",
     "Behind a silence the first reading counts as a beat if the heartbeat differs from the one before the "
     "silence: a PLC whose program stopped meanwhile counts as alive for the whole heartbeat timeout, and the "
     "box compensates into it",
     (BOX + "plc.c",
      "    state->beat = true;\n"
      "    if (!first && heartbeat != state->plc_heartbeat) {\n",
      "    const bool changed = heartbeat != state->plc_heartbeat && (state->beat || !first);\n"
      "    state->beat = true;\n"
      "    if (changed) {\n")),
    ("other-fc23-exchange-from-the-new-reading",
     "With FC23 the time of the reading behind the written outputs is taken after the new request's time has "
     "replaced it: the measured exchange is about one period too short, so positions are looked ahead too "
     "little and moving axes are compensated late",
     ("hal/cycle.c",
      "    const int64_t made_from_us = cycle->in.read_ok ? cycle->in.read_us : 0;\n"
      "    const struct cb_block_config *read = &exchange->plc->read, *write = &exchange->plc->write;\n"
      "    cycle->in.read_us = now(hal);\n",
      "    const struct cb_block_config *read = &exchange->plc->read, *write = &exchange->plc->write;\n"
      "    cycle->in.read_us = now(hal);\n"
      "    const int64_t made_from_us = cycle->in.read_ok ? cycle->in.read_us : 0;\n")),
    ("other-row-beside-the-ring-stays-the-last",
     "Once a row has found the ring full, the row beside the ring counts as the run's last one for ever: at the "
     "end an old row is taken behind the newest, so final counters, mode and reason in the statistics are those "
     "of long ago and the record ends with a row from the past",
     (DAEMON + "loop.c",
      "    loop->is_beside = slot < 0;\n",
      "    if (slot < 0) loop->is_beside = true;\n")),
    ("other-other-unit-id-needs-no-restart",
     "A file with another unit id of the PLC is taken in a reload although the connection keeps the old one "
     "until a restart: the log says that the new revision is running, and the box still talks to the old unit",
     (DAEMON + "reload.c",
      "    if (a->transport != b->transport || a->unit != b->unit || a->port != b->port ||\n",
      "    if (a->transport != b->transport || a->port != b->port ||\n")),
    ("other-old-heartbeat-is-resumed",
     "A heartbeat of the PLC in the state file is used whatever its age: after a box was off for minutes the "
     "wrapped count passes for a restart of the PLC, the outputs begin at zero although the PLC holds its "
     "offset, and the axis steps",
     (OUTPUT + "state.c",
      "    if (pause_us < 0 || pause_us > CB_STATE_BEAT_US) return;\n",
      "    if (pause_us < 0) return;\n")),
    ("other-lag-resumed-with-another-tau",
     "The records of the state file are found without their time constant: after a restart all lags of one "
     "input in a bank begin with the memory of the first one, and the thermal model is wrong for hours",
     (OUTPUT + "state.c",
      "           strncmp(record->lag_of, lag->lag_of, CB_NAME_SIZE) == 0 && record->power == lag->power &&\n"
      "           record->tau_s == lag->tau_s;\n",
      "           strncmp(record->lag_of, lag->lag_of, CB_NAME_SIZE) == 0 && record->power == lag->power;\n")),
    ("other-black-box-event-at-the-end-is-cut",
     "A file of the black box that reaches its longest time clears the pending event: an event that came "
     "shortly before has no seconds behind it in any file",
     (OUTPUT + "blackbox.c",
      "    if (error != 0 || last_time(box) == box->event_us + CB_BLACKBOX_AFTER_US) box->word = NULL;\n",
      "    box->word = NULL;\n")),
    ("other-unsent-start-of-a-node-is-done",
     "A start command that the CAN socket refuses counts as sent: a node without a heartbeat timeout stays pre- "
     "operational for the whole run, and its signals are missing",
     (LINUX + "can_source.c",
      "        if (!cb_can_send(&source->can, &frame))\n"
      "            cb_canopen_not_sent(&source->config, source->nodes, &frame);\n",
      "        (void)cb_can_send(&source->can, &frame);\n")),
    ("other-reply-of-another-unit-is-taken",
     "The unit id of a reply is not compared: behind a gateway the registers of another device pass for those "
     "of the PLC",
     (LINUX + "tcp.c",
      "    if (tcp->received[UNIT_OFFSET] == tcp->unit)\n"
      "        answer =\n"
      "            cb_modbus_decode(request, tcp->received + HEADER_BYTES, bytes, registers, &exception);\n",
      "    answer = cb_modbus_decode(request, tcp->received + HEADER_BYTES, bytes, registers, &exception);\n")),
    ("other-dropped-connections-without-a-pause",
     "A dropped connection no longer begins a pause: a PLC or gateway that accepts connections but never "
     "replies is connected anew several times a second without end, which fills its connection table and the "
     "log",
     (LINUX + "link.c",
      "    go_down(link, cause, error_number, now_us);\n"
      "    longer_backoff(link);\n"
      "    if (at_once) begin_attempt(link, now_us);\n",
      "    go_down(link, cause, error_number, now_us);\n"
      "    if (at_once) begin_attempt(link, now_us);\n")),
    ("other-torn-file-replaces-the-good-one",
     "A state, statistics or snapshot file that could not be written completely is renamed into place all the "
     "same: a full disk replaces the good state file by a torn one, and the next start has neither lags nor "
     "probes nor STOPPED",
     (OUTPUT + "output_file.c",
      "    error = cb_output_close(fd, error, durable);\n"
      "    if (error == 0 && rename(temporary, path) != 0) error = errno;\n",
      "    error = cb_output_close(fd, error, durable);\n"
      "    if (rename(temporary, path) != 0 && error == 0) error = errno;\n")),
    ("other-jitter-without-overruns",
     "The lateness of a tick that was due while the cycle before it was still running is not counted: jitter_us "
     "in statistics and snapshot looks well in a run whose cycles overrun",
     (LINUX + "tick.c",
      "    const int64_t due_ns = tick->start_ns + (before + 1) * tick->period_ns;\n"
      "    int64_t now_ns = cb_clock_ns(tick->clock);\n"
      "    tick->worst_ns = now_ns > due_ns ? now_ns - due_ns : 0;\n",
      "    int64_t now_ns = cb_clock_ns(tick->clock);\n"
      "    tick->worst_ns = 0;\n")),
    ("other-limited-step-narrows-as-a-whole-one",
     "A probe whose step step_max_um has cut narrows the covariance as if the whole step had been taken: sigma "
     "in record and snapshot is too small, and the next probes of a model that is far off are outside of the "
     "gate and asked for again instead of being taken",
     ("models/adapt.c",
      "    const float weight = part * (2.0f - part);\n",
      "    const float weight = 2.0f - part;\n")),
    ("other-linear-path-without-its-centre",
     "Folding a network forgets the input centres in the path beside the hidden layer: with linear_weights and "
     "an input_center that is not 0 the outputs are off by a constant",
     ("models/bpnet.c",
      "        linear[j] = source->linear_weights[k * source->inputs + j] * n_scale;\n"
      "        bias = add_product(bias, -linear[j], source->input_offset[j]);\n",
      "        linear[j] = source->linear_weights[k * source->inputs + j] * n_scale;\n")),
    ("other-slope-beyond-the-end-of-a-curve",
     "Beyond the range of a curve the value is held but the slope of its end is still given: the tangent "
     "register makes the control go on along a line that the model does not have",
     ("models/ppoly.c",
      "    const struct cb_curve_value result = {value, outside ? 0.0f : slope, outside};\n",
      "    const struct cb_curve_value result = {value, slope, outside};\n")),
    ("other-blending-slope-without-a-reversal",
     "The slope of the blend between both branches is added also when the reversal is complete: with a backward "
     "branch the tangent is wrong all the time by the lost motion over reversal_mm",
     ("models/direction.c",
      "    const float blending = b > -1.0f && b < 1.0f ?",
      "    const float blending = b >= -1.0f && b <= 1.0f ?")),
    ("other-carry-of-an-output-that-was-stopped",
     "The rest of the way is carried on also when a bound has stopped the output, not only within one unit: "
     "behind writes without a reply, or in a pair whose other motor waits, the carry has grown, and the output "
     "overshoots its target or moves on in HOLD",
     (BOX + "limiter.c",
      "    return cb_abs(rest_um) < unit_um ? rest_um : 0.0f;\n",
      "    return unit_um > 0.0f ? rest_um : 0.0f;\n")),
    ("other-end-of-a-handshake-counts-too",
     "The change of the handshake's channel back to 0 counts as another handshake: the counter has twice the "
     "number of transfers to the NC",
     (BOX + "plc.c",
      "    const bool another = (word & CB_HANDSHAKE_CHANNEL) && (changed & CB_HANDSHAKE_CHANNEL);\n",
      "    const bool another = (changed & CB_HANDSHAKE_CHANNEL) != 0;\n")),
    ("other-doubted-sensor-behind-a-lag-has-no-name",
     "The cause of DEGRADED looks for doubted sensors among the term's own signals only: if the term follows "
     "the sensor by a lag, the detail word, the log and the statistics name the faded term instead of the "
     "sensor that the others contradict",
     (BOX + "cause.c",
      "        const uint8_t index = source_of(box, signals[k]);\n",
      "        const uint8_t index = signals[k];\n")),
    ("other-reset-during-the-nc-alarm",
     "A fault by an alarm of the NC can be reset while the alarm is still there: the mode leaves FAULT for "
     "STANDBY or RAMP although its reason has not gone",
     (BOX + "mode.c",
      "                      !(state->reason == CB_REASON_FOREIGN && e->foreign) &&\n"
      "                      !(state->reason == CB_REASON_NC_ALARM && e->nc_alarm);\n",
      "                      !(state->reason == CB_REASON_FOREIGN && e->foreign);\n")),
    ("other-alarm-outlives-its-handshake",
     "A reload keeps the alarm of the NC also if the new file has no handshake register any more: nothing ever "
     "clears it, and the box waits in STANDBY or FAULT for an alarm that it does not read",
     (BOX + "adopt.c",
      "    if (!fresh->config.plc.has_handshake) fresh->plc.nc_alarm = false;\n",
      "")),
    ("other-stopped-before-a-late-write",
     "A confirmed write of zeros counts as certain zero although an earlier write without a reply may still "
     "take effect: at a stop STOPPED comes at once, and the program ends with exit code 0 while the PLC may yet "
     "take an old offset",
     (BOX + "box.c",
      "    box->life.zero_written = cb_channels_hold_zero(&box->config, box->channels);\n",
      "    box->life.zero_written = cb_channels_all_zero(&box->config, box->channels);\n")),
    ("other-longer-reply-is-taken",
     "A reply to a reading that is longer than its byte count is accepted: a damaged or odd reply of a PLC "
     "passes for a valid one, and odd_replies and invalid_replies stay 0",
     ("firmware/wire/modbus.c",
      "    return length == 2 + bytes && pdu[1] == bytes;\n",
      "    return length >= 2 + bytes && pdu[1] == bytes;\n")),
    ("other-rtu-write-without-reply-was-not-sent",
     "On a serial line a request without a reply keeps the outcome FAILED: the value of such a write is not "
     "among those that the PLC may hold, later outputs may be further from it than the slew rate allows, and "
     "the statistics count it under writes_failed",
     ("firmware/wire/rtu_dialog.c",
      "    ++dialog->requests;\n"
      "    dialog->outcome = CB_TRANSFER_UNKNOWN;\n",
      "    ++dialog->requests;\n")),
    ("other-counter-at-the-end-of-the-other-block",
     "The second block counter of the read block is reserved at the length of the write block: if the blocks "
     "differ in length, a file whose signal lies on the counter is accepted, and one with a signal at the other "
     "place is refused",
     ("firmware/load/registers.c",
      "        loader->scratch->read_user[plc->read.count - 1] = CB_USER_COUNTER;\n",
      "        loader->scratch->read_user[plc->write.count - 1] = CB_USER_COUNTER;\n")),
    ("other-slow-bus-goes-stale-between-readings",
     "The default maximum age of a bus signal is shortened to three readings instead of lengthened: "
     "thermometers that are read every few seconds are stale between two readings, and their terms fade and "
     "return",
     ("firmware/load/signals.c",
      "    if (slots[MAX_AGE] == CB_ABSENT && signal->max_age_ms < three_readings_ms)\n",
      "    if (slots[MAX_AGE] == CB_ABSENT && signal->max_age_ms > three_readings_ms)\n")),
    ("other-watchdog-stays-armed-at-the-end",
     "The hardware watchdog is closed without the byte that disarms it: after a clean stop the machine is reset "
     "some seconds later",
     (DAEMON + "supervise.c",
      "    write_byte(supervise->watchdog_fd, 'V'); /* the device's command for an intended close */\n",
      "")),
    ("other-can-bus-of-a-new-file-is-unknown",
     "Whether the file uses CAN is found out at the start only: after a reload that brings the first CAN "
     "signals the statistics have no member can, and the next reload gets no new filters, so its new CAN "
     "signals are never received",
     (DAEMON + "main.c",
      "    daemon->stats.run.can_used = cb_can_source_used(&daemon->loop.target.can);\n"
      "    cb_row_files_follow(",
      "    cb_row_files_follow(")),
    ("other-refused-function-for-ever",
     "A function that the PLC has once refused stays refused although it answers later: refused_functions in "
     "the statistics and the status line of systemd go on about a limitation that was removed",
     (LINUX + "peer.c",
      "        peer->refused_functions |= bit;\n"
      "    else if (exception == 0)\n"
      "        peer->refused_functions &= ~bit;\n",
      "        peer->refused_functions |= bit;\n")),
    ("other-queue-overflows-add-up",
     "The kernel's total of lost CAN frames is added with every frame, because the last total is not kept: "
     "after one overflow queue_overflows grows without end, and the log reports errors every second",
     (LINUX + "can.c",
      "            can->lost_in_queue = lost;\n",
      "")),
    ("other-probes-from-the-future",
     "A pause below zero is taken as it is for the probes in the state file: after a start with the wall clock "
     "set back neither the pause nor the time until the next probe adds to their covariance, so sigma is too "
     "small and the first probe may be asked for again as an outlier",
     (OUTPUT + "state.c",
      "        if (pause_us < 0) pause_us = CB_STATE_UNKNOWN_US;\n",
      "")),
    ("other-adapt-resume-clamps-gain-by-bias-bound",
     "After a restart or reload the stored gain is forced into the bounds of the bias: a gain beyond the new "
     "gain_max stays, and with bias_max_um 0 the learnt gain is lost",
     ("models/adapt.c",
      "    state->gain = cb_clamp(state->gain, -settings->gain_max, settings->gain_max);\n",
      "    state->gain = cb_clamp(state->gain, -settings->bias_max_um, settings->bias_max_um);\n")),
    ("other-bpnet-linear-path-without-padding",
     "The linear path of a network is taken from behind the hidden units instead of behind the padded ones, so "
     "a network whose number of hidden units is no multiple of 4 gives a wrong value",
     ("models/bpnet.c",
      "sum += dot(w + 1 + units, x, net->inputs);",
      "sum += dot(w + 1 + net->hidden, x, net->inputs);")),
    ("other-velocity-in-deg-per-minute",
     "The velocity of a rotary axis in deg/min is taken as deg/s, so its lead is sixty times too long",
     ("firmware/load/velocity.c",
      "{\"deg\", \"deg/min\", 1.0f / 60.0f}",
      "{\"deg\", \"deg/min\", 1.0f}")),
    ("other-record-rows-under-the-next-header",
     "A reload begins the next record without writing the rows that wait, so rows of the old file stand under "
     "the header of the new one",
     (OUTPUT + "record.c",
      "    if (record->path == NULL) return 0;\n"
      "    cb_record_flush(record);\n",
      "    if (record->path == NULL) return 0;\n")),
    ("other-bus-samples-over-can-samples",
     "In a cycle with samples of CAN and of the bus, those of the bus overwrite those of CAN, and old samples "
     "stand behind them",
     (LINUX + "box_hal.c",
      "cb_sample_ring_take(&target->bus, target->generation, list + count, max - count);",
      "cb_sample_ring_take(&target->bus, target->generation, list, max - count);")),
    ("other-first-measurement-by-hand-ignored",
     "If there was no file of measurements at the start, the first one that appears counts as known and its "
     "measurement is not taken",
     (LINUX + "hand.c",
      "\"%s: %s, so no measurement is taken\", hand->path, why);\n"
      "    }\n"
      "    hand->begun = true;\n",
      "\"%s: %s, so no measurement is taken\", hand->path, why);\n"
      "        hand->begun = true;\n"
      "    }\n")),
    ("other-ppoly-index-off-by-two",
     "The computed span index is accepted for breaks that are off by up to two spans, but only one is "
     "corrected: a curve with uneven breaks takes the piece beside the right one for a cycle after a start or "
     "a jump of the axis, and in every cycle for the slope of a tangent",
     ("models/ppoly.c",
      "if (!(cb_abs(off) < 1.0f)) return;",
      "if (!(cb_abs(off) < 2.0f)) return;")),
    ("other-adapt-asked-probe-counts-as-measured",
     "A probe that is only asked to be repeated, or is refused, already counts as the place of the last "
     "measurement: sigma_um of the adapted term is too small there, and the repetition is weighted too little",
     ("models/adapt.c",
      "    if (cb_adapt_was_taken(outcome))\n"
      "        remember(state, own);\n"
      "    else\n"
      "        state->bias_d = narrow_d;\n"
      "    return outcome;\n",
      "    if (!cb_adapt_was_taken(outcome)) state->bias_d = narrow_d;\n"
      "    remember(state, own);\n"
      "    return outcome;\n")),
    ("other-bank-lag-from-unheld",
     "The lags of a trained bank start each step from the raw input and not from the one held at its range: "
     "with an input beyond the margin they go on past the bound, and the term's value with them",
     (SIGNALS + "bank.c",
      "const float from = held(config, bank, i, state->value[inputs[i]]);",
      "const float from = state->value[inputs[i]];")),
    ("other-sensors-second-doubt-too-early",
     "Behind a doubt only the doubted sensor's time begins anew: a healthy one that the faulty one had accused "
     "is doubted in the next pass, a second later",
     (SIGNALS + "sensors.c",
      "    for (unsigned j = 0; j < count; ++j) {\n"
      "        if (!is_doubted(state, j)) state->us[j] = 0;\n"
      "    }\n"
      "    state->doubted |= 1u << state->worst;\n",
      "    state->us[state->worst] = 0;\n"
      "    state->doubted |= 1u << state->worst;\n")),
    ("other-grid-ignores-last-break",
     "Two curves of one signal whose breaks differ only in the last one share a grid: the second one ends "
     "where the first one does, held too early or extrapolated beyond its own end",
     ("firmware/terms/derive.c",
      "for (unsigned i = 0; i <= curve->spans; ++i) {",
      "for (unsigned i = 0; i < curve->spans; ++i) {")),
    ("other-quantisation-of-negative-scale",
     "With a negative scale the allowance of one raw unit is subtracted from the permitted change: a slow "
     "sensor with max_rate_per_s is refused as too fast at each step of its last digit",
     ("firmware/config/derive.c",
      "cb_number_is_integer(signal->type) ? cb_abs(signal->scale) : 0.0f;",
      "cb_number_is_integer(signal->type) ? signal->scale : 0.0f;")),
    ("other-reload-invents-a-probe",
     "A reload that gives an adapted term another signal for its count compares the first count of that signal "
     "with the last one of the old signal, and takes a measurement that nobody made",
     (BOX + "adopt.c",
      "    const struct cb_signal_config *count_a = &fresh->config.signals[a->signals[1]];\n"
      "    const struct cb_signal_config *count_b = &old->config.signals[b->signals[1]];\n"
      "    struct cb_probe_state *probe = &fresh->probes[i];\n"
      "    if (!same_name(fresh->config.outputs[a->output].name, old->config.outputs[b->output].name))\n"
      "        return;\n"
      "    cb_probe_resume(&fresh->config, i, &old->probes[k], probe);\n"
      "    probe->counted = old->probes[k].counted && same_name(count_a->name, count_b->name);\n",
      "    struct cb_probe_state *probe = &fresh->probes[i];\n"
      "    if (!same_name(fresh->config.outputs[a->output].name, old->config.outputs[b->output].name))\n"
      "        return;\n"
      "    cb_probe_resume(&fresh->config, i, &old->probes[k], probe);\n"
      "    probe->counted = old->probes[k].counted;\n")),
    ("other-unapplied-survives-standby",
     "The time for which the PLC applied another value stays while the box is not ACTIVE: when it is enabled "
     "again it reports UNAPPLIED at once, although the PLC follows",
     (BOX + "applied.c",
      "    state->outside_us = judged ? outside_us(state->outside_us, inside, elapsed_us, most_us) : 0;\n",
      "    if (judged)\n"
      "        state->outside_us = outside_us(state->outside_us, inside, elapsed_us, most_us);\n")),
    ("other-read-back-without-room-for-the-write",
     "The read-back of each second needs only as much time as one exchange is left, not that of the write "
     "behind it too: with a PLC whose replies take half of the period, the write of that cycle is late or "
     "missing",
     ("hal/cycle.c",
      "return now(exchange->hal) + cycle->exchange_us <= exchange->deadline_us - cycle->exchange_us;",
      "return now(exchange->hal) + cycle->exchange_us <= exchange->deadline_us;")),
    ("other-record-goes-on-with-a-later-time",
     "A record whose last row is later than the wall clock is put aside, but the new file's time_s goes on "
     "behind that row instead of at 0",
     (OUTPUT + "record.c",
      "    record->before_unix_us = record->whole_size = 0;\n",
      "    record->whole_size = 0;\n")),
    ("other-archive-rotates-beneath-a-compression",
     "A record that is put aside while an older one is being compressed changes the numbers beneath it: the "
     "compressed file takes the place of the newest one, whose rows are lost",
     (OUTPUT + "archive.c",
      "    const bool limited = archive->most_bytes > 0;\n"
      "    cb_archive_finish(archive);\n",
      "    const bool limited = archive->most_bytes > 0;\n")),
    ("other-bus-report-is-dropped",
     "Behind a full ring the state of the bus is reported with its next turn",
     (LINUX + "bus.c",
      "if (back || !open || bus->untold) report(bus);",
      "if (back || !open) report(bus);")),
    ("other-reading-of-before-a-suspend",
     "A suspend between the exchange and the step leaves the step what was read before it",
     ("hal/cycle.c",
      "    if (waited_us > clock_us(box)) forget_exchange(cycle);\n",
      "")),
    ("other-bus-report-is-never-told",
     "What the slow bus does is never told to the statistics",
     (LINUX + "bus.c",
      "    cb_ring_publish(&bus->ring);",
      "    ;")),
    ("other-event-time-in-microseconds",
     "The wall clock of an event is in microseconds",
     (OUTPUT + "events.c",
      "    cb_writer_thousandths(&json, \"unix_s\", (double)now.unix_us * 1e-6);",
      "    cb_writer_thousandths(&json, \"unix_s\", (double)now.unix_us + 1e-6);")),
    ("other-step-time-plus-a-thousand",
     "The histogram of steps adds a thousand nanoseconds to each, in the place of a factor",
     (OUTPUT + "stats.c",
      "    cb_histogram_add(&stats->step, row->step_us * 1000);",
      "    cb_histogram_add(&stats->step, row->step_us + 1000);")),
    ("other-compression-ends-with-the-first",
     "Behind the first compressed file the next one is not looked for",
     (OUTPUT + "archive.c",
      "    archive->number = error == 0 ? archive->number + 1 : 0;",
      "    archive->number = error == 0 ? archive->number - 1 : 0;")),
    ("other-exception-without-its-code",
     "The counters of exceptions have no code as their name",
     (OUTPUT + "stats_json.c",
      "        snprintf(name, sizeof name, \"%u\", code);",
      "        ;")),
    ("other-bank-slope-in-its-range-alone-is-lost",
     "The slope of a bank is left out where its input is inside of its range",
     ("firmware/terms/columns.c",
      "    if (bank->unlagged && x == used) unlagged_slope(pass, term, input, x, slope);",
      "    if (bank->unlagged && x != used) unlagged_slope(pass, term, input, x, slope);")),
    ("other-late-turn-copies-wrong-end",
     "When a turn of late writes ends, the upper end kept for the next turn is the lowest late value instead "
     "of the highest",
     (BOX + "limiter.c",
      "state->older_max_um = state->late_max_um;",
      "state->older_max_um = state->late_min_um;")),
    ("other-pair-gives-way-by-own-limit",
     "The target of a pair's first channel is held within its own limit plus the difference, not within that "
     "of the other channel",
     (BOX + "limiter.c",
      "const float a_most = config->channels[pair->b].top_um + most;",
      "const float a_most = config->channels[pair->a].top_um + most;")),
    ("other-deadband-holds-what-rounds-to-zero",
     "A demand that rounds to zero without being exactly zero leaves the old output standing inside the "
     "deadband",
     (BOX + "channels.c",
      "return cb_channel_nearest(channel, wanted_um) == 0.0f ? wanted_um : state->output_um;",
      "return wanted_um == 0.0f ? wanted_um : state->output_um;")),
    ("other-standing-heartbeat-is-a-restart",
     "Without contact a PLC heartbeat that merely stands counts as behind the last one, so the PLC passes for "
     "restarted and the outputs start at zero",
     (BOX + "plc.c",
      "(uint16_t)(state->plc_heartbeat - heartbeat - 1) < 0x7FFF",
      "(uint16_t)(state->plc_heartbeat - heartbeat) < 0x7FFF")),
    ("other-good-cycles-need-no-row",
     "Cycles in time need not be consecutive to forgive an overrun, so regular overruns never become a fault",
     (BOX + "box.c",
      "    if (missed_ticks > 0) {\n"
      "        box->life.good_cycles = 0;\n",
      "    if (missed_ticks > 0) {\n")),
    ("other-jump-keeps-the-streak",
     "After a jump of the clock a plain PLC signal goes on by the short path and is never known again: one "
     "missed reading makes it stale, and banks no longer follow it",
     (SIGNALS + "signals.c",
      "        state->known = false;\n"
      "        state->streak = 0;\n",
      "        state->known = false;\n")),
    ("other-lag-beyond-its-range-goes-on",
     "A lag whose state is outside min ... max, after a reload or restart with a narrower range, is used "
     "unclamped from the second reading on",
     (SIGNALS + "lags.c",
      "if (signal->streak != 0 && state->value == state->lag.hi) state->streak = CB_STREAK_GOES;",
      "if (signal->streak != 0) state->streak = CB_STREAK_GOES;")),
    ("other-bus-reads-over-a-gap",
     "Registers of a module that have one register without a signal between them are read in one request, "
     "which modules refuse",
     (SIGNALS + "bus_turns.c",
      "signal->reg > end) return false;",
      "signal->reg > end + 1) return false;")),
    ("other-serial-pause-without-end",
     "The pause between attempts to open a serial device doubles without a maximum",
     (LINUX + "serial.c",
      "serial->backoff_us = doubled > MAX_BACKOFF_US ? MAX_BACKOFF_US : doubled;",
      "serial->backoff_us = doubled;")),
    ("other-probe-from-the-future-has-no-age",
     "Behind a wall clock that went back, the uncertainty of an adapted term does not grow by the pause of a "
     "restart",
     (OUTPUT + "state.c",
      "if (pause_us < 0) pause_us = CB_STATE_UNKNOWN_US;",
      "if (pause_us < 0) pause_us = 0;")),
    ("other-up-to-leaves-its-bucket-out",
     "The snapshot's counts of times up to a bound lack those of the bound's own bucket",
     (OUTPUT + "histogram.c",
      "for (unsigned i = 0; i <= last; i++) seen += histogram->buckets[i];",
      "for (unsigned i = 0; i < last; i++) seen += histogram->buckets[i];")),
    ("other-turned-pair-counts-as-gone",
     "A pair whose two channels are named in the other order by the new file counts as gone, so the file is "
     "pending instead of taken",
     (DAEMON + "widening.c",
      "        if ((strcmp(a, one) == 0 && strcmp(b, other) == 0) ||\n"
      "            (strcmp(a, other) == 0 && strcmp(b, one) == 0))\n",
      "        if (strcmp(a, one) == 0 && strcmp(b, other) == 0)\n")),
    ("other-hung-loop-is-fed",
     "The hardware watchdog is fed also when no cycle was completed since the last feed",
     (DAEMON + "supervise.c",
      "        supervise->watchdog_steps = steps;\n",
      "")),
    ("other-systemd-is-not-told",
     "NOTIFY_SOCKET is set, and no socket is opened",
     (DAEMON + "supervise.c",
      "        supervise->notify_fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);\n",
      "")),
    ("other-status-of-systemd-stays",
     "systemctl status has the first mode for ever",
     (DAEMON + "main.c",
      "    if (daemon->stats.rows == 0 || (daemon->status_reported && same)) return;",
      "    if (daemon->stats.rows == 0 || daemon->status_reported || same) return;")),
    ("other-status-has-another-revision",
     "systemctl status has the revision of the file before",
     (DAEMON + "main.c",
      "                        (unsigned)config_of(daemon, row->generation)->revision);\n"
      "    if (refused",
      "                        (unsigned)config_of(daemon, row->generation + 1)->revision);\n"
      "    if (refused")),
    ("other-watchdog-is-not-fed",
     "the hardware watchdog is fed once",
     (DAEMON + "supervise.c",
      "        supervise->watchdog_fed_us = now_us;\n"
      "        write_byte",
      "        supervise->watchdog_fed_us = INT64_MAX / 2;\n"
      "        write_byte")),
    ("other-stop-is-not-told",
     "systemd hears of no stop, and ends a long ramp",
     (DAEMON + "stop.c",
      "        if (!told) told = cb_supervise_stopping(stop->supervise, most_us);\n",
      "        told = true;\n")),
    ("other-snapshot-lists-one-term-more",
     "the list of terms is one too long",
     (OUTPUT + "snapshot.c",
      "    for (unsigned i = 0; i < config->outputs_count; i++) {\n"
      "        cb_writer_object(json, NULL);",
      "    for (unsigned i = 0; i <= config->outputs_count; i++) {\n"
      "        cb_writer_object(json, NULL);")),
    ("other-record-has-a-sigma-of-each-bank",
     "a column for a term that states no sigma",
     (OUTPUT + "row_sigma.c",
      "config->banks[term->as.linear.bank].model != 0;",
      "config->banks[term->as.linear.bank].model != 1;")),
    ("other-slow-bus-never-waits",
     "its thread works without a pause",
     (LINUX + "bus.c",
      "    if (!cb_bus_turns_next(&bus->turns, now_us, &unit, &request)) return false;",
      "    if (!cb_bus_turns_next(&bus->turns, now_us, &unit, &request)) return true;")),
    ("other-snapshot-has-no-bus-at-first",
     "the bus is in the snapshot behind the first statistics alone",
     (DAEMON + "main.c",
      "    run->bus = &daemon->bus;\n",
      ""),
     (DAEMON + "main.c",
      "    run->reload_pending = daemon->reload.pending;\n",
      "    run->bus = &daemon->bus;\n"
      "    run->reload_pending = daemon->reload.pending;\n")),
    ("other-snapshot-applies-its-output",
     "applied_um is what the box writes, not what the PLC applies",
     (OUTPUT + "snapshot.c",
      "one->has_applied ? (double)channel->applied_um : (double)NAN",
      "one->has_applied ? (double)channel->output_um : (double)NAN")),
    ("other-cause-has-value-and-bound-exchanged",
     "the members value and bound of a cause are exchanged",
     (OUTPUT + "snapshot.c",
      "        cb_writer_number(json, \"value\", (double)cause->cause.value);",
      "        cb_writer_number(json, \"value\", (double)cause->cause.bound);")),
    ("other-snapshot-sigma-is-that-of-the-output-before",
     "sigma_um of an adapted term is that of its model",
     (OUTPUT + "snapshot.c",
      "    cb_writer_number(json, \"sigma_um\", sigma_of(row, term->first_output));",
      "    cb_writer_number(json, \"sigma_um\", sigma_of(row, adapt->output));")),
    ("other-sum-of-times-in-ns",
     "the sum of times is in ns, and all others in µs",
     (OUTPUT + "snapshot.c",
      "\"sum\", times->sum_ns * 1e-3",
      "\"sum\", times->sum_ns")),
    ("other-ceiling-has-one-number",
     "the rate of the site's ceiling is shown as its size",
     (OUTPUT + "stats_json.c",
      "\"um_per_s\", (double)run->ceiling.um_per_s",
      "\"um_per_s\", (double)run->ceiling.um")),
    ("other-history-by-the-clock-of-the-boot",
     "changes of the mode are reported by the time since the boot",
     (OUTPUT + "stats_json.c",
      "(double)(change->time_us - stats->first_us) * 1e-6",
      "(double)change->time_us * 1e-6")),
    ("other-bus-connects-are-its-failures",
     "connects of the bus counts the failed ones",
     (OUTPUT + "stats_bus.c",
      "\"connects\", now->connects",
      "\"connects\", now->failures")),
    ("other-event-has-crc-of-an-earlier-file",
     "behind a reload events have the check sum of the file before",
     (OUTPUT + "events.c",
      "snprintf(crc, sizeof crc, \"%08x\", (unsigned)events->crc32);",
      "static uint32_t first; if (first == 0) first = events->crc32; "
      "snprintf(crc, sizeof crc, \"%08x\", (unsigned)first);")),
    ("other-mode-event-has-no-cause",
     "events of the mode leave the cause out",
     (OUTPUT + "events.c",
      "    cb_cause_text(&row->cause, cause);",
      "    cause[0] = 0;")),
    ("other-log-keeps-the-first-reason",
     "another reason of the same mode has no line",
     (DAEMON + "log.c",
      "row->mode == log->mode && row->reason == log->reason;",
      "row->mode == log->mode;")),
    ("other-log-shows-the-mode-before",
     "a line about the mode has the reason of the one before",
     (DAEMON + "log.c",
      "                   cb_reason_text(row->reason), text[0]",
      "                   cb_reason_text(log->reason), text[0]")),
    ("other-last-snapshot-says-it-runs",
     "the last snapshot of a run does not say that it has ended",
     (OUTPUT + "snapshot.c",
      "\"finished\", run->finished",
      "\"finished\", false")),
    ("other-node-state-of-the-one-before",
     "a node is shown with the state of the first one",
     (OUTPUT + "stats_can.c",
      "cb_canopen_state_word(node->state)",
      "cb_canopen_state_word(row->can.nodes[config->nodes_count - 1 - i].state)")),
    ("other-unsigned-numbers-with-swapped-words",
     "a uint32cdab is read as uint32",
     ("firmware/wire/number.c",
      "            return (float)wide(r[1], r[0]);",
      "            return (float)wide(r[0], r[1]);")),
    ("other-each-frame-is-a-short-one",
     "a CAN frame that is long enough is counted as a short one",
     (LINUX + "can_source.c",
      "!= CB_CAN_SHORT) continue;",
      "== CB_CAN_SHORT) continue;")),
    ("other-cause-says-minus-zero",
     "the sentence of a cause says -0",
     (OUTPUT + "cause_words.c",
      "(double)cause->cause.value + 0.0",
      "(double)cause->cause.value")),
    ("other-unread-size-removes-all-records",
     "A record whose size cannot be read once is removed, and so are all that are newer",
     (OUTPUT + "archive.c",
      "        if (bytes < 0 || cb_rotate_remove(archive->path, last) != 0) return;\n"
      "        all -= bytes;",
      "        cb_rotate_remove(archive->path, last);\n"
      "        all -= bytes;")),
    ("other-black-box-number-of-an-unread-folder",
     "The black box counts its files anew where it cannot read its folder to the end",
     (OUTPUT + "blackbox.c",
      "    if (lstat(path, &there) != 0) return errno == ENOENT ? 0 : errno;",
      "    if (lstat(path, &there) != 0) return 0;")),
    ("other-resume-edge-while-signal-missing",
     "After a loss, a rising enable counts as the permission although an essential signal is still missing, "
     "writes are unconfirmed or the clock jumped, so the box starts to compensate by itself when all is well "
     "again",
     (BOX + "mode.c",
      "    if (healthy(events) && events->enable && !state->enable_was) state->lost = false;\n",
      "    const bool contact = !events->loss && events->plc_ok && events->heartbeat_ok;\n"
      "    if (contact && events->enable && !state->enable_was) state->lost = false;\n")),
    ("other-late-turns-pass-without-service",
     "The turns of late writes run down while nothing is sent or a write failed and the PLC serves no request, "
     "so a write without a reply is forgotten although it may still take effect after a long silence",
     (BOX + "limiter.c",
      "    const uint32_t served_us = result == CB_TRANSFER_OK ? elapsed_us : lived_us;\n",
      "    const uint32_t served_us = result != CB_TRANSFER_UNKNOWN ? elapsed_us : lived_us;\n")),
    ("other-foreign-bound-is-a-sum",
     "An applied value counts as foreign only beyond error_um plus the largest sent value instead of beyond "
     "the larger of the two, so a foreign offset between them is no fault",
     (BOX + "applied.c",
      "    const bool bounded = cb_abs(um) <= cb_max(channel->error_um, largest_um) + unit_um;\n",
      "    const bool bounded = cb_abs(um) <= channel->error_um + largest_um + unit_um;\n")),
    ("other-too-fast-value-refreshes-age",
     "The time of the last accepted value is set before the rate is checked, so a value that was rejected as "
     "too fast keeps the old value fresh, and the lost signal is never noticed",
     (SIGNALS + "signals.c",
      "    const int64_t elapsed_us = time_us - state->time_us;\n"
      "    const float change = value - state->value;\n"
      "    if (state->known) {\n",
      "    const int64_t elapsed_us = time_us - state->time_us;\n"
      "    const float change = value - state->value;\n"
      "    state->time_us = time_us;\n"
      "    if (state->known) {\n"),
     (SIGNALS + "signals.c",
      "    state->value = inside;\n"
      "    state->time_us = time_us;\n"
      "    state->refusal = CB_CAUSE_NONE;\n",
      "    state->value = inside;\n"
      "    state->refusal = CB_CAUSE_NONE;\n")),
    ("other-prediction-clamped-without-center",
     "The prediction of a doubted or stale sensor, which is relative to its center, is clamped to the absolute "
     "range of the signal, so with a min of 0 it never falls below the center and its lags follow a wrong "
     "temperature",
     (SIGNALS + "sensors.c",
      "    state->away[at->j] = cb_clamp(state->away[at->j] - residual / at->own,\n"
      "                                  at->limits->min - at->center, at->limits->max - at->center);\n",
      "    state->away[at->j] = cb_clamp(state->away[at->j] - residual / at->own, at->limits->min,\n"
      "                                  at->limits->max);\n")),
    ("other-shared-register-of-other-type",
     "Two signals may share a register when their types have the same width but are different numbers (int16 "
     "and uint16, int32 and float32), so a file with such a mistake is accepted and one of them is read "
     "wrongly",
     ("firmware/load/registers.c",
      "    return signal->reg == first && signal->type == type;\n",
      "    return signal->reg == first &&\n"
      "           cb_number_registers(signal->type) == cb_number_registers(type);\n")),
    ("other-same-probe-for-every-doubt",
     "Each new doubt on the serial line uses the same probe as the one before, so a late reply to a second "
     "probe of the earlier doubt ends the new doubt too early, and a stale reply is then taken for a new one",
     ("firmware/wire/rtu_dialog.c",
      "    dialog->probe ^= 1;\n",
      "")),
    ("other-short-silences-at-19200",
     "The fixed short silences apply at 19200 baud too, where the standard asks for 1.5 and 3.5 characters, so "
     "frames follow each other too closely and small gaps count as an end",
     ("firmware/wire/rtu_line.c",
      "    if (line->baud > SHORT_SILENCES_ABOVE_BAUD)\n",
      "    if (line->baud >= SHORT_SILENCES_ABOVE_BAUD)\n")),
    ("other-event-counted-before-written",
     "The size of the events file grows before the write has succeeded, so a full disk leaves the torn line "
     "there, filled up with zero bytes, and the next event is joined to it",
     (OUTPUT + "events.c",
      "    if (cb_output_write(events->fd, line, bytes) == bytes) {\n"
      "        events->bytes += (int64_t)bytes;\n"
      "        return 0;\n"
      "    }\n"
      "    error = errno;\n",
      "    events->bytes += (int64_t)bytes;\n"
      "    if (cb_output_write(events->fd, line, bytes) == bytes) return 0;\n"
      "    error = errno;\n")),
    ("other-leaving-needs-both",
     "A connection that the box leaves behind its last write ends only if the PLC has closed its side and the "
     "time is over, so a PLC that never closes is never connected again",
     (LINUX + "link.c",
      "    if (!read_off(link->fd) && now_us - link->since_us <= LEAVE_TIMEOUT_US) return;\n",
      "    if (!read_off(link->fd) || now_us - link->since_us <= LEAVE_TIMEOUT_US) return;\n")),
    ("other-can-nodes-kept-at-reload",
     "A reload with other CANopen nodes on the same interface keeps the states of the old nodes at the same "
     "places, so a new node may get no start command and shows the state of another one",
     (LINUX + "can_source.c",
      "    const bool same = memcmp(&source->config, &config->can, sizeof config->can) == 0;\n"
      "    const bool moves",
      "    const bool moves"),
     (LINUX + "can_source.c",
      "    if (!same) cb_canopen_start(source->nodes);\n",
      "    if (moves) cb_canopen_start(source->nodes);\n")),
    ("other-watchdog-looks-at-notify-steps",
     "The hardware watchdog compares the cycles with those of systemd's last feed, so without systemd's "
     "watchdog it is fed on while the loop hangs",
     (DAEMON + "supervise.c",
      "    if (is_due(steps, supervise->watchdog_steps, now_us, supervise->watchdog_fed_us,\n",
      "    if (is_due(steps, supervise->notify_steps, now_us, supervise->watchdog_fed_us,\n")),
    ("other-compressed-source-left-open",
     "The plain file of a record that was compressed stays open, so each rotation leaks a descriptor and the "
     "removed file keeps its room on the disk",
     (OUTPUT + "compress.c",
      "    if (bytes == 0) error = finish();\n"
      "    cb_compress_abandon();\n"
      "    return error;\n",
      "    if (bytes == 0) return finish();\n"
      "    cb_compress_abandon();\n"
      "    return error;\n")),
    ("other-rtu-retry-takes-the-reserve",
     "A repeated reading on a serial line may use the time that is reserved for the write, so the write of "
     "that cycle is not sent",
     ("firmware/wire/rtu_dialog.c",
      "    if (again) return dialog->again_until_us - now_us >= all_us(dialog, dialog->doubtful);\n",
      "    if (again) return dialog->deadline_us - now_us >= all_us(dialog, dialog->doubtful);\n")),
    ("other-record-forgets-torn-line",
     "If the rest of a torn row could not be ended or cut off and the next attempt writes nothing, the record "
     "forgets that there is one, and the next row is glued to the torn one",
     (OUTPUT + "record.c",
      "    record->is_torn |= done > 0;",
      "    record->is_torn = done > 0;")),
    ("other-reload-keeps-old-adapt-target",
     "After a reload with narrower bounds an adapted term keeps moving to (or stays at) the bias and gain of "
     "the old bounds until the next probe is taken",
     (BOX + "adopt.c",
      "    fresh->terms[index].adapted = old->terms[was].adapted;\n"
      "    fresh->terms[index].adapted.to_bias_um = probe->filter.bias_um;\n"
      "    fresh->terms[index].adapted.to_gain = probe->filter.gain;\n",
      "    fresh->terms[index].adapted = old->terms[was].adapted;\n")),
    ("other-foreign-count-kept-by-bounded-value",
     "An applied value that is not the box's but is within error_um no longer ends a series of far-off "
     "readings, so two far-off readings that are not successive are a FOREIGN fault, and the fault cannot be "
     "reset while the PLC applies such a value",
     (BOX + "applied.c",
      "    if (bounded || inside)\n"
      "        state->beyond = 0;\n"
      "    else if (state->beyond < CB_BEYOND_READINGS)\n"
      "        ++state->beyond;\n",
      "    if (inside)\n"
      "        state->beyond = 0;\n"
      "    else if (!bounded && state->beyond < CB_BEYOND_READINGS)\n"
      "        ++state->beyond;\n")),
    ("other-bank-lags-follow-doubted-reading",
     "The lags of a bank move towards what a doubted sensor reads instead of towards what the other sensors "
     "predict for it",
     (SIGNALS + "bank.c",
      "        const float to = held(config, bank, i, cb_signal_remembered(signal));\n",
      "        const float to = held(config, bank, i, signal->value);\n")),
    ("other-slope-stays-without-position",
     "While the position of a tangent is missing, the channel keeps its last slope instead of letting it go to "
     "zero",
     (BOX + "tangent.c",
      "        slope->wanted_um = 0.0f;\n"
      "        if (!signals[signal].fresh) continue;\n",
      "        if (!signals[signal].fresh) continue;\n")),
    ("other-unopenable-measured-file-told-for-ever",
     "A file of --measured that cannot be opened is looked at, and complained about, twice a second for ever "
     "instead of once",
     (LINUX + "hand.c",
      "        hand->known = file;\n"
      "        if (read_text(hand, text, &why) >= 0)",
      "        if (read_text(hand, text, &why) >= 0)")),
    ("other-suspend-keeps-slow-signals",
     "After a forward jump of the clock by more than five periods (suspend, overload) the signals are not "
     "forgotten, so a thermometer with a long max_age_ms stays fresh and its terms go on with the value from "
     "before. Promised (reason 6, faults.md): all values are stale until the next reading",
     (BOX + "box.c",
      "    cb_signals_forget(&box->config, box->signals, &box->counters);\n"
      "}",
      "    if (gap_us < 0) cb_signals_forget(&box->config, box->signals, &box->counters);\n"
      "}")),
    ("other-enable-edge-during-outage-permits",
     "A rising edge of enable ends the need for permission even while an essential signal is missing or no "
     "write is confirmed. When the input comes back later the box goes ACTIVE by itself, by the level of "
     "enable (faults.md, 'Permission': a new edge permits it when no input is missing)",
     (BOX + "mode.c",
      "    if (healthy(events) && events->enable && !state->enable_was) state->lost = false;",
      "    if (events->plc_ok && events->heartbeat_ok && events->enable && !state->enable_was)\n"
      "        state->lost = false;")),
    ("other-late-turns-accumulate",
     "At the end of a turn the late writes of the turn before are kept too. While now and then a write has no "
     "reply, the oldest late value never leaves the interval, and an output stays within 2 P s of it for ever, "
     "in RAMP too (limiter.c 'Arrival', decision 3 'Turns': it moves on after two turns at the latest)",
     (BOX + "limiter.c",
      "    state->older_min_um = state->late_min_um;\n"
      "    state->older_max_um = state->late_max_um;\n",
      "    state->older_min_um = cb_min(state->older_min_um, state->late_min_um);\n"
      "    state->older_max_um = cb_max(state->older_max_um, state->late_max_um);\n")),
    ("other-probe-at-the-wrap-of-its-count-is-lost",
     "A probe whose count wraps from 65535 to 0 (or over it by a larger rise) counts as one that fell, so it "
     "is only a reference and not taken; no counter shows it (coefficient-file.md, adapt: the count wraps; "
     "only a fall by less than 32768 began anew)",
     (BOX + "probes.c",
      "    if (!counted || rise == 0 || rise > INT16_MAX) return false;",
      "    if (!counted || now <= was || rise > INT16_MAX) return false;")),
    ("other-new-doubt-restarts-trust-of-others",
     "When a sensor becomes doubted, the time for which an already doubted one has agreed again is cleared "
     "too, so its trust returns late (six sensors or more). coefficient-file.md, after_s: it is trusted after "
     "ten times as long; only a comparison beyond the threshold or without a value begins anew",
     (SIGNALS + "sensors.c",
      "    for (unsigned j = 0; j < count; ++j) {\n"
      "        if (!is_doubted(state, j)) state->us[j] = 0;\n"
      "    }\n",
      "    for (unsigned j = 0; j < count; ++j) state->us[j] = 0;\n")),
    ("other-bank-remembers-what-a-doubted-sensor-reads",
     "The lags of a bank move towards the prediction for a doubted sensor, but each step begins at its "
     "reading. So they settle half way between the reading and the prediction, for hours after the doubt "
     "(sensors.md: lags of banks follow what the other sensors predict)",
     (SIGNALS + "bank.c",
      "        state->value[inputs[i]] = cb_signal_remembered(signal);",
      "        state->value[inputs[i]] = signal->value;")),
    ("other-silent-bus-module-is-asked-for-its-other-block",
     "After a turn without a reply only that turn waits for every_ms, not the other turns of the same module. "
     "A late reply then passes for that of another block of equal length, and its numbers go to the wrong "
     "signals (promises.md: on a bus none does that is late by up to every_ms)",
     (SIGNALS + "bus_turns.c",
      "    const uint8_t unit = turns->turns[turns->current].unit;\n"
      "    const int64_t until_us = now_us + turns->every_us;\n"
      "    for (unsigned i = 0; i < turns->count; ++i) {\n"
      "        struct cb_bus_turn *turn = &turns->turns[i];\n"
      "        if (turn->unit == unit && turn->due_us < until_us) turn->due_us = until_us;\n"
      "    }\n",
      "    struct cb_bus_turn *turn = &turns->turns[turns->current];\n"
      "    const int64_t until_us = now_us + turns->every_us;\n"
      "    if (turn->due_us < until_us) turn->due_us = until_us;\n")),
    ("other-state-stopped-without-the-plc",
     "The last state file takes 'the loop has stopped' for 'the run ended STOPPED'. A run behind a crash that "
     "never reached the PLC then leaves a file by which the next start needs no permission, although no PLC "
     "confirmed STOPPED",
     (DAEMON + "main.c",
      "    daemon->state.stopped = cb_state_ended_stopped(daemon->loop.box);\n",
      "    daemon->state.stopped = daemon->loop.stopped;\n")),
    ("other-stop-times-of-the-first-box",
     "The time that a stop may take is always computed from the first box, which behind one reload is the "
     "spare one. If the new file ramps slower, the loop has to quit in the middle of the ramp to zero, "
     "with exit code 1",
     (DAEMON + "stop.c",
      "            const int64_t longest_us = cb_box_stop_us(cb_loop_box(stop->loop)) + MARGIN_US;\n",
      "            const int64_t longest_us = cb_box_stop_us(&stop->loop->boxes[0]) + MARGIN_US;\n")),
    ("other-record-first-rows-behind-rotation-not-synced",
     "Whether rows are the first of their file is asked before the full file is replaced, so the first rows "
     "behind a rotation by size are not synced. A power cut soon afterwards leaves a file without rows, and "
     "time_s begins at 0",
     (OUTPUT + "record.c",
      "    const int64_t bytes = record->whole_size + (int64_t)record->used;\n"
      "    if (bytes > cb_archive_piece(&record->archive) && !record->is_stream) another_file(record);\n"
      "    const bool first = record->whole_size == (int64_t)record->header_used;\n",
      "    const int64_t bytes = record->whole_size + (int64_t)record->used;\n"
      "    const bool first = record->whole_size == (int64_t)record->header_used;\n"
      "    if (bytes > cb_archive_piece(&record->archive) && !record->is_stream) another_file(record);\n")),
    ("other-pending-line-remembered-behind-the-take-over",
     "When a pending file is taken, the daemon still remembers that its line was logged. If the same text "
     "comes again later, behind another file, it is pending without a line in the log and without an event",
     (DAEMON + "reload.c",
      "    reload->offered = reload->pending = reload->pending_logged = false;\n",
      "    reload->offered = reload->pending = false;\n")),
    ("other-ceiling-lowers-of-a-file-that-does-not-run",
     "ceiling.lowers of the statistics is that of the file read last instead of the running one: behind a "
     "refused file it becomes empty, with a pending file it names channels of limits that are not in use",
     (DAEMON + "main.c",
      "    run->rows_lost = cb_ring_lost(&daemon->loop.ring) - (daemon->took_beside ? 1 : 0);\n"
      "    run->lowered = daemon->reload.lowered;\n",
      "    run->rows_lost = cb_ring_lost(&daemon->loop.ring) - (daemon->took_beside ? 1 : 0);\n"
      "    run->lowered = daemon->reload.loaded.lowered;\n")),
    ("other-refused-watchdog-message-counts-as-sent",
     "A WATCHDOG=1 that systemd's full queue refuses counts as sent. It is not repeated within 50 ms but half "
     "of WatchdogSec later, when the time of systemd is just over",
     (DAEMON + "supervise.c",
      "    if (is_due(steps, supervise->notify_steps, now_us, supervise->notify_fed_us,\n"
      "               supervise->notify_us) &&\n"
      "        notify(supervise, \"WATCHDOG=1\")) {\n"
      "        supervise->notify_steps = steps;\n"
      "        supervise->notify_fed_us = now_us;\n"
      "    }\n",
      "    if (is_due(steps, supervise->notify_steps, now_us, supervise->notify_fed_us,\n"
      "               supervise->notify_us)) {\n"
      "        supervise->notify_steps = steps;\n"
      "        supervise->notify_fed_us = now_us;\n"
      "        notify(supervise, \"WATCHDOG=1\");\n"
      "    }\n")),
    ("other-answered-write-outlives-its-connection",
     "That a write was answered is not forgotten with the connection. A PLC that once worked and now closes "
     "the connection at each write is proven by its readings alone, and is reconnected without the pause from "
     "50 ms to 1 s",
     (LINUX + "tcp.c",
      "    tcp->awaiting = tcp->read_answered = tcp->write_answered = false;\n",
      "    tcp->awaiting = tcp->read_answered = false;\n")),
    ("other-read-back-of-long-ago-counts",
     "A read-back that had the cycle before for itself (fc23, slow PLC) counts although up to five periods lie "
     "between it and the reading, for example behind a pause of the loop; decision 5 allows two",
     ("hal/cycle.c",
      "cycle->tick_us - cycle->step_at_us <= recent_us(box);\n",
      "cycle->tick_us - cycle->step_at_us <= clock_us(box);\n")),
    ("other-measurement-of-the-run-before-is-taken-again",
     "Lines that the measured file has at the start are not remembered. When another name is measured within "
     "five minutes of a restart, the file is read again and the old measurement is taken a second time",
     (LINUX + "hand.c",
      "    of->line = *line;\n"
      "    if (same || !look->hand->begun) return;\n",
      "    if (same || !look->hand->begun) return;\n"
      "    of->line = *line;\n")),
    ("other-rtu-no-doubt-behind-a-lost-device",
     "A serial device that is found lost while the box waits for silence leaves no doubt. Behind the replugged "
     "adapter the first request goes out without a probe, so an old reply can count for it",
     (LINUX + "rtu.c",
      "    if (rtu->serial.disconnects != disconnects) {\n"
      "        rtu->counters.device_errors++;\n"
      "        cb_rtu_dialog_doubt(&rtu->dialog);\n"
      "    }\n"
      "    return got;\n",
      "    if (rtu->serial.disconnects != disconnects) rtu->counters.device_errors++;\n"
      "    return got;\n")),
    ("other-input-record-has-the-exchange-behind-the-step",
     "The input record of a cycle has the exchange time that the write behind its step has measured, not the "
     "one that the step got. With a measured lead and exchanges of different lengths the replay computes other "
     "bits",
     (DAEMON + "loop.c",
      "    row->in = cycle->in;\n"
      "    row->in.exchange_us = cycle->step_exchange_us;\n"
      "    row->in.last_write",
      "    row->in = cycle->in;\n"
      "    row->in.last_write")),
    ("other-failed-start-forgets-stopped",
     "A start that fails at its threads, such as --cpu of a processor outside its affinity or --priority "
     "without permission, leaves the state file without STOPPED although nothing was written to the PLC; the "
     "next start says that the previous run did not end STOPPED",
     (DAEMON + "main.c",
      "        daemon->state.stopped = daemon->loop.resumed.stopped; /* nothing was written to the PLC */\n"
      "        write_state(daemon, cb_boottime_us());\n"
      "        return false;\n",
      "        write_state(daemon, cb_boottime_us()); /* nothing was written to the PLC */\n"
      "        return false;\n")),
    ("other-blackbox-request-waits-behind-a-pending-event",
     "SIGUSR1 while a HOLD or FAULT waits for the pause of a minute between files does not overtake it: the "
     "requested file comes up to a minute late and is named after the event",
     (OUTPUT + "blackbox.c",
      "    if (box->word == NULL || word == requested) box->word = word;\n",
      "    if (box->word == NULL) box->word = word;\n")),
    ("other-late-writes-dropped-at-turn",
     "At the end of a turn the late writes are cleared before they are kept as the older ones, so a write "
     "without reply leaves the possible interval one turn too early",
     ("firmware/box/limiter.c",
      "    state->older_min_um = state->late_min_um;\n"
      "    state->older_max_um = state->late_max_um;\n"
      "    state->late_min_um = FLT_MAX;\n"
      "    state->late_max_um = -FLT_MAX;\n"
      "    state->turn_us = turn_us;\n",
      "    state->late_min_um = FLT_MAX;\n"
      "    state->late_max_um = -FLT_MAX;\n"
      "    state->older_min_um = state->late_min_um;\n"
      "    state->older_max_um = state->late_max_um;\n"
      "    state->turn_us = turn_us;\n")),
    ("other-nan-is-in-range",
     "The range check lets a NaN through (De Morgan of the comparison), so a sensor or register that reads NaN "
     "counts as plausible with the value min",
     ("firmware/signals/plausible.h",
      "    return value >= signal->min - slack && value <= signal->max + slack; /* false for NaN */\n",
      "    return !(value < signal->min - slack || value > signal->max + slack);\n")),
    ("other-pair-difference-one-unit-enough",
     "The loader accepts a pair whose max_difference_um is only as large as the coarser of the two register "
     "units instead of both together",
     ("firmware/load/channels.c",
      "    const float units =\n"
      "        cb_channel_raw_unit_um(&channels[pair->a]) + cb_channel_raw_unit_um(&channels[pair->b]);\n"
      "    if (pair->max_difference_um >= units) return true;\n",
      "    const float a_um = cb_channel_raw_unit_um(&channels[pair->a]);\n"
      "    const float b_um = cb_channel_raw_unit_um(&channels[pair->b]);\n"
      "    if (pair->max_difference_um >= (a_um > b_um ? a_um : b_um)) return true;\n")),
    ("other-tcp-leave-keeps-pending-request",
     "Leaving the connection behind a last write does not forget the pending request, so on the new connection "
     "the box waits for the reply of the old one and is blocked",
     (LINUX + "tcp.c",
      "    if (tcp->link.state != CB_LINK_UP) return;\n"
      "    forget(tcp);\n",
      "    if (tcp->link.state != CB_LINK_UP) return;\n")),
    ("other-append-leaks-descriptor",
     "When the torn last line of a file opened for appending cannot be ended (full disk, read error), the "
     "descriptor stays open, once more with each event",
     (OUTPUT + "output_file.c",
      "    return error == 0 ? fd : refused(fd, error);",
      "    return error == 0 ? fd : refused(-1, error);")),
    ("other-blackbox-failed-file-counts-as-written",
     "Rows of a black box file that could not be written whole count as written, so the file of the next event "
     "lacks them",
     (OUTPUT + "blackbox.c",
      "    put_path(box, temporary, box->name, \".new\");\n"
      "    put_path(box, path, box->name, \"\");\n",
      "    box->written = box->next;\n"
      "    put_path(box, temporary, box->name, \".new\");\n"
      "    put_path(box, path, box->name, \"\");\n"),
     (OUTPUT + "blackbox.c",
      "    cb_output_sync_folder(path);\n"
      "    box->written = box->next;\n",
      "    cb_output_sync_folder(path);\n")),
    ("other-status-misses-new-revision",
     "The status for systemd is compared without the generation of the file, so after a reload in the same "
     "mode and reason it keeps the old revision",
     (DAEMON + "main.c",
      "    const uint32_t status = row->generation << 16 | (uint32_t)row->reason << 8 | row->mode;",
      "    const uint32_t status = (uint32_t)row->reason << 8 | row->mode;")),
    ("other-watchdog-refused-counts-as-fed",
     "A WATCHDOG=1 that systemd's full queue refuses counts as sent, so it is not sent again within 50 ms but "
     "only half of WatchdogSec later",
     (DAEMON + "supervise.c",
      "               supervise->notify_us) &&\n"
      "        notify(supervise, \"WATCHDOG=1\")) {\n",
      "               supervise->notify_us)) {\n"
      "        notify(supervise, \"WATCHDOG=1\");\n")),
    ("other-keys-unread-folder-passes-for-empty",
     "An error while the folder of keys is read counts only behind its first key, so a folder that cannot be "
     "read at all passes for one without keys, and an unsigned file is taken",
     (LINUX + "enrolled.c",
      "    if (answer.keys >= 0 && errno != 0) answer",
      "    if (answer.keys > 0 && errno != 0) answer")),
    ("other-bus-opener-left-without-thread",
     "When the thread of the sensor bus cannot be started, the thread that opens its device is left running "
     "with its memory, one more with each attempt a second later",
     (LINUX + "bus.c",
      "    bus->runs = error == 0;\n"
      "    if (error != 0) stop_opener(bus);\n",
      "    bus->runs = error == 0;\n")),
    ("other-loop-old-row-taken-as-the-last",
     "Once the ring of rows was full, the row beside it counts as the last one for ever, so at the end an old "
     "row of a hanging disk gives the final counters, mode and reason",
     (DAEMON + "loop.c",
      "    loop->is_beside = slot < 0;",
      "    loop->is_beside |= slot < 0;")),
    ("other-limiter-possible-ends-swapped",
     "The reach around the values that the PLC may hold is taken from the wrong ends, so after unanswered "
     "writes the output may be too far from a held value",
     ("firmware/box/limiter.c",
      "        room.low_um = cb_max(room.low_um, state->possible_max_um - reach_um);\n"
      "        room.high_um = cb_min(room.high_um, state->possible_min_um + reach_um);\n",
      "        room.low_um = cb_max(room.low_um, state->possible_min_um - reach_um);\n"
      "        room.high_um = cb_min(room.high_um, state->possible_max_um + reach_um);\n")),
    ("other-sensor-doubt-is-never-lifted",
     "A sensor that agrees with the others again is trusted inside the comparison, but its signal stays marked "
     "as doubted",
     ("firmware/signals/sensors.c",
      "        signal->doubted = is_doubted(state, j);\n"
      "        if (!signal->doubted) continue;\n",
      "        if (!is_doubted(state, j)) continue;\n"
      "        signal->doubted = true;\n")),
    ("other-loader-write-counter-at-read-count",
     "The second counter of the write block is reserved at the length of the read block, so a channel may take "
     "the counter's register and a free register is refused",
     ("firmware/load/registers.c",
      "        loader->scratch->write_user[plc->write.count - 1] = CB_USER_COUNTER;\n",
      "        loader->scratch->write_user[plc->read.count - 1] = CB_USER_COUNTER;\n")),
    ("other-json-key-may-occur-twice",
     "A key that occurs twice in one object of the coefficient file is accepted and the last one wins silently",
     ("firmware/json/object.c",
      "        if (slots[i] != CB_ABSENT)\n"
      "            return cb_fail(loader, CB_ERROR_KEY, members.key.at, \"this key occurs twice\");\n",
      "")),
    ("other-rtu-noise-counts-last-byte-of-reply",
     "The last byte of every good RTU reply is counted as a noise byte, so the statistics show noise on a "
     "clean line",
     (LINUX + "rtu.c",
      "*doubt = drop(rtu, count - i - 1);",
      "*doubt = drop(rtu, count - i);")),
    ("other-busy-serial-device-leaks-descriptor",
     "When another program has the serial device open, each attempt to open it leaves a descriptor open, until "
     "the daemon runs out of them",
     (LINUX + "serial_open.c",
      "static struct cb_serial_opened not_taken(int fd, int error) {\n"
      "    close(fd);\n",
      "static struct cb_serial_opened not_taken(int fd, int error) {\n"
      "    (void)fd;\n")),
    ("other-can-queued-frame-ends-down",
     "A CAN frame that waited in the queue since before the interface went down makes the box believe the bus "
     "is up again, so it sends into the dead interface and misses the real return",
     (LINUX + "can.c",
      "if (can->state != CB_CAN_UP && is_news(can, time_us)) come_up(can);",
      "if (can->state != CB_CAN_UP) come_up(can);")),
    ("other-reload-takes-longer-write-block",
     "A reload with another length of the write block is no longer refused, so the running box writes to "
     "registers behind its block or leaves some of them unwritten",
     (DAEMON + "reload.c",
      "if (a->write.start != b->write.start || a->write.count != b->write.count) return \"plc.write\";",
      "if (a->write.start != b->write.start) return \"plc.write\";")),
    ("other-record-columns-of-old-file",
     "After a reload the record gets the new header but keeps the old number of values in each row, so rows do "
     "not match their header",
     (OUTPUT + "record.c",
      "    record->header_used = bytes;\n"
      "    record->values = cb_row_count(config);\n",
      "    record->header_used = bytes;\n")),
    ("other-events-lost-count-does-not-add-up",
     "While the events file cannot be written, the number of lost events does not grow beyond one, so "
     "lost_before in the next event is too small",
     (OUTPUT + "events.c",
      "events->lost = events->error == 0 ? 0 : events->lost + 1;",
      "events->lost = events->error == 0 ? 0 : 1;")),
    ("other-history-order-after-wrap",
     "Once there were more mode changes than the history holds, the statistics list it from the first slot of "
     "the ring instead of the oldest change, so it is out of order",
     (OUTPUT + "stats_json.c",
      "&stats->history[i % CB_STATS_HISTORY];",
      "&stats->history[i - left_out];")),
    ("other-unsent-status-counts-as-told",
     "A status that systemd did not get, because the daemon was not ready yet or the queue was full, counts as "
     "reported, so systemctl status stays empty or old until the next change",
     (DAEMON + "main.c",
      "    if (!cb_supervise_status(&daemon->supervise, text)) return;\n",
      "    cb_supervise_status(&daemon->supervise, text);\n")),
    ("other-blackbox-keeps-beyond-one-limit",
     "The folder of the black box is only trimmed when both the number and the size of its files are beyond "
     "their limits, so either limit alone is not held",
     (OUTPUT + "blackbox.c",
      "(all.count <= files && all.bytes <= bytes))",
      "(all.count <= files || all.bytes <= bytes))")),
    ("other-black-box-refused-write-is-more",
     "A write of the black box that fails with EAGAIN counts as rows to come: the file goes on behind a part of a "
     "row (the sources had this)",
     (OUTPUT + "blackbox.c",
      "    if (error != 0 || !more || !comes)",
      "    if ((error != 0 && error != EAGAIN) || !more || !comes)")),
    ("other-compression-refused-write-is-more",
     "A write of the compression that fails with EAGAIN counts as more to come, when both files are closed (the "
     "sources had this)",
     (OUTPUT + "compress.c",
      "    cb_compress_abandon();\n"
      "    return error;",
      "    cb_compress_abandon();\n"
      "    return error == EAGAIN ? CB_COMPRESS_MORE : error;")),
]
