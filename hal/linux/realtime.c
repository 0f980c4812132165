/* SPDX-License-Identifier: MIT */
#include "hal/linux/realtime.h"

#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <stdint.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

enum {
    STACK_BYTES = 256 * 1024,
    TOUCHED_BYTES = 192 * 1024, /* of these; the rest is already in use, or a margin */
    PAGE_BYTES = 4096,
};

int cb_lock_memory(void) {
    return mlockall(MCL_CURRENT | MCL_FUTURE) == 0 ? 0 : errno;
}

int cb_hold_cpu_latency(void) {
    int fd = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    if (fd < 0) return errno;
    int32_t latency_us = 0; /* requested while the file is open */
    if (write(fd, &latency_us, sizeof latency_us) == sizeof latency_us) return 0;
    int error = errno;
    close(fd);
    return error;
}

static int set_cpu(pthread_attr_t *attributes, int cpu) {
    cpu_set_t only;
    if (cpu < 0) return 0;
    CPU_ZERO(&only);
    CPU_SET((unsigned)cpu, &only);
    return pthread_attr_setaffinity_np(attributes, sizeof only, &only);
}

static int set_attributes(pthread_attr_t *attributes, const struct cb_schedule *schedule) {
    int error = pthread_attr_setstacksize(attributes, STACK_BYTES);
    if (error == 0) error = set_cpu(attributes, schedule->cpu);
    if (error != 0 || schedule->priority == 0) return error;
    struct sched_param parameters = {.sched_priority = schedule->priority};
    error = pthread_attr_setinheritsched(attributes, PTHREAD_EXPLICIT_SCHED);
    if (error == 0) error = pthread_attr_setschedpolicy(attributes, SCHED_FIFO);
    if (error == 0) error = pthread_attr_setschedparam(attributes, &parameters);
    return error;
}

const struct cb_schedule cb_no_hurry = {.priority = 0, .cpu = -1};

int cb_start_thread(pthread_t *thread, const struct cb_schedule *schedule, void *(*run)(void *),
                    void *argument) {
    pthread_attr_t attributes;
    int error = pthread_attr_init(&attributes);
    if (error != 0) return error;
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    error = set_attributes(&attributes, schedule);
    if (error == 0) error = pthread_create(thread, &attributes, run, argument);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_attr_destroy(&attributes);
    return error;
}

static __attribute__((noinline)) void touch_stack(void) {
    volatile uint8_t stack[TOUCHED_BYTES];
    for (size_t i = 0; i < sizeof stack; i += PAGE_BYTES) stack[i] = 0;
}

void cb_settle_thread(const char *name) {
    prctl(PR_SET_NAME, name);
    prctl(PR_SET_TIMERSLACK, 1);
    touch_stack();
}
