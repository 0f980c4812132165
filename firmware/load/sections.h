/* SPDX-License-Identifier: MIT
 * Internal to the loader: the sections of the coefficient file, and the tables of keys of their
 * objects. The tables of the kinds of terms are in firmware/terms. A test compares all tables with
 * docs/coefficients.schema.json. */
#ifndef COMPBOX_FIRMWARE_LOAD_SECTIONS_H
#define COMPBOX_FIRMWARE_LOAD_SECTIONS_H

#include "firmware/json/reader.h"

extern const struct cb_object cb_top_object; /* load.c */
extern const struct cb_object cb_machine_object;
extern const struct cb_object cb_cycle_object;
extern const struct cb_object cb_safety_object;
extern const struct cb_object cb_transport_object; /* transport.c */
extern const struct cb_object cb_tcp_object;
extern const struct cb_object cb_rtu_object;
extern const struct cb_object cb_bus_object;
extern const struct cb_object cb_bus_line_object;
extern const struct cb_object cb_plc_object; /* plc.c */
extern const struct cb_object cb_read_block_object;
extern const struct cb_object cb_write_block_object;
extern const struct cb_object cb_can_object; /* can.c */
extern const struct cb_object cb_can_node_object;
extern const struct cb_object cb_signal_object;  /* signals.c */
extern const struct cb_object cb_sensors_object; /* sensors.c */
extern const struct cb_object cb_channel_object; /* channels.c */
extern const struct cb_object cb_tangent_object; /* tangent.c */
extern const struct cb_object cb_pair_object;

/* ---- sections ----
 * in : at, place of the value
 * out: true, and its content in loader->config; or false and the first mistake as a message */

bool cb_load_plc(struct cb_loader *loader, uint32_t at);       /* needs cycle */
bool cb_load_transport(struct cb_loader *loader, uint32_t at); /* of plc */
bool cb_check_line(struct cb_loader *loader, uint32_t at);     /* transport; needs plc */
bool cb_load_can(struct cb_loader *loader, uint32_t at);       /* at: may be CB_ABSENT */
bool cb_load_buses(struct cb_loader *loader, uint32_t at);
bool cb_load_signals(struct cb_loader *loader, uint32_t at);       /* needs plc, buses */
bool cb_resolve_lags(struct cb_loader *loader, uint32_t at);       /* at: signals, all loaded */
bool cb_resolve_velocities(struct cb_loader *loader, uint32_t at); /* likewise */
bool cb_load_sensors(struct cb_loader *loader, uint32_t at);       /* needs signals */
bool cb_load_channels(struct cb_loader *loader, uint32_t at);      /* needs terms */
bool cb_resolve_probes(struct cb_loader *loader, uint32_t terms, uint32_t channels);
bool cb_load_tangents(struct cb_loader *loader, uint32_t at); /* at: channels, all loaded */
bool cb_load_pairs(struct cb_loader *loader, uint32_t at);    /* needs channels */

#endif
