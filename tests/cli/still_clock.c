/* SPDX-License-Identifier: MIT
 * LD_PRELOAD of compbox, compboxd and fakeplc: programs that share the file $STILL_CLOCK have one
 * clock, which stands while any of their threads runs. When all wait and nothing is under way, it
 * goes on to the earliest time that one of them waits for: a busy machine changes nothing, and
 * nothing waits for real time. A program that is alone has a clock as fast as the wall's. */
#include <errno.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

enum {
    SLOTS = 16,
    DESCRIPTORS = 64,
    CALL_NS = 1000,
    PAUSE_NS = 20000,
    REAL_NS = 2000000,
    LOOKS = 50
};
static const int64_t never_ns = INT64_MAX;

/* One thread that the clock waits for. */
struct slot {
    _Atomic int32_t thread;  /* 0: free */
    _Atomic int32_t process; /* of the thread */
    _Atomic int32_t waits;
    _Atomic int64_t until_ns;
    _Atomic int32_t only_sleeps; /* what others send does not matter */
    _Atomic uint64_t looked;     /* number of sendings after which it found nothing to do */
    _Atomic uint32_t bell;       /* counts reasons to look */
};

static struct world {
    _Atomic int64_t now_ns;
    _Atomic uint64_t generation; /* counts beginnings and ends of waits, and steps of the clock */
    _Atomic uint64_t sendings;
    struct slot slots[SLOTS];
} * of_program;
static _Thread_local struct slot *own;
static _Thread_local struct world *joined, *entered;
static _Atomic uint64_t waited_for, sent_on; /* descriptors, bit N for descriptor N */
enum kind { UNKNOWN, OTHER, SOCKET, TCP };
static _Atomic uint8_t kinds[DESCRIPTORS]; /* UNKNOWN or TCP */
static pthread_key_t at_end;               /* of a thread */

static struct world *here(void) {
    return entered != NULL ? entered : of_program;
}

/* ---- members */

