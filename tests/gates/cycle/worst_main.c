/* SPDX-License-Identifier: MIT
 * Gate: instructions of a whole cycle, over the sequence of events with the dearest step. */
#include "tests/gates/cycle/exchange.h"
#include "tests/gates/worst/job.h"

int main(void) {
    struct play_most most[PLAY_KINDS];
    const struct job *const job = job_begin();
    if (!job) return 1;
    play(job->events, job->count, most);
    return exchange_report("reference load, dearest step", 29000);
}
