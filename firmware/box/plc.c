/* SPDX-License-Identifier: MIT */
#include "firmware/box/plc.h"

#include "firmware/base/duration.h"
#include "firmware/config/config.h"

void cb_plc_forget(struct cb_plc_state *state) {
    state->readable = false;
    state->beating = state->alive = false;
}

static void count_write(struct cb_counters *counters, enum cb_transfer result) {
    switch (result) {
        case CB_TRANSFER_NONE:
        case CB_TRANSFER_OK:
            break;
        case CB_TRANSFER_FAILED:
            ++counters->writes_failed;
            break;
        case CB_TRANSFER_REFUSED:
            ++counters->writes_refused;
            break;
        case CB_TRANSFER_UNKNOWN:
            ++counters->writes_unknown;
            break;
    }
}

void cb_plc_written(const struct cb_config *config, struct cb_plc_state *state,
                    struct cb_counters *counters, enum cb_transfer result, uint32_t elapsed_us,
                    int64_t now_us) {
    count_write(counters, result);
    const bool answers = result == CB_TRANSFER_REFUSED || cb_plc_readable(config, state, now_us);
    if (state->refusing && answers) state->refused_us = cb_add_us(state->refused_us, elapsed_us);
    if (result == CB_TRANSFER_REFUSED) {
        state->refusing = true;
        /* without any confirmation before, the PLC is not busy: it does not accept such writes */
        state->mute = state->mute || !state->confirmed;
    }
    if (result != CB_TRANSFER_NONE && result != CB_TRANSFER_FAILED) state->parting = false;
    if (result == CB_TRANSFER_OK) {
        state->refusing = state->mute = false;
        state->confirmed = true;
        state->refused_us = 0;
        state->unconfirmed_us = 0; /* at the time of that write, elapsed_us ago */
    }
    state->unconfirmed_us = cb_add_us(state->unconfirmed_us, elapsed_us);
    const uint64_t lost_us = (uint64_t)CB_LOST_HALF_PERIODS * config->period_us / 2;
    const uint64_t part_by_us = lost_us + (uint64_t)CB_READ_PERIODS * config->period_us;
    if (state->unconfirmed_us > part_by_us) state->parting = false;
    if (state->contact != CB_CONTACT_KNOWN || state->unconfirmed_us <= lost_us) return;
    state->contact = CB_CONTACT_LOST;
    /* an absent PLC replies neither to readings nor to writes */
    const bool heard = state->refusing || cb_plc_readable(config, state, now_us);
    state->parting = heard && !state->mute;
    if (heard || !state->confirmed) state->mute = true;
}

static bool is_torn(const struct cb_block_config *block, const uint16_t *registers) {
    return block->counters && registers[0] != registers[block->count - 1];
}

/* A heartbeat counts only when it changes between two readings. One that is behind the previous
 * one, by the shorter way round, is that of a PLC that has restarted. */
static void take_heartbeat(struct cb_plc_state *state, uint16_t heartbeat, bool first,
                           int64_t read_us) {
    const bool behind = (uint16_t)(state->plc_heartbeat - heartbeat - 1) < 0x7FFF;
    if (state->contact != CB_CONTACT_KNOWN && state->beat && behind) state->went_back = true;
    state->beat = true;
    if (!first && heartbeat != state->plc_heartbeat) {
        state->beating = true;
        state->heartbeat_us = read_us;
    }
    state->plc_heartbeat = heartbeat;
}

/* Counts handshakes, by a new channel or a rising ESTB, and NC alarms. */
static void take_handshake(struct cb_plc_state *state, struct cb_counters *counters,
                           uint16_t word) {
    const unsigned changed = word ^ state->handshake;
    const bool started = (word & CB_HANDSHAKE_ESTB) && (changed & CB_HANDSHAKE_ESTB);
    const bool another = (word & CB_HANDSHAKE_CHANNEL) && (changed & CB_HANDSHAKE_CHANNEL);
    const bool alarm = (word & CB_HANDSHAKE_ALARM) != 0;
    counters->handshakes += started || another;
    counters->nc_alarms += alarm && !state->nc_alarm;
    state->nc_alarm = alarm;
    state->handshake = word;
}

bool cb_plc_read(const struct cb_config *config, struct cb_plc_state *state,
                 struct cb_counters *counters, const struct cb_inputs *in, int64_t now_us) {
    const struct cb_plc_config *plc = &config->plc;
    state->reset_edge = false;
    if (!in->read_ok || in->read_us > now_us) {
        ++counters->reads_failed;
        return false;
    }
    if (is_torn(&plc->read, in->registers)) {
        ++counters->reads_torn;
        return false;
    }
    const uint16_t control = in->registers[plc->control];
    state->reset_edge = (control & CB_CONTROL_RESET) && !(state->control & CB_CONTROL_RESET);
    state->control = control;
    /* behind a silence nobody knows when it changed, and the program may stand */
    const bool first = !cb_plc_readable(config, state, in->read_us);
    take_heartbeat(state, in->registers[plc->plc_heartbeat], first, in->read_us);
    if (plc->has_handshake) take_handshake(state, counters, in->registers[plc->handshake]);
    state->readable = true;
    state->read_us = in->read_us;
    return true;
}

void cb_plc_age(const struct cb_config *config, struct cb_plc_state *state,
                struct cb_counters *counters, int64_t now_us) {
    const int64_t timeout_us = (int64_t)config->plc.heartbeat_timeout_ms * 1000;
    const bool alive = state->beating && now_us - state->heartbeat_us <= timeout_us;
    counters->heartbeats_lost += state->alive && !alive;
    state->alive = alive;
    state->parting = state->parting && cb_plc_readable(config, state, now_us);
}

bool cb_plc_parts(const struct cb_plc_state *state) {
    return state->contact == CB_CONTACT_LOST && state->parting;
}

bool cb_plc_readable(const struct cb_config *config, const struct cb_plc_state *state,
                     int64_t now_us) {
    return state->readable &&
           now_us - state->read_us <= (int64_t)CB_READ_PERIODS * config->period_us;
}

bool cb_plc_gone(const struct cb_config *config, const struct cb_plc_state *state, int64_t now_us) {
    return now_us - state->read_us > (int64_t)CB_READ_PERIODS * config->period_us + CB_GONE_US;
}
