/* SPDX-License-Identifier: MIT
 * Every maximum of the box, with its reason. The whole box must stay under 64 KiB (box.h asserts
 * it) and the loader's scratch memory under 32 KiB (config/loading.h), because the STM32F405 has
 * 128 KiB of main SRAM. */
#ifndef COMPBOX_FIRMWARE_BASE_LIMITS_H
#define COMPBOX_FIRMWARE_BASE_LIMITS_H

#ifdef __cplusplus /* the host tools and tests include these headers in extern "C" */
#define _Static_assert static_assert
#endif

enum {
    CB_NAME_SIZE = 24,       /* 23 characters and a 0; the longest name in use has 12 */
    CB_MAX_SIGNALS = 64,     /* S3 uses 19 inputs; with lags of each temperature about 50 */
    CB_MAX_TERMS = 64,       /* 21 error curves, a volumetric term, a network, drive cams */
    CB_MAX_OUTPUTS = 128,    /* term outputs: a network has up to 8, the volumetric term 3 */
    CB_MAX_TERM_OUTPUTS = 8, /* of one term: the maximum of a network */
    CB_MAX_NET_INPUTS = 64,  /* of one network: every signal; S3 uses 19 */
    CB_MAX_NET_HIDDEN = 64,  /* of one network: S3 uses 20; 64 x 64 weights fill half of the pool */
    CB_MAX_CHANNELS = 16,    /* dual-drive tables need 4, a five-axis gantry with twin drives 7 */
    CB_MAX_SUM = 32,         /* term outputs summed by one channel */
    CB_MAX_PAIRS = 8,        /* two motors of one stage; half of the channels */
    CB_POOL_FLOATS = 8192, /* coefficients after expansion: a cubic of 20 control points takes 86 */
    CB_MAX_LINKS = 512,    /* inputs of all linear terms and networks together */
    CB_MAX_BANKS = 16,     /* linear terms with a bank of lags: one of each channel */
    CB_MAX_BANK_LAGS = 256, /* of all banks: 16 thermometers and a speed to its cube take 19 for
                               each time constant, and a warm-up needs eight to twelve */
    CB_MAX_BANK_TAUS = 32,  /* of one bank: from a minute to a day in steps of a fourth */
    CB_MAX_BANK_POWER = 4,  /* the loss of a spindle rises with the cube of its speed at most */
    CB_MAX_DIRECTIONS = 4,  /* of the sigma of one bank: the leading ones, each with as many floats
                               as the bank has columns */
    CB_MAX_ADAPTS = 8,      /* terms adapted by probes: one of each axis, and rotary ones */
    CB_MAX_BRANCHES = 32,   /* curves with a backward branch: 18 errors of three axes, drive cams */
    CB_MAX_CURVE_POINTS = 1024,   /* control points, coefficients or support points of one curve */
    CB_MAX_READ_REGISTERS = 125,  /* Modbus application protocol: FC3 */
    CB_MAX_WRITE_REGISTERS = 121, /* Modbus application protocol: FC23 writes 121, FC16 123 */
    CB_MAX_BUSES = 1,             /* sensor buses: the microcontroller has one port for them */
    CB_MAX_CAN_NODES = 32,        /* CANopen nodes minded: each gives two or more of 64 signals */
    CB_MAX_SENSORS = 32, /* that check each other: a record of a lathe has 24 thermometers */
    CB_MAX_SAMPLES = 64, /* sensor samples of one cycle: one per signal */
    CB_MAX_TEXT_BYTES =
        131072 - 32, /* coefficient file: one 128 KiB flash sector minus its header */
};

_Static_assert(CB_MAX_OUTPUTS >= CB_MAX_TERMS, "each term has at least one output");
_Static_assert(CB_MAX_NET_INPUTS <= CB_MAX_SIGNALS, "the inputs of a network are signals");
_Static_assert((CB_MAX_NET_INPUTS + 1) * CB_MAX_NET_HIDDEN +
                       CB_MAX_TERM_OUTPUTS * (1 + CB_MAX_NET_HIDDEN + CB_MAX_NET_INPUTS) +
                       4 * CB_MAX_NET_INPUTS <=
                   CB_POOL_FLOATS,
               "the largest network, its linear path and its training range fit into the pool");
_Static_assert(CB_MAX_BANK_LAGS % 32 == 0, "one bit of a word for each");
_Static_assert(CB_MAX_BANK_POWER <= 8, "the powers of an input are the bits of a uint8_t");
_Static_assert(CB_MAX_PAIRS * 2 <= CB_MAX_CHANNELS, "a channel belongs to one pair at most");
_Static_assert(CB_MAX_OUTPUTS <= 255 && CB_MAX_SIGNALS <= 255, "indices are uint8_t, 255 is none");

enum { CB_NONE = 255 }; /* index of nothing */

#endif
