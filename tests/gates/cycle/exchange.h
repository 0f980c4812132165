/* SPDX-License-Identifier: MIT
 * Counts a whole cycle around each cb_box_step() of a program, which the linker sends through here
 * (--wrap): the reply with the read block received byte by byte and decoded, the step, the write
 * block encoded as a frame. */
#ifndef COMPBOX_TESTS_GATES_EXCHANGE_H
#define COMPBOX_TESTS_GATES_EXCHANGE_H

#include <stdbool.h>
#include <stdint.h>

/* The most instructions that one cycle took, and of that cycle the parts. */
struct exchange_most {
    uint32_t all, receive, step, encode;
    uint32_t cycles; /* how many were looked at */
    bool wrong;      /* a reply was not decoded to what it was made of */
};
extern struct exchange_most exchange_most;

/* Prints used / limit; out: exit code. */
int exchange_report(const char *inputs, uint32_t limit);

#endif
