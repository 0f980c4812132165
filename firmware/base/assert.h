/* SPDX-License-Identifier: MIT
 * Assertions: mistakes of programmers, found where they are made and never passed on. They stay on
 * in the product. What a person, a file, a PLC or a line can cause is no case for them: it has a
 * sentence, a counter or a mode. */
#ifndef COMPBOX_FIRMWARE_BASE_ASSERT_H
#define COMPBOX_FIRMWARE_BASE_ASSERT_H

/* Of the target: reports the place and ends the program, which then starts anew (docs/faults.md).
 * in : file: from the root of the sources, a constant */
__attribute__((noreturn, cold)) void cb_assertion_failed(const char *file, int line);

/* in : condition: without side effects, and cheap */
#define CB_ASSERT(condition) ((condition) ? (void)0 : cb_assertion_failed(__FILE__, __LINE__))

#endif
