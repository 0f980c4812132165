/* SPDX-License-Identifier: MIT
 * The sections "buses" and "can" in memory: the lines of the box's own sensors. */
#ifndef COMPBOX_FIRMWARE_CONFIG_BUSES_H
#define COMPBOX_FIRMWARE_CONFIG_BUSES_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/base/limits.h"
#include "firmware/wire/rtu_line.h"

/* A slow bus of the box itself, whose modules are polled in turn. */
struct cb_bus_config {
    char name[CB_NAME_SIZE];
    struct cb_serial_config serial;
    uint32_t every_us; /* poll interval of each module */
};

/* A supervised CANopen device: started, and its heartbeat watched. */
struct cb_can_node_config {
    uint8_t node;                  /* 1 … 127 */
    bool start;                    /* send it the start command (NMT) */
    uint32_t heartbeat_timeout_ms; /* its timeout; 0: not watched */
};

struct cb_can_config {
    char interface[16]; /* name of the network interface */
    uint8_t nodes_count;
    struct cb_can_node_config nodes[CB_MAX_CAN_NODES];
};

#endif
