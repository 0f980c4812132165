/* SPDX-License-Identifier: MIT
 * Inside of the loader: the tables of keys of every object in the coefficient file. A test compares
 * them with docs/coefficients.schema.json. */
#ifndef COMPBOX_FIRMWARE_CONFIG_OBJECTS_H
#define COMPBOX_FIRMWARE_CONFIG_OBJECTS_H

#include "firmware/config_reader.h"

extern const struct cb_object cb_top_object; /* config_load.c */
extern const struct cb_object cb_machine_object;
extern const struct cb_object cb_cycle_object;
extern const struct cb_object cb_safety_object;
extern const struct cb_object cb_transport_object; /* config_transport.c */
extern const struct cb_object cb_tcp_object;
extern const struct cb_object cb_rtu_object;
extern const struct cb_object cb_bus_object;
extern const struct cb_object cb_bus_line_object;
extern const struct cb_object cb_plc_object; /* config_plc.c */
extern const struct cb_object cb_read_block_object;
extern const struct cb_object cb_write_block_object;
extern const struct cb_object cb_can_object; /* config_can.c */
extern const struct cb_object cb_can_node_object;
extern const struct cb_object cb_signal_object;  /* config_signals.c */
extern const struct cb_object cb_bspline_object; /* config_curves.c */
extern const struct cb_object cb_polyline_object;
extern const struct cb_object cb_polynomial_object;
extern const struct cb_object cb_bspline_backward_object;
extern const struct cb_object cb_polyline_backward_object;
extern const struct cb_object cb_polynomial_backward_object;
extern const struct cb_object cb_linear_object; /* config_linear.c */
extern const struct cb_object cb_product_object;
extern const struct cb_object cb_bpnet_object;      /* config_bpnet.c */
extern const struct cb_object cb_volumetric_object; /* config_volumetric.c */
extern const struct cb_object cb_reference_points_object;
extern const struct cb_object cb_squareness_object;
extern const struct cb_object cb_channel_object; /* config_channels.c */
extern const struct cb_object cb_tangent_object; /* config_tangent.c */
extern const struct cb_object cb_pair_object;

#endif
