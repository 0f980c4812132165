/* SPDX-License-Identifier: MIT
 * Preloaded into compboxd: what the kernel of a test machine does not have.
 *
 * CAN: the interface NAME is there where CAN_BUS/NAME is a local socket of the test (can_bus.py),
 * and frames are its datagrams. What the program asks of the kernel is reply to the test: the
 * filters, when it binds. What the kernel would say, the test says: a datagram {errno, errno of
 * sends} in place of a frame. Time stamps, queue and non-blocking calls are the real kernel's, of a
 * local socket.
 *
 * A file system that hangs: once the file HANG_FILE is there, the call that it names (open, stat,
 * fsync) never returns in the thread that calls it; HANG_FILE.hangs then says that it was called.
 * A wall clock: synchronised where CLOCK_SYNCHRONISED is 1, not where it is 0.
 *
 * A hardware watchdog: any file that stands for one takes timeouts up to WATCHDOG_MOST_S, and has
 * that one where it was asked for more. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/watchdog.h>
#include <net/if.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/timex.h>
#include <sys/un.h>
#include <unistd.h>

enum { FDS = 64, NAMES = 8, FILTERS = 128 };

static struct {
    int is_can, send_error;
    struct can_filter filters[FILTERS];
    size_t filter_bytes;
} fds[FDS];
static char names[NAMES][IFNAMSIZ];

#define NEXT(name) (*(void **)&next_##name = dlsym(RTLD_NEXT, #name))

static int is_can(int fd) {
    return fd >= 0 && fd < FDS && fds[fd].is_can;
}

static void path_of(const char *name, struct sockaddr_un *address) {
    *address = (struct sockaddr_un){.sun_family = AF_UNIX};
    snprintf(address->sun_path, sizeof address->sun_path, "%s/%s", getenv("CAN_BUS"), name);
}

unsigned if_nametoindex(const char *name) {
    struct sockaddr_un address;
    struct stat there;
    path_of(name, &address);
    errno = ENODEV;
    if (stat(address.sun_path, &there) != 0) return 0;
    for (unsigned i = 0; i < NAMES; i++) {
        if (names[i][0] == '\0') strncpy(names[i], name, IFNAMSIZ - 1);
        if (strcmp(names[i], name) == 0) return i + 1;
    }
    return 0;
}

int socket(int domain, int type, int protocol) {
    static int (*next_socket)(int, int, int);
    NEXT(socket);
    if (domain != PF_CAN) return next_socket(domain, type, protocol);
    const int fd = next_socket(AF_UNIX, SOCK_DGRAM | (type & (SOCK_NONBLOCK | SOCK_CLOEXEC)), 0);
    if (fd < 0 || fd >= FDS) return fd;
    memset(&fds[fd], 0, sizeof fds[fd]);
    fds[fd].is_can = 1;
    return fd;
}

int setsockopt(int fd, int level, int option, const void *value, socklen_t size) {
    static int (*next_setsockopt)(int, int, int, const void *, socklen_t);
    NEXT(setsockopt);
    if (level != SOL_CAN_RAW) return next_setsockopt(fd, level, option, value, size);
    if (!is_can(fd) || size > sizeof fds[fd].filters) return errno = EINVAL, -1;
    if (option != CAN_RAW_FILTER) return 0;
    memcpy(fds[fd].filters, value, size);
    fds[fd].filter_bytes = size;
    return 0;
}

/* As the kernel does, a socket may be bound to an interface that is down: its next receive fails.
 */
int bind(int fd, const struct sockaddr *address, socklen_t size) {
    static int (*next_bind)(int, const struct sockaddr *, socklen_t);
    struct sockaddr_un to, own = {.sun_family = AF_UNIX};
    NEXT(bind);
    if (!is_can(fd)) return next_bind(fd, address, size);
    const int index = ((const struct sockaddr_can *)(const void *)address)->can_ifindex;
    path_of(names[index - 1], &to);
    if (next_bind(fd, (struct sockaddr *)&own, sizeof own.sun_family) != 0) return -1;
    if (connect(fd, (struct sockaddr *)&to, sizeof to) != 0) return errno = ENODEV, -1;
    return write(fd, fds[fd].filters, fds[fd].filter_bytes) < 0 ? -1 : 0;
}

