/* SPDX-License-Identifier: MIT
 * LD_PRELOAD of compbox and fakeplc: programs that share the file $STILL_CLOCK have one clock,
 * which stands while any of them runs. When all wait and nothing is under way, it goes on to the
 * earliest time that one of them waits for: a busy machine changes nothing, and nothing waits for
 * real time. A program that is alone has a clock as fast as the wall's. */
#include <errno.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
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
    _Atomic int32_t pid; /* 0: free */
    _Atomic int32_t waits;
    _Atomic int64_t until_ns;
    _Atomic uint64_t looked; /* number of sendings after which it found nothing to do */
    _Atomic uint32_t bell;   /* counts reasons to look */
};

static struct world {
    _Atomic int64_t now_ns;
    _Atomic uint64_t generation; /* counts beginnings and ends of waits, and steps of the clock */
    _Atomic uint64_t sendings;
    struct slot slots[SLOTS];
} * world;
static _Thread_local struct slot *own;
static _Thread_local struct world *joined;
static _Atomic uint64_t waited_for, sent_on; /* descriptors, bit N for descriptor N */

/* ---- members */

/* A test opens one world after the other, in each of which its threads are new. */
void still_open(const char *path);
void still_open(const char *path) {
    const int fd = open(path, O_RDWR | O_CLOEXEC);
    if (fd < 0) abort();
    void *shared = mmap(NULL, sizeof *world, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    if (shared == MAP_FAILED) abort();
    world = shared;
    int64_t none = 0;
    atomic_compare_exchange_strong(&world->now_ns, &none, 1000000000000);
}

__attribute__((constructor)) static void open_own(void) {
    const char *path = getenv("STILL_CLOCK");
    if (path != NULL) still_open(path);
}

static void changed(void) {
    atomic_fetch_add(&world->generation, 1);
}

/* in : a time up to which threads that wait for a later one need not look */
static void ring(int64_t until_ns) {
    for (struct slot *one = world->slots; one < world->slots + SLOTS; ++one) {
        if (one == own || atomic_load(&one->pid) == 0 || atomic_load(&one->until_ns) > until_ns)
            continue;
        atomic_fetch_add(&one->bell, 1);
        syscall(SYS_futex, &one->bell, FUTEX_WAKE, 1, NULL, NULL, 0);
    }
}

/* in : on which descriptor */
static void sent(int fd) {
    if (world == NULL) return;
    if (fd >= 0 && fd < DESCRIPTORS) atomic_fetch_or(&sent_on, (uint64_t)1 << fd);
    atomic_fetch_add(&world->sendings, 1);
    ring(never_ns);
}

/* in : a program joins by its first call that waits or looks at the clock, and a thread of the test
 * by its first wait */
static void join(void) {
    for (struct slot *one = world->slots; own == NULL && one < world->slots + SLOTS; ++one) {
        int32_t free = 0;
        if (atomic_compare_exchange_strong(&one->pid, &free, (int32_t)getpid())) own = one;
    }
    if (own == NULL) abort();
    joined = world;
    sent(-1);
    changed();
}

static void drop(struct slot *slot) {
    atomic_store(&slot->waits, 0);
    atomic_store(&slot->pid, 0);
    sent(-1);
    changed();
}

void still_leave(void);
void still_leave(void) {
    if (own != NULL) drop(own);
    own = NULL;
}

__attribute__((destructor)) static void leave_world(void) {
    if (world != NULL) still_leave();
}

/* out: whether the process has ended, also if nobody has waited for it */
static bool has_ended(int32_t pid) {
    char name[32], state = 'Z';
    snprintf(name, sizeof name, "/proc/%d/stat", (int)pid);
    FILE *file = fopen(name, "r");
    if (file == NULL) return true;
    const bool read = fscanf(file, "%*d (%*[^)]) %c", &state) == 1;
    fclose(file);
    return !read || state == 'Z' || state == 'X';
}

static void drop_the_ended(void) {
    for (struct slot *one = world->slots; one < world->slots + SLOTS; ++one) {
        const int32_t pid = atomic_load(&one->pid);
        if (pid != 0 && has_ended(pid)) drop(one);
    }
}

/* ---- time */

static int64_t kernel_ns(void) {
    struct timespec now;
    syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static int64_t now_ns(void) {
    return atomic_fetch_add(&world->now_ns, CALL_NS) + CALL_NS;
}

static void go_on_to(int64_t to_ns) {
    int64_t now = atomic_load(&world->now_ns);
    while (now < to_ns && !atomic_compare_exchange_weak(&world->now_ns, &now, to_ns)) continue;
}

static bool is_under_way(int fd) {
    int bytes = 0, size = 0;
    socklen_t length = sizeof size;
    struct pollfd end = {.fd = fd};
    return getsockopt(fd, SOL_SOCKET, SO_TYPE, &size, &length) == 0 &&
           ioctl(fd, SIOCOUTQ, &bytes) == 0 && bytes > 0 && syscall(SYS_poll, &end, 1, 0) == 0;
}

/* Waits until the kernel has delivered what this process sent: then a peer's look finds it. */
static void deliver(void) {
    const uint64_t fds = atomic_exchange(&sent_on, 0);
    for (int fd = 0; fd < DESCRIPTORS; ++fd) {
        for (int looks = 0; fds >> fd & 1 && looks < 10000 && is_under_way(fd); ++looks)
            syscall(SYS_clock_nanosleep, CLOCK_MONOTONIC, 0, &(struct timespec){0, PAUSE_NS}, NULL);
    }
}

/* A peer in deliver() waits for the kernel's acknowledgement, which it would keep back for 40 ms.
 */
static void acknowledge(void) {
    const int on = 1;
    const uint64_t fds = atomic_load(&waited_for);
    for (int fd = 0; fd < DESCRIPTORS; ++fd)
        if (fds >> fd & 1) setsockopt(fd, IPPROTO_TCP, TCP_QUICKACK, &on, sizeof on);
}

/* out: when the clock may go to; never_ns: a thread runs, or has yet to look. *members: how many
 * there are */
static int64_t next_ns(uint64_t sendings, int *members) {
    int64_t next = never_ns;
    bool all = true;
    *members = 0;
    for (struct slot *one = world->slots; one < world->slots + SLOTS; ++one) {
        if (atomic_load(&one->pid) == 0) continue;
        ++*members;
        all = all && atomic_load(&one->waits) && atomic_load(&one->looked) == sendings;
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
    uint64_t generation = atomic_load(&world->generation);
    const int64_t next = next_ns(sendings, &members);
    if (members == 1) {
        const int64_t from_ns = kernel_ns();
        const int found = look(fds, count, REAL_NS, NULL);
        atomic_fetch_add(&world->now_ns, kernel_ns() - from_ns);
        return found;
    }
    if (next == never_ns) {
        syscall(SYS_futex, &own->bell, FUTEX_WAIT, bell, &real, NULL, 0);
    } else if (atomic_compare_exchange_strong(&world->generation, &generation, generation + 1)) {
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
    atomic_store(&own->waits, 1);
    changed();
    for (int looks = 1; joined == world; ++looks) {
        const uint32_t bell = atomic_load(&own->bell);
        const uint64_t sendings = atomic_load(&world->sendings);
        found = look(fds, count, 0, mask);
        if (found != 0 || atomic_load(&world->now_ns) >= until_ns) break;
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
    return joined == world ? 0 : -1;
}

/* ---- calls of libc */

static int64_t ns_of(const struct timespec *time) {
    return (int64_t)time->tv_sec * 1000000000 + time->tv_nsec;
}

int clock_gettime(clockid_t clock, struct timespec *now) {
    if (world == NULL || (clock != CLOCK_MONOTONIC && clock != CLOCK_BOOTTIME))
        return (int)syscall(SYS_clock_gettime, clock, now);
    if (own == NULL) join();
    const int64_t ns = now_ns();
    *now = (struct timespec){ns / 1000000000, ns % 1000000000};
    return 0;
}

int ppoll(struct pollfd *fds, nfds_t count, const struct timespec *left, const sigset_t *mask) {
    struct timespec rest = left == NULL ? (struct timespec){0} : *left;
    if (world == NULL)
        return (int)syscall(SYS_ppoll, fds, count, left == NULL ? NULL : &rest, mask, (size_t)8);
    return wait_for(fds, count, left == NULL ? never_ns : now_ns() + ns_of(left), mask);
}

int poll(struct pollfd *fds, nfds_t count, int ms) {
    if (world == NULL || ms == 0) return (int)syscall(SYS_poll, fds, count, ms);
    return wait_for(fds, count, ms < 0 ? never_ns : now_ns() + (int64_t)ms * 1000000, NULL);
}

/* libmodbus waits for one descriptor. */
int select(int count, fd_set *readable, fd_set *writable, fd_set *odd, struct timeval *left) {
    struct pollfd fds[DESCRIPTORS];
    nfds_t used = 0;
    const int64_t left_ns =
        left == NULL ? never_ns : (int64_t)left->tv_sec * 1000000000 + left->tv_usec * 1000;
    for (int fd = 0; world != NULL && fd < count && fd < DESCRIPTORS; ++fd) {
        const int events = (readable && FD_ISSET(fd, readable) ? POLLIN : 0) |
                           (writable && FD_ISSET(fd, writable) ? POLLOUT : 0);
        if (events != 0) fds[used++] = (struct pollfd){.fd = fd, .events = (short)events};
    }
    if (used > 0 && wait_for(fds, used, left == NULL ? never_ns : now_ns() + left_ns, NULL) < 0)
        return -1;
    struct timeval none = {0, 0};
    return (int)syscall(SYS_select, count, readable, writable, odd, world == NULL ? left : &none);
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *until,
                    struct timespec *rest) {
    if (world == NULL)
        return syscall(SYS_clock_nanosleep, clock, flags, until, rest) == 0 ? 0 : errno;
    return wait_for(NULL, 0, ns_of(until) + (flags == TIMER_ABSTIME ? 0 : now_ns()), NULL) < 0
               ? errno
               : 0;
}

int nanosleep(const struct timespec *duration, struct timespec *rest) {
    if (world == NULL) return (int)syscall(SYS_nanosleep, duration, rest);
    return wait_for(NULL, 0, now_ns() + ns_of(duration), NULL) < 0 ? -1 : 0;
}

/* The kernel connects or refuses before time goes on. */
int connect(int fd, const struct sockaddr *address, socklen_t size) {
    const int result = (int)syscall(SYS_connect, fd, address, size);
    if (world == NULL || result == 0 || errno != EINPROGRESS) return result;
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
    const int result = (int)syscall(SYS_close, fd);
    sent(fd);
    return result;
}

/* Which goes before others is of no use to a clock that waits for all. */
int sched_setscheduler(pid_t pid, int policy, const struct sched_param *parameter) {
    if (world == NULL) return (int)syscall(SYS_sched_setscheduler, pid, policy, parameter);
    errno = EPERM;
    return -1;
}
