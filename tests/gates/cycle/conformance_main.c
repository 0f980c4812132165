/* SPDX-License-Identifier: MIT
 * Gate: instructions of a whole cycle, over the inputs of the conformance test. */
#include <stdio.h>

#include "tests/conformance/check.h"
#include "tests/gates/cycle/exchange.h"
#include "tests/gates/instructions/counter.h"

int main(void) {
    struct check check = {.group = "box", .hash = 0xcbf29ce484222325u};
    if (!counter_start()) {
        puts("this counts no instructions: start it with qemu-system-arm -icount");
        return 1;
    }
    run_box(&check);
    return check.failures > 0 ? 1 : exchange_report("conformance inputs", 17500);
}