ssize_t recvmsg(int fd, struct msghdr *message, int flags) {
    static ssize_t (*next_recvmsg)(int, struct msghdr *, int);
    NEXT(recvmsg);
    const ssize_t got = next_recvmsg(fd, message, flags);
    if (!is_can(fd) || got != 2 * sizeof(int)) return got;
    int reply[2];
    memcpy(reply, message->msg_iov[0].iov_base, sizeof reply);
    fds[fd].send_error = reply[1];
    errno = reply[0];
    return reply[0] != 0 ? -1 : recvmsg(fd, message, flags);
}

ssize_t send(int fd, const void *bytes, size_t size, int flags) {
    static ssize_t (*next_send)(int, const void *, size_t, int);
    NEXT(send);
    if (is_can(fd) && fds[fd].send_error != 0) return errno = fds[fd].send_error, -1;
    return next_send(fd, bytes, size, flags);
}

/* An interface is up where CAN_BUS/NAME.down is not there. */
static int flags_of(struct ifreq *query) {
    struct sockaddr_un at;
    char name[IFNAMSIZ + 5];
    snprintf(name, sizeof name, "%.*s.down", IFNAMSIZ - 1, query->ifr_name);
    if (if_nametoindex(query->ifr_name) == 0) return errno = ENODEV, -1;
    path_of(name, &at);
    query->ifr_flags = access(at.sun_path, F_OK) == 0 ? 0 : IFF_UP | IFF_RUNNING;
    return 0;
}

/* Does not return where HANG_FILE names this call. By system calls that are not wrapped here. */
static void hang_in(const char *call) {
    const char *path = getenv("HANG_FILE");
    char named[16] = "", mark[4096];
    const int fd = path == NULL ? -1 : openat(AT_FDCWD, path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return;
    if (read(fd, named, sizeof named - 1) < 0) named[0] = '\0';
    close(fd);
    if (strcmp(named, call) != 0) return;
    snprintf(mark, sizeof mark, "%s.hangs", path);
    close(openat(AT_FDCWD, mark, O_WRONLY | O_CREAT | O_CLOEXEC, 0644));
    for (;;) pause();
}

int open(const char *path, int flags, ...) {
    va_list arguments;
    va_start(arguments, flags);
    const mode_t mode = flags & O_CREAT ? va_arg(arguments, mode_t) : 0;
    va_end(arguments);
    hang_in("open");
    return openat(AT_FDCWD, path, flags, mode);
}

int stat(const char *path, struct stat *there) {
    hang_in("stat");
    return fstatat(AT_FDCWD, path, there, 0);
}

int fsync(int fd) {
    static int (*next_fsync)(int);
    NEXT(fsync);
    hang_in("fsync");
    return next_fsync(fd);
}

int adjtimex(struct timex *query) {
    const int synchronised = atoi(getenv("CLOCK_SYNCHRONISED"));
    query->status = synchronised ? STA_PLL : STA_PLL | STA_UNSYNC;
    return synchronised ? TIME_OK : TIME_ERROR;
}

static int watchdog_timeout(unsigned long request, int *seconds) {
    static int now_s;
    const int most_s = atoi(getenv("WATCHDOG_MOST_S"));
    if (now_s == 0) now_s = most_s;
    if (request == WDIOC_SETTIMEOUT) {
        if (*seconds > most_s) return errno = EINVAL, -1;
        now_s = *seconds;
    }
    *seconds = now_s;
    return 0;
}

int ioctl(int fd, unsigned long request, ...) {
    static int (*next_ioctl)(int, unsigned long, ...);
    va_list arguments;
    va_start(arguments, request);
    void *argument = va_arg(arguments, void *);
    va_end(arguments);
    NEXT(ioctl);
    if (request == SIOCGIFFLAGS && getenv("CAN_BUS")) return flags_of(argument);
    const int watchdog = request == WDIOC_SETTIMEOUT || request == WDIOC_GETTIMEOUT;
    if (watchdog && getenv("WATCHDOG_MOST_S")) return watchdog_timeout(request, argument);
    return next_ioctl(fd, request, argument);
}