static struct world *opened(const char *path) {
    const int fd = open(path, O_RDWR | O_CLOEXEC);
    if (fd < 0) abort();
    struct world *shared =
        mmap(NULL, sizeof(struct world), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    if (shared == MAP_FAILED) abort();
    int64_t none = 0;
    atomic_compare_exchange_strong(&shared->now_ns, &none, 1000000000000);
    return shared;
}

/* A test opens one world after the other, in each of which its threads are new. */
void still_open(const char *path);
void still_open(const char *path) {
    of_program = opened(path);
}

static void leave_by_thread(void *slot);

__attribute__((constructor)) static void open_own(void) {
    const char *path = getenv("STILL_CLOCK");
    if (pthread_key_create(&at_end, leave_by_thread) != 0) abort();
    if (path != NULL) still_open(path);
}

static void changed(void) {
    atomic_fetch_add(&here()->generation, 1);
}

/* in : a time: threads that wait for a later one need not look; never_ns: something was sent */
static void ring(int64_t until_ns) {
    for (struct slot *one = here()->slots; one < here()->slots + SLOTS; ++one) {
        if (one == own || atomic_load(&one->thread) == 0 || !atomic_load(&one->waits) ||
            atomic_load(&one->until_ns) > until_ns ||
            (until_ns == never_ns && atomic_load(&one->only_sleeps)))
            continue;
        atomic_fetch_add(&one->bell, 1);
        syscall(SYS_futex, &one->bell, FUTEX_WAKE, 1, NULL, NULL, 0);
    }
}

/* in : on which descriptor */
static void sent(int fd) {
    if (here() == NULL) return;
    if (fd >= 0 && fd < DESCRIPTORS) atomic_fetch_or(&sent_on, (uint64_t)1 << fd);
    atomic_fetch_add(&here()->sendings, 1);
    ring(never_ns);
}

/* in : a thread joins by its first call that waits or looks at the clock, and one of the test by
 * its first wait */
static void join(void) {
    for (struct slot *one = here()->slots; own == NULL && one < here()->slots + SLOTS; ++one) {
        int32_t free = 0;
        if (atomic_compare_exchange_strong(&one->thread, &free, (int32_t)gettid())) own = one;
    }
    if (own == NULL) abort();
    atomic_store(&own->process, (int32_t)getpid());
    pthread_setspecific(at_end, own);
    joined = here();
    sent(-1);
    changed();
}

static void drop(struct slot *slot) {
    atomic_store(&slot->waits, 0);
    atomic_store(&slot->process, 0);
    atomic_store(&slot->thread, 0);
    sent(-1);
    changed();
}

void still_leave(void);
void still_leave(void) {
    if (own != NULL) drop(own);
    own = NULL;
    entered = NULL;
    pthread_setspecific(at_end, NULL);
}

/* A thread of the test that acts on programs belongs to their world at once: the clock stands but
 * where it waits in still_wait_here or still_sleep, until still_leave. */
void still_enter(const char *path);
void still_enter(const char *path) {
    still_leave();
    entered = opened(path);
    join();
}

/* A slot of an earlier world is no longer of any use to it. */
static void leave_by_thread(void *slot) {
    if (slot == own && joined == here()) still_leave();
}

/* A program that ends takes its threads along. */
__attribute__((destructor)) static void leave_world(void) {
    const struct world *left = here();
    for (int i = 0; left != NULL && i < SLOTS; ++i)
        if (atomic_load(&left->slots[i].process) == (int32_t)getpid()) drop(&here()->slots[i]);
    own = NULL;
}

/* out: whether the thread has ended, also if its program is not waited for */
static bool has_ended(int32_t thread) {
    char name[32], state = 'Z';
    snprintf(name, sizeof name, "/proc/%d/stat", (int)thread);
    FILE *file = fopen(name, "r");
    if (file == NULL) return true;
    const bool read = fscanf(file, "%*d (%*[^)]) %c", &state) == 1;
    fclose(file);
    return !read || state == 'Z' || state == 'X';
}

static void drop_the_ended(void) {
    for (struct slot *one = here()->slots; one < here()->slots + SLOTS; ++one) {
        const int32_t thread = atomic_load(&one->thread);
        if (thread != 0 && has_ended(thread)) drop(one);
    }
}

/* ---- time */

static int64_t kernel_ns(void) {
    struct timespec now;
    syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static int64_t now_ns(void) {
    return atomic_fetch_add(&here()->now_ns, CALL_NS) + CALL_NS;
}

static void go_on_to(int64_t to_ns) {
    int64_t now = atomic_load(&here()->now_ns);
    while (now < to_ns && !atomic_compare_exchange_weak(&here()->now_ns, &now, to_ns)) continue;
}

/* in : 0 <= fd < DESCRIPTORS */
static enum kind kind_of(int fd) {
    int protocol = 0, listens = 0;
    socklen_t length = sizeof protocol;
    if (atomic_load(&kinds[fd]) == TCP) return TCP;
    if (getsockopt(fd, SOL_SOCKET, SO_PROTOCOL, &protocol, &length) != 0) return OTHER;
    if (getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &listens, &length) != 0 || listens ||
        protocol != IPPROTO_TCP)
        return SOCKET;
    atomic_store(&kinds[fd], TCP);
    return TCP;
}

static bool is_under_way(int fd) {
    int bytes = 0;
    struct pollfd end = {.fd = fd};
    return kind_of(fd) != OTHER && ioctl(fd, SIOCOUTQ, &bytes) == 0 && bytes > 0 &&
           syscall(SYS_poll, &end, 1, 0) == 0;
}

/* Waits until the kernel has delivered what this process sent: then a peer's look finds it. */
static void deliver(void) {
    const uint64_t fds = atomic_exchange(&sent_on, 0);
    for (int fd = 0; fd < DESCRIPTORS && fds >> fd != 0; ++fd) {
        for (int looks = 0; fds >> fd & 1 && looks < 10000 && is_under_way(fd); ++looks)
            syscall(SYS_clock_nanosleep, CLOCK_MONOTONIC, 0, &(struct timespec){0, PAUSE_NS}, NULL);
    }
}

/* A peer in deliver() waits for the kernel's acknowledgement, which it would keep back for 40 ms.
 */
static void acknowledge(void) {
    const int on = 1;
    const uint64_t fds = atomic_load(&waited_for);
    for (int fd = 0; fd < DESCRIPTORS && fds >> fd != 0; ++fd)
        if ((fds >> fd & 1) && kind_of(fd) == TCP)
            setsockopt(fd, IPPROTO_TCP, TCP_QUICKACK, &on, sizeof on);
}

/* out: when the clock may go to; never_ns: a thread runs, or has yet to look. *members: how many
 * there are */
static int64_t next_ns(uint64_t sendings, int *members) {
    int64_t next = never_ns;
    bool all = true;
    *members = 0;
    for (struct slot *one = here()->slots; one < here()->slots + SLOTS; ++one) {
        if (atomic_load(&one->thread) == 0) continue;
        ++*members;
        all = all && atomic_load(&one->waits) &&
              (atomic_load(&one->only_sleeps) || atomic_load(&one->looked) == sendings);
        const int64_t until = atomic_load(&one->until_ns);
        if (until < next) next = until;
    }
    return all ? next : never_ns;
}

static int look(struct pollfd *fds, nfds_t count, int64_t ns, const sigset_t *mask) {
    struct timespec pause = {ns / 1000000000, ns % 1000000000};
    return (int)syscall(SYS_ppoll, fds, count, &pause, mask, (size_t)8);
}

/* Ends its look for now: the clock goes on if all have looked, else this thread waits for a reason
 * to look again. out: as ppoll; 0: it has to look again */
static int pause_or_go_on(struct pollfd *fds, nfds_t count, uint64_t sendings, uint32_t bell) {
    const struct timespec real = {0, REAL_NS};
    int members = 0;
    uint64_t generation = atomic_load(&here()->generation);
    const int64_t next = next_ns(sendings, &members);
    if (members == 1) {
        const int64_t from_ns = kernel_ns();
        const int found = look(fds, count, REAL_NS, NULL);
        atomic_fetch_add(&here()->now_ns, kernel_ns() - from_ns);
        return found;
    }
    /* A thread whose time has come, but which the processor has not run yet: it goes first. */
    if (next == never_ns || next <= atomic_load(&here()->now_ns)) {
        syscall(SYS_futex, &own->bell, FUTEX_WAIT, bell, &real, NULL, 0);
    } else if (atomic_compare_exchange_strong(&here()->generation, &generation, generation + 1)) {
        go_on_to(next);
        ring(next);
    }
    return 0;
}

/* As ppoll, until a time of the world's clock. */
static int wait_for(struct pollfd *fds, nfds_t count, int64_t until_ns, const sigset_t *mask) {
    int found = 0;
    if (own == NULL) join();
    for (nfds_t i = 0; i < count; ++i)
        if (fds[i].fd >= 0 && fds[i].fd < DESCRIPTORS)
            atomic_fetch_or(&waited_for, (uint64_t)1 << fds[i].fd);
    deliver();
    acknowledge();
    atomic_store(&own->until_ns, until_ns);
    atomic_store(&own->looked, UINT64_MAX);
    atomic_store(&own->only_sleeps, count == 0);
    atomic_store(&own->waits, 1);
    changed();
    for (int looks = 1; joined == here(); ++looks) {
        const uint32_t bell = atomic_load(&own->bell);
        const uint64_t sendings = atomic_load(&here()->sendings);
        found = look(fds, count, 0, mask);
        if (found != 0 || atomic_load(&here()->now_ns) >= until_ns) break;
        atomic_store(&own->looked, sendings);
        found = pause_or_go_on(fds, count, sendings, bell);
        if (found != 0) break;
        if (looks % LOOKS == 0) drop_the_ended();
        acknowledge();
    }
    const int error = errno;
    atomic_store(&own->waits, 0);
    changed();
    errno = error;
    return found;
}

/* For a thread of the test that passes on what programs send. out: 0; -1: there is another world by
 * now */
int still_wait_readable(int fd);
int still_wait_readable(int fd) {
    struct pollfd look_at = {.fd = fd, .events = POLLIN};
    if (own != NULL) sent(fd); /* the test's own calls are not seen here */
    atomic_fetch_or(&sent_on, atomic_load(&waited_for));
    wait_for(&look_at, 1, never_ns, NULL);
    return joined == here() ? 0 : -1;
}

/* For a thread that has entered; for others nothing. */
void still_wait_here(int fd);
void still_wait_here(int fd) {
    if (own != NULL) still_wait_readable(fd);
}

/* ---- calls of libc */

static int64_t ns_of(const struct timespec *time) {
    return (int64_t)time->tv_sec * 1000000000 + time->tv_nsec;
}

int clock_gettime(clockid_t clock, struct timespec *now) {
    if (here() == NULL || (clock != CLOCK_MONOTONIC && clock != CLOCK_BOOTTIME))
        return (int)syscall(SYS_clock_gettime, clock, now);
    if (own == NULL) join();
    const int64_t ns = now_ns();
    *now = (struct timespec){ns / 1000000000, ns % 1000000000};
    return 0;
}

int ppoll(struct pollfd *fds, nfds_t count, const struct timespec *left, const sigset_t *mask) {
    struct timespec rest = left == NULL ? (struct timespec){0} : *left;
    if (here() == NULL)
        return (int)syscall(SYS_ppoll, fds, count, left == NULL ? NULL : &rest, mask, (size_t)8);
    return wait_for(fds, count, left == NULL ? never_ns : now_ns() + ns_of(left), mask);
}

int poll(struct pollfd *fds, nfds_t count, int ms) {
    if (here() == NULL || ms == 0) return (int)syscall(SYS_poll, fds, count, ms);
    return wait_for(fds, count, ms < 0 ? never_ns : now_ns() + (int64_t)ms * 1000000, NULL);
}

/* libmodbus waits for one descriptor. */
int select(int count, fd_set *readable, fd_set *writable, fd_set *odd, struct timeval *left) {
    struct pollfd fds[DESCRIPTORS];
    nfds_t used = 0;
    const int64_t left_ns =
        left == NULL ? never_ns : (int64_t)left->tv_sec * 1000000000 + left->tv_usec * 1000;
    for (int fd = 0; here() != NULL && fd < count && fd < DESCRIPTORS; ++fd) {
        const int events = (readable && FD_ISSET(fd, readable) ? POLLIN : 0) |
                           (writable && FD_ISSET(fd, writable) ? POLLOUT : 0);
        if (events != 0) fds[used++] = (struct pollfd){.fd = fd, .events = (short)events};
    }
    if (used > 0 && wait_for(fds, used, left == NULL ? never_ns : now_ns() + left_ns, NULL) < 0)
        return -1;
    struct timeval none = {0, 0};
    return (int)syscall(SYS_select, count, readable, writable, odd, here() == NULL ? left : &none);
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *until,
                    struct timespec *rest) {
    if (here() == NULL)
        return syscall(SYS_clock_nanosleep, clock, flags, until, rest) == 0 ? 0 : errno;
    return wait_for(NULL, 0, ns_of(until) + (flags == TIMER_ABSTIME ? 0 : now_ns()), NULL) < 0
               ? errno
               : 0;
}

int nanosleep(const struct timespec *duration, struct timespec *rest) {
    if (here() == NULL) return (int)syscall(SYS_nanosleep, duration, rest);
    return wait_for(NULL, 0, now_ns() + ns_of(duration), NULL) < 0 ? -1 : 0;
}

void still_sleep(int64_t ns);
void still_sleep(int64_t ns) {
    const struct timespec duration = {ns / 1000000000, ns % 1000000000};
    if (own != NULL)
        wait_for(NULL, 0, now_ns() + ns, NULL);
    else
        syscall(SYS_nanosleep, &duration, NULL);
}

/* The kernel connects or refuses before time goes on. */
int connect(int fd, const struct sockaddr *address, socklen_t size) {
    const int result = (int)syscall(SYS_connect, fd, address, size);
    if (here() == NULL || result == 0 || errno != EINPROGRESS) return result;
    struct pollfd made = {.fd = fd, .events = POLLOUT};
    look(&made, 1, 60000000000, NULL);
    errno = EINPROGRESS;
    return -1;
}

ssize_t send(int fd, const void *bytes, size_t count, int flags) {
    const ssize_t result = syscall(SYS_sendto, fd, bytes, count, flags, NULL, 0);
    sent(fd);
    return result;
}

ssize_t write(int fd, const void *bytes, size_t count) {
    const ssize_t result = syscall(SYS_write, fd, bytes, count);
    sent(fd);
    return result;
}

int shutdown(int fd, int how) {
    const int result = (int)syscall(SYS_shutdown, fd, how);
    sent(fd);
    return result;
}

int close(int fd) {
    if (fd >= 0 && fd < DESCRIPTORS) {
        atomic_fetch_and(&waited_for, ~((uint64_t)1 << fd));
        atomic_store(&kinds[fd], UNKNOWN);
    }
    const int result = (int)syscall(SYS_close, fd);
    sent(fd);
    return result;
}

/* A signal is seen at the end of the wait, whose times are short. */
int sigtimedwait(const sigset_t *set, siginfo_t *info, const struct timespec *left) {
    const struct timespec none = {0, 0};
    for (bool waited = here() == NULL;; waited = true) {
        const int signal =
            (int)syscall(SYS_rt_sigtimedwait, set, info, here() == NULL ? left : &none, (size_t)8);
        if (signal >= 0 || waited) return signal;
        wait_for(NULL, 0, now_ns() + ns_of(left), NULL);
    }
}

/* The clock goes on while a thread waits for the end of another. */
int pthread_join(pthread_t thread, void **result) {
    for (;;) {
        const int error = pthread_tryjoin_np(thread, result);
        if (error != EBUSY) return error;
        nanosleep(&(struct timespec){0, 1000000}, NULL);
    }
}

/* Which goes before others is of no use to a clock that waits for all. */
int sched_setscheduler(pid_t pid, int policy, const struct sched_param *parameter) {
    if (here() == NULL) return (int)syscall(SYS_sched_setscheduler, pid, policy, parameter);
    errno = EPERM;
    return -1;
}
