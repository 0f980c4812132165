/* SPDX-License-Identifier: MIT */
#include "tests/gates/worst/job.h"

#include <stdio.h>
#include <string.h>

#include "tests/gates/instructions/counter.h"

#define TEXT ((const char *)0x080A0000) /* the coefficient file; unwritten flash behind it is 0 */
#define JOB ((const struct job *)0x080C0000)

const struct job *job_begin(void) {
    static const struct cb_target targets[] = {
        {"gate", 1u << CB_SOURCE_PLC, 1u << CB_TRANSPORT_TCP, 0},
        {"compbox-stm32f405", 1u << CB_SOURCE_PLC | 1u << CB_SOURCE_BUS, 1u << CB_TRANSPORT_RTU,
         0}};
    struct cb_message message;
    if (!counter_start()) {
        puts("this counts no instructions: start it with qemu-system-arm -icount");
        return NULL;
    }
    if (play_load(TEXT, strlen(TEXT), &targets[JOB->rtu & 1], &message)) return JOB;
    printf("refused: %s\n", message.text);
    return NULL;
}
