/* SPDX-License-Identifier: MIT
 * Plays a sequence of events, or searches the one that costs a box the most instructions. */
#include <stdio.h>
#include <string.h>

#include "tests/gates/worst/job.h"
#include "tests/gates/worst/search.h"

static void print_events(const struct search_result *found) {
    const uint8_t *const bytes = (const uint8_t *)found->events;
    printf("events ");
    for (unsigned i = 0; i < found->count * sizeof found->events[0]; ++i) printf("%02x", bytes[i]);
    puts("");
}

int main(void) {
    struct search_result *const found = search_memory();
    struct play_most most[PLAY_KINDS];
    const struct job *const job = job_begin();
    if (!job) return 1;
    found->count = job->count;
    memcpy(found->events, job->events, sizeof found->events);
    if (job->tries > 0) search((enum play_kind)job->kind, job->seed, job->tries, found);
    play(found->events, found->count, most);
    printf("count %u of step %u, mode %u\n", (unsigned)most[job->kind].count,
           (unsigned)most[job->kind].at, most[job->kind].mode);
    if (job->tries > 0) print_events(found);
    return 0;
}
