/* SPDX-License-Identifier: MIT
 * Gate: instructions of a whole cycle under the reference load, travelling. */
#include <stdio.h>

#include "tests/gates/cycle/exchange.h"
#include "tests/gates/instructions/counter.h"
#include "tests/gates/instructions/step.h"

int main(void) {
    if (!counter_start() || !step_load(STEP_SHARED_BREAKS)) {
        puts("this counts no instructions: start it with qemu-system-arm -icount");
        return 1;
    }
    (void)step_most(STEP_TRAVEL, 500);
    return exchange_report("reference load, travelling", 17000);
}
