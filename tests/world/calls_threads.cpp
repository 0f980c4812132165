// SPDX-License-Identifier: MIT
// Threads, semaphores, errno. A thread of the daemon is a coroutine of the scheduler.
#include <pthread.h>
#include <semaphore.h>

#include <cstdlib>
#include <cstring>
#include <ctime>

#include "tests/world/calls.h"

namespace {

using namespace compbox::world;

thread *thread_of(pthread_t id) {
    return here().time.find(static_cast<int>(id));
}

// Waits until a thread has finished, and forgets it. in: until: of the world's time
int join(pthread_t id, void **result, time_ns until) {
    for (;;) {
        thread *const other = thread_of(id);
        if (other == nullptr) return ESRCH;
        if (other->finished) {
            if (result != nullptr) *result = other->result;
            here().time.forget(other->id);
            return 0;
        }
        if (here().time.now() >= until) return ETIMEDOUT;
        here().wait_for_change(until);
    }
}

int &count_of(sem_t *semaphore) {
    static_assert(sizeof(sem_t) >= sizeof(int));
    return *reinterpret_cast<int *>(semaphore);
}

}  // namespace

extern "C" {

int *world___errno_location() {
    return &error_number();
}

int world_pthread_attr_init(pthread_attr_t *attributes) {
    std::memset(attributes, 0, sizeof *attributes);
    return here().begin("pthread_attr_init").error;
}
int world_pthread_attr_destroy(pthread_attr_t *) {
    return 0;
}
int world_pthread_attr_setaffinity_np(pthread_attr_t *, size_t, const cpu_set_t *) {
    return here().begin("pthread_attr_setaffinity_np").error;
}
int world_pthread_attr_setinheritsched(pthread_attr_t *, int) {
    return 0;
}
int world_pthread_attr_setschedparam(pthread_attr_t *, const sched_param *) {
    return 0;
}
int world_pthread_attr_setschedpolicy(pthread_attr_t *, int) {
    return 0;
}
int world_pthread_attr_setstacksize(pthread_attr_t *, size_t) {
    return 0;
}

int world_pthread_create(pthread_t *id, const pthread_attr_t *, void *(*run)(void *),
                         void *argument) {
    const int error = here().begin("pthread_create").error;
    if (error != 0) return error;
    computer &box = here();
    thread &fresh = box.time.start("thread", [&box, run, argument] {
        thread &self = *box.time.running();
        self.result = run(argument);
        box.changed();
    });
    fresh.argument = argument;
    fresh.mask = box.time.running()->mask;
    *id = static_cast<pthread_t>(fresh.id);
    return 0;
}

int world_pthread_detach(pthread_t) {
    return 0;
}

int world_pthread_join(pthread_t id, void **result) {
    (void)here().begin("pthread_join");
    return join(id, result, never);
}

int world_pthread_timedjoin_np(pthread_t id, void **result, const timespec *until) {
    (void)here().begin("pthread_timedjoin_np");
    const time_ns left_ns = until->tv_sec * second + until->tv_nsec - here().wall();
    return join(id, result, here().time.now() + left_ns);
}

int world_sem_init(sem_t *semaphore, int, unsigned value) {
    count_of(semaphore) = static_cast<int>(value);
    return 0;
}

int world_sem_destroy(sem_t *) {
    return 0;
}

int world_sem_post(sem_t *semaphore) {
    (void)here().begin("sem_post");
    ++count_of(semaphore);
    here().changed();
    return 0;
}

int world_sem_wait(sem_t *semaphore) {
    if (here().begin("sem_wait").error != 0) return -1;
    while (count_of(semaphore) <= 0) here().wait_for_change(never);
    --count_of(semaphore);
    return 0;
}

// Each function of hal/ calls these (-finstrument-functions).
void __cyg_profile_func_enter(void *, void *) {
    if (--computer::lines_left < 0) here().preempt();
}
void __cyg_profile_func_exit(void *, void *) {
    if (--computer::lines_left < 0) here().preempt();
}
}
