/* SPDX-License-Identifier: MIT
 * Preloaded into compboxd: counts what its loop thread must not do, and how its pages fault.
 * SPY_FILE gets one "name count" line each at the end; off_grid counts the loop's wake-up times
 * that are not the first one and a whole number of SPY_PERIOD_NS (default 30 ms) later.
 * SPY_PLANT=malloc|open|lock|terminal makes the loop thread do it once in each cycle, to see that
 * the spy sees. What the thread does after its last tick, when it ends, is not counted. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *block, size_t size);
void __libc_free(void *block);

static atomic_long allocations, frees, files, writes, locks, terminals;
static long cycles, faults_at_10, published[7]; /* as they stood at the latest tick */
static long off_grid;

static int in_loop(void) {
    static __thread int known;
    char name[16];
    if (!known && prctl(PR_GET_NAME, name) == 0) known = strcmp(name, "compboxd-loop") == 0;
    return known;
}

static void count(atomic_long *what) {
    if (in_loop()) atomic_fetch_add(what, 1);
}

void *malloc(size_t size) {
    count(&allocations);
    return __libc_malloc(size);
}

void *calloc(size_t number, size_t size) {
    count(&allocations);
    return __libc_calloc(number, size);
}

void *realloc(void *block, size_t size) {
    count(&allocations);
    return __libc_realloc(block, size);
}

void free(void *block) {
    count(&frees);
    __libc_free(block);
}

int open(const char *path, int flags, ...) {
    va_list arguments;
    va_start(arguments, flags);
    mode_t mode = flags & O_CREAT ? va_arg(arguments, mode_t) : 0;
    va_end(arguments);
    count(&files);
    return openat(AT_FDCWD, path, flags, mode);
}

FILE *fopen(const char *path, const char *mode) {
    static FILE *(*next)(const char *, const char *);
    if (!next) *(void **)&next = dlsym(RTLD_NEXT, "fopen");
    count(&files);
    return next(path, mode);
}

ssize_t write(int fd, const void *bytes, size_t size) {
    static ssize_t (*next)(int, const void *, size_t);
    if (!next) *(void **)&next = dlsym(RTLD_NEXT, "write");
    count(&writes);
    return next(fd, bytes, size);
}

int pthread_mutex_lock(pthread_mutex_t *mutex) {
    static int (*next)(pthread_mutex_t *);
    if (!next) *(void **)&next = dlsym(RTLD_NEXT, "pthread_mutex_lock");
    count(&locks);
    return next(mutex);
}

/* What is set on a serial device as it is opened and closed. */
int tcsetattr(int fd, int actions, const struct termios *settings) {
    static int (*next)(int, int, const struct termios *);
    if (!next) *(void **)&next = dlsym(RTLD_NEXT, "tcsetattr");
    count(&terminals);
    return next(fd, actions, settings);
}

int tcflush(int fd, int queue) {
    static int (*next)(int, int);
    if (!next) *(void **)&next = dlsym(RTLD_NEXT, "tcflush");
    count(&terminals);
    return next(fd, queue);
}

static void do_what_is_planted(void) {
    static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
    const char *plant = getenv("SPY_PLANT");
    if (plant == NULL) return;
    void *volatile block = strcmp(plant, "malloc") == 0 ? malloc(1) : NULL;
    if (block != NULL) free(block);
    if (strcmp(plant, "open") == 0) close(open("/dev/null", O_RDONLY));
    if (strcmp(plant, "terminal") == 0) tcflush(-1, TCIOFLUSH);
    if (strcmp(plant, "lock") == 0) {
        pthread_mutex_lock(&mutex);
        pthread_mutex_unlock(&mutex);
    }
}

/* The counts of this thread up to now; page faults since the tenth tick. */
static void take_counts(void) {
    atomic_long *counted[] = {&allocations, &frees, &files, &writes, &locks, &terminals};
    for (int i = 0; i < 6; i++) published[i] = atomic_load(counted[i]);
    struct rusage usage;
    getrusage(RUSAGE_THREAD, &usage);
    if (cycles++ == 10) faults_at_10 = usage.ru_minflt + usage.ru_majflt;
    published[6] = cycles > 10 ? usage.ru_minflt + usage.ru_majflt - faults_at_10 : 0;
}

/* What the loop asks for, not when the machine lets it run. */
static void note_wake_up(int flags, const struct timespec *until) {
    static long long first_ns;
    const char *period = getenv("SPY_PERIOD_NS");
    const long long ns = until->tv_sec * 1000000000ll + until->tv_nsec;
    if (first_ns == 0) first_ns = ns;
    if (flags != TIMER_ABSTIME || (ns - first_ns) % (period ? atoll(period) : 30000000) != 0)
        off_grid++;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *until,
                    struct timespec *left) {
    static int (*next)(clockid_t, int, const struct timespec *, struct timespec *);
    if (!next) *(void **)&next = dlsym(RTLD_NEXT, "clock_nanosleep");
    if (in_loop()) {
        take_counts();
        note_wake_up(flags, until);
        do_what_is_planted();
    }
    return next(clock, flags, until, left);
}

static __attribute__((destructor)) void tell(void) {
    const char *names[] = {"allocations", "frees",     "files",      "writes",
                           "locks",       "terminals", "page_faults"};
    const char *path = getenv("SPY_FILE");
    FILE *file = path ? fopen(path, "w") : NULL;
    if (file == NULL) return;
    fprintf(file, "cycles %ld\noff_grid %ld\n", cycles, off_grid);
    for (int i = 0; i < 7; i++) fprintf(file, "%s %ld\n", names[i], published[i]);
    fclose(file);
}
