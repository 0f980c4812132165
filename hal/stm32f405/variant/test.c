/* SPDX-License-Identifier: MIT
 * The test image: commands that provoke what the fault handler and the watchdog are for. */
#include "firmware/base/assert.h"
#include "hal/stm32f405/app/commands.h"
#include "hal/stm32f405/time.h"

extern char stack_start[];

static void crash_undefined(struct cb_app *app) {
    (void)app;
    __asm__ volatile("udf #0");
}

static void crash_address(struct cb_app *app) {
    (void)app;
    *(volatile uint32_t *)0x70000000u = 1;
}

/* Writes downward from the stack pointer until it reaches the guard. */
static void crash_stack(struct cb_app *app) {
    (void)app;
    __asm__ volatile("1: push {r0-r7}\n\tb 1b");
}

static void crash_canary(struct cb_app *app) {
    (void)app;
    *(volatile uint32_t *)(void *)stack_start = 0;
}

static void crash_assertion(struct cb_app *app) {
    CB_ASSERT(app == 0);
}

static void crash_hang(struct cb_app *app) {
    (void)app;
    for (;;) cb_time_sleep(cb_time_interrupts());
}

static const struct cb_command commands[] = {
    {"crash undefined", "test: an undefined instruction", crash_undefined},
    {"crash address", "test: a write where no memory is", crash_address},
    {"crash stack", "test: a stack overflow", crash_stack},
    {"crash canary", "test: a stack that has run to its last word", crash_canary},
    {"crash assertion", "test: a failed assertion", crash_assertion},
    {"crash hang", "test: an endless loop, for the watchdog", crash_hang},
};

const struct cb_command_list cb_test_commands = {commands, sizeof commands / sizeof commands[0]};
