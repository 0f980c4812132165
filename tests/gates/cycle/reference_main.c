/* SPDX-License-Identifier: MIT
 * Gate: instructions of a whole cycle under the reference load: travelling, and when everything
 * goes wrong now and then (beyond the budget, which is for the conformance inputs; 20 000 are 0.12
 * ms). */
#include <stdio.h>

#include "tests/gates/cycle/exchange.h"
#include "tests/gates/instructions/counter.h"
#include "tests/gates/instructions/step.h"

int main(void) {
    if (!counter_start() || !step_load(true)) {
        puts("this counts no instructions: start it with qemu-system-arm -icount");
        return 1;
    }
    (void)step_most(STEP_TRAVEL, 500);
    const int travelling = exchange_report("reference load, travelling", 16500);
    (void)step_most(STEP_TROUBLE, 3000);
    return exchange_report("reference load, in trouble", 20000) | travelling;
}
