// SPDX-License-Identifier: MIT
// Clocks and sleeps.
#include <sys/timex.h>

#include <ctime>

#include "tests/world/calls.h"

namespace {

using namespace compbox::world;

timespec spec_of(time_ns ns) {
    return {ns / second, ns % second};
}

time_ns ns_of(const timespec &time) {
    return time.tv_sec * second + time.tv_nsec;
}

time_ns now_by(clockid_t clock) {
    if (clock == CLOCK_REALTIME) return here().wall();
    return clock == CLOCK_BOOTTIME ? here().boottime() : here().monotonic();
}

}  // namespace

extern "C" {

int world_clock_gettime(clockid_t clock, timespec *to) {
    ++here().calls;
    here().time.pass(60);
    *to = spec_of(now_by(clock));
    return 0;
}

int world_clock_nanosleep(clockid_t clock, int flags, const timespec *until, timespec *) {
    const call_fate fate = here().begin("clock_nanosleep");
    if (fate.error != 0) return fate.error;
    const time_ns left_ns = ns_of(*until) - (flags & TIMER_ABSTIME ? now_by(clock) : 0);
    if (flags & TIMER_ABSTIME && here().ticked) here().ticked();
    if (left_ns > 0) here().sleep_until(here().time.now() + left_ns, clock != CLOCK_BOOTTIME);
    return 0;
}

int world_nanosleep(const timespec *wait, timespec *) {
    const call_fate fate = here().begin("nanosleep");
    if (fate.error != 0) return -1;
    here().sleep_until(here().time.now() + ns_of(*wait), true);
    return 0;
}

time_t world_time(time_t *to) {
    const time_t now_s = here().wall() / second;
    if (to != nullptr) *to = now_s;
    return now_s;
}

tm *world_gmtime_r(const time_t *at, tm *to) {
    return gmtime_r(at, to);
}

int world_adjtimex(timex *query) {
    if (here().begin("adjtimex").error != 0) return -1;
    query->status = here().synchronised ? 0 : STA_UNSYNC;
    return here().synchronised ? TIME_OK : TIME_ERROR;
}
}
