/* SPDX-License-Identifier: MIT
 * Gate: instructions of a whole cycle, under the reference load in trouble. */
#include <stdio.h>

#include "tests/gates/cycle/exchange.h"
#include "tests/gates/instructions/counter.h"
#include "tests/gates/instructions/step.h"

int main(void) {
    if (!counter_start() || !step_load()) {
        puts("this counts no instructions: start it with qemu-system-arm -icount");
        return 1;
    }
    (void)step_most(STEP_TROUBLE, 3000);
    return exchange_report("reference load", 15000);
}
