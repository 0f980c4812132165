/* SPDX-License-Identifier: MIT
 * The section "plc" in memory: blocks, control and status words, and the connection. */
#ifndef COMPBOX_FIRMWARE_CONFIG_PLC_H
#define COMPBOX_FIRMWARE_CONFIG_PLC_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/wire/rtu_line.h"

enum cb_profile { CB_PROFILE_GENERIC, CB_PROFILE_SINUMERIK_840D, CB_PROFILE_FANUC };
enum cb_exchange { CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23 };
enum cb_transport { CB_TRANSPORT_TCP, CB_TRANSPORT_RTU };
enum cb_tcp_client { CB_CLIENT_COMPBOX, CB_CLIENT_LIBMODBUS };

/* A block of holding registers, zero-based protocol address. With counters, its first and last
 * register carry the same number, incremented with every update; a block where they differ is
 * torn. */
struct cb_block_config {
    uint16_t start;
    uint16_t count;
    bool counters;
};

struct cb_plc_config {
    uint8_t profile;   /* enum cb_profile */
    uint8_t exchange;  /* enum cb_exchange */
    uint8_t transport; /* enum cb_transport */
    uint8_t unit;      /* Modbus unit id */
    struct cb_block_config read, write;
    uint16_t control, plc_heartbeat; /* indices in the read block */
    uint16_t status, box_heartbeat;  /* indices in the write block */
    uint16_t detail;                 /* index in the write block, where has_detail */
    uint16_t request;                /* likewise, where has_request */
    uint32_t heartbeat_timeout_ms;
    uint16_t referenced_mask; /* all of these control bits must be set; default bit 1 */
    uint16_t handshake;       /* index in the read block, where has_handshake */
    uint16_t step_units;      /* largest change between two updates of the NC; 0: any */
    bool has_detail;          /* the box reports the signal or channel behind its reason */
    bool has_request;         /* the box asks by it for another probe */
    bool has_handshake;       /* the PLC reports its handshake with the NC */
    bool axes_at_once;        /* with a handshake: one handshake takes all channels */
    uint32_t scan_us;         /* the PLC's scan; 0 where the profile has no handshake */
    float deadband_um;        /* the PLC delays smaller changes than this to the NC */
    uint32_t interpolate_us;  /* the PLC moves to each new value in a straight line over this time;
                                 0: at once; <= a period */
    /* connection to the PLC: used at start, by no step */
    char host[40]; /* TCP: numeric IPv4 or IPv6 address, no resolver in the loop */
    uint16_t port;
    uint8_t client;                 /* TCP: enum cb_tcp_client */
    struct cb_serial_config serial; /* RTU */
};

#endif
