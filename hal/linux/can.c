/* SPDX-License-Identifier: MIT */
#include "hal/linux/can.h"

#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "hal/linux/clock.h"

_Static_assert(CB_CAN_EXTENDED == CAN_EFF_FLAG, "identifiers are the kernel's");

enum {
    MAX_IDS = 128,
    RECEIVE_BUFFER_BYTES = 512 * 1024, /* about 500 frames; the kernel may grant less */
};

void cb_can_start(struct cb_can *can, bool wanted) {
    *can = (struct cb_can){.fd = -1, .offered = -1, .returned = -1, .wanted = wanted};
}

/* ---- the normal thread ---- */

/* Without the two flags in its mask a filter would also pass 29-bit and remote frames. */
static int set_filters(int fd, const uint32_t *ids, unsigned count) {
    struct can_filter filters[MAX_IDS];
    if (count > MAX_IDS) return EINVAL;
    for (unsigned i = 0; i < count; i++) {
        const uint32_t bits = ids[i] & CAN_EFF_FLAG ? CAN_EFF_MASK : CAN_SFF_MASK;
        const uint32_t mask = (bits & cb_can_mask(ids[i])) | CAN_EFF_FLAG | CAN_RTR_FLAG;
        filters[i] = (struct can_filter){ids[i] & ~CB_CAN_ANY_SOURCE, mask};
    }
    const socklen_t size = (socklen_t)(count * sizeof filters[0]);
    return setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters, size) == 0 ? 0 : errno;
}

static int set_options(int fd) {
    const can_err_mask_t errors = CAN_ERR_TX_TIMEOUT | CAN_ERR_CRTL | CAN_ERR_PROT | CAN_ERR_TRX |
                                  CAN_ERR_ACK | CAN_ERR_BUSOFF | CAN_ERR_BUSERROR |
                                  CAN_ERR_RESTARTED;
    const int on = 1, bytes = RECEIVE_BUFFER_BYTES;
    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    if (setsockopt(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) != 0 ||
        setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) != 0 ||
        setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) != 0)
        return errno;
    return 0;
}

static int bind_to(int fd, const char *interface) {
    struct sockaddr_can address = {.can_family = AF_CAN,
                                   .can_ifindex = (int)if_nametoindex(interface)};
    if (address.can_ifindex == 0) return ENODEV; /* 0 would be every interface */
    if (bind(fd, (const struct sockaddr *)&address, sizeof address) == 0) return 0;
    return errno;
}

int cb_can_open(const char *interface, const uint32_t *ids, unsigned count) {
    int fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (fd < 0) return -errno;
    int error = set_filters(fd, ids, count);
    if (error == 0) error = set_options(fd);
    if (error == 0) error = bind_to(fd, interface);
    if (error == 0) return fd;
    close(fd);
    return -error;
}

bool cb_can_wanted(const struct cb_can *can) {
    return __atomic_load_n(&can->wanted, __ATOMIC_ACQUIRE) &&
           __atomic_load_n(&can->offered, __ATOMIC_ACQUIRE) < 0;
}

static void close_if_any(int fd) {
    if (fd >= 0) close(fd);
}

void cb_can_offer(struct cb_can *can, int fd) {
    __atomic_store_n(&can->offered_us, cb_boottime_us(), __ATOMIC_RELEASE);
    close_if_any(__atomic_exchange_n(&can->offered, fd, __ATOMIC_ACQ_REL));
}

void cb_can_revoke(struct cb_can *can) {
    __atomic_store_n(&can->revoked, true, __ATOMIC_RELEASE);
}

static bool is_up(const char *interface) {
    struct ifreq query = {.ifr_flags = 0};
    const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0); /* any kind serves */
    strncpy(query.ifr_name, interface, sizeof query.ifr_name - 1);
    const bool up = fd >= 0 && ioctl(fd, SIOCGIFFLAGS, &query) == 0 && query.ifr_flags & IFF_UP;
    close_if_any(fd);
    return up;
}

void cb_can_look(struct cb_can *can, const char *interface) {
    const uint32_t downs = __atomic_load_n(&can->downs, __ATOMIC_ACQUIRE);
    if (downs == can->up_after || !is_up(interface)) return;
    __atomic_store_n(&can->up_after, downs, __ATOMIC_RELEASE);
}

void cb_can_tidy(struct cb_can *can) {
    close_if_any(__atomic_exchange_n(&can->returned, -1, __ATOMIC_ACQ_REL));
}

void cb_can_close(struct cb_can *can) {
    cb_can_tidy(can);
    cb_can_offer(can, -1);
    close_if_any(can->fd);
    can->fd = -1;
    can->state = CB_CAN_CLOSED;
}

/* ---- the loop ---- */

static void come_up(struct cb_can *can) {
    can->state = CB_CAN_UP;
    can->is_back = true;
}

/* out: false: a revoked socket is still here, because the other thread has not yet closed the last
 *      returned one */
static bool obey_revocation(struct cb_can *can) {
    if (!__atomic_load_n(&can->revoked, __ATOMIC_ACQUIRE)) return true;
    cb_can_leave(can);
    if (can->fd >= 0) return false;
    __atomic_store_n(&can->revoked, false, __ATOMIC_RELEASE);
    cb_can_want(can, true);
    return true;
}

/* Takes the other thread's observation, if it is about the latest time that the interface went
 * down. */
static void notice_up(struct cb_can *can) {
    if (can->state != CB_CAN_DOWN) return;
    if (__atomic_load_n(&can->up_after, __ATOMIC_ACQUIRE) == can->downs) come_up(can);
}

/* out: false: the last returned socket is not closed yet, or this one may have frames of before the
 *      offer, which the offered one lacks */
static bool can_be_replaced(const struct cb_can *can, int64_t offered_us) {
    return __atomic_load_n(&can->returned, __ATOMIC_ACQUIRE) < 0 &&
           can->not_before_us >= offered_us;
}

/* Takes the socket that the other thread offers. */
static void take_offer(struct cb_can *can, int64_t now_us) {
    if (__atomic_load_n(&can->offered, __ATOMIC_ACQUIRE) < 0) return;
    const int64_t offered_us = __atomic_load_n(&can->offered_us, __ATOMIC_ACQUIRE);
    if (can->fd >= 0 && !can_be_replaced(can, offered_us)) return;
    const int fd = __atomic_exchange_n(&can->offered, -1, __ATOMIC_ACQ_REL);
    if (fd < 0) return;
    const bool replaces = can->fd >= 0; /* other filters: the state of the bus is unchanged */
    if (replaces) __atomic_store_n(&can->returned, can->fd, __ATOMIC_RELEASE);
    __atomic_store_n(&can->wanted, false, __ATOMIC_RELEASE);
    can->fd = fd;
    can->lost_in_queue = 0;
    can->seen_ns = replaces ? can->stamp_ns : 0;
    if (replaces) return;
    can->not_before_us = offered_us < now_us ? offered_us : now_us;
    can->state = CB_CAN_CLOSED;
    come_up(can);
}

void cb_can_want(struct cb_can *can, bool wanted) {
    __atomic_store_n(&can->wanted, wanted, __ATOMIC_RELEASE);
}

void cb_can_leave(struct cb_can *can) {
    if (can->fd < 0 || __atomic_load_n(&can->returned, __ATOMIC_ACQUIRE) >= 0) return;
    __atomic_store_n(&can->returned, can->fd, __ATOMIC_RELEASE);
    can->fd = -1;
    can->state = CB_CAN_CLOSED;
}

/* Counts a socket error; the caller excludes an empty queue. */
static void note_error(struct cb_can *can, int error, int64_t now_us) {
    if (error == ENETDOWN) {
        can->down_us = now_us;
        can->counters.went_down += can->state != CB_CAN_DOWN;
        __atomic_store_n(&can->downs, can->downs + 1, __ATOMIC_RELEASE);
        can->state = CB_CAN_DOWN;
        return;
    }
    if (error == ENODEV || error == ENXIO)
        can->counters.went_away++;
    else
        can->counters.socket_errors++;
    cb_can_revoke(can); /* the kernel reports this once */
    (void)obey_revocation(can);
}

/* out: false: a frame waited in the queue since before the interface went down, and tells nothing
 * of the bus */
static bool is_news(const struct cb_can *can, int64_t time_us) {
    return can->state != CB_CAN_DOWN || time_us > can->down_us;
}

static void note_error_frame(struct cb_can *can, const struct can_frame *frame, int64_t time_us) {
    struct cb_can_counters *counters = &can->counters;
    const uint8_t controller = frame->can_id & CAN_ERR_CRTL ? frame->data[1] : 0;
    counters->error_frames++;
    counters->warnings += (controller & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0;
    counters->passives += (controller & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0;
    counters->controller_overflows +=
        (controller & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) != 0;
    counters->bus_offs += (frame->can_id & CAN_ERR_BUSOFF) != 0;
    counters->restarts += (frame->can_id & CAN_ERR_RESTARTED) != 0;
    if (!is_news(can, time_us)) return;
    if (frame->can_id & CAN_ERR_BUSOFF) can->state = CB_CAN_BUS_OFF;
    /* a controller that restarts by itself only reports that it is active; it may have left the bus
     * before the socket was there, and lost what was sent */
    if (frame->can_id & CAN_ERR_RESTARTED || controller & CAN_ERR_CRTL_ACTIVE) come_up(can);
}

/* in : stamp_ns of the kernel, wall clock
 * out: the same moment in CLOCK_BOOTTIME. A wall clock that was set in between cannot make a frame
 *      older than the one before it or than an empty queue, nor newer than now. */
static int64_t boottime_of(const struct cb_can *can, int64_t stamp_ns, int64_t now_us) {
    const int64_t time_us = now_us - (cb_unix_us() - stamp_ns / 1000);
    if (time_us < can->not_before_us) return can->not_before_us;
    return time_us > now_us ? now_us : time_us;
}

/* Evaluates the kernel's control data of a frame. out: time of its reception */
static int64_t take_control(struct cb_can *can, struct msghdr *message, int64_t now_us) {
    int64_t time_us = now_us;
    for (struct cmsghdr *c = CMSG_FIRSTHDR(message); c != NULL; c = CMSG_NXTHDR(message, c)) {
        if (c->cmsg_level != SOL_SOCKET) continue;
        if (c->cmsg_type == SCM_TIMESTAMPNS) {
            struct timespec stamp;
            memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
            can->stamp_ns = (int64_t)stamp.tv_sec * 1000000000 + stamp.tv_nsec;
            time_us = boottime_of(can, can->stamp_ns, now_us);
        } else if (c->cmsg_type == SO_RXQ_OVFL) {
            uint32_t lost;
            memcpy(&lost, CMSG_DATA(c), sizeof lost);
            can->counters.queue_overflows += lost - can->lost_in_queue;
            can->lost_in_queue = lost;
        }
    }
    return time_us;
}

/* Receives one frame of any kind. out: false: there is none, or the socket failed */
static bool receive_any(struct cb_can *can, struct can_frame *frame, int64_t *time_us,
                        int64_t now_us) {
    union {
        char bytes[128];
        struct cmsghdr aligned;
    } control;
    struct iovec into = {.iov_base = frame, .iov_len = sizeof *frame};
    struct msghdr message = {.msg_iov = &into,
                             .msg_iovlen = 1,
                             .msg_control = &control,
                             .msg_controllen = sizeof control};
    const ssize_t got = recvmsg(can->fd, &message, MSG_DONTWAIT);
    if (got == (ssize_t)sizeof *frame) {
        *time_us = can->not_before_us = take_control(can, &message, now_us);
        return true;
    }
    if (got < 0 && errno != EAGAIN && errno != EINTR)
        note_error(can, errno, now_us);
    else
        can->not_before_us = now_us;
    can->seen_ns = 0;
    return false;
}

/* out: whether the last socket had this frame too: both have those between offer and change */
static bool was_seen(struct cb_can *can) {
    if (can->stamp_ns > can->seen_ns) can->seen_ns = 0;
    return can->seen_ns != 0;
}

bool cb_can_receive(struct cb_can *can, struct cb_can_frame *frame, int64_t now_us) {
    struct can_frame raw;
    int64_t time_us = now_us;
    if (!obey_revocation(can)) return false;
    take_offer(can, now_us);
    notice_up(can);
    for (int i = 0; i < CB_CAN_FRAMES_PER_CYCLE; i++) {
        if (can->fd < 0 || !receive_any(can, &raw, &time_us, now_us)) return false;
        if (was_seen(can)) continue;
        if (raw.can_id & CAN_ERR_FLAG) {
            note_error_frame(can, &raw, time_us);
            continue;
        }
        can->counters.frames++;
        if (can->state != CB_CAN_UP && is_news(can, time_us)) come_up(can);
        *frame = (struct cb_can_frame){raw.can_id, raw.can_dlc, {0}, time_us};
        memcpy(frame->data, raw.data, sizeof frame->data);
        return true;
    }
    return false;
}

bool cb_can_send(struct cb_can *can, const struct cb_can_frame *frame) {
    struct can_frame raw = {.can_id = frame->id, .can_dlc = frame->length};
    memcpy(raw.data, frame->data, sizeof raw.data);
    if (can->fd >= 0 && send(can->fd, &raw, sizeof raw, MSG_DONTWAIT) == (ssize_t)sizeof raw) {
        can->counters.sent++;
        return true;
    }
    can->counters.not_sent++;
    return false;
}

bool cb_can_came_back(struct cb_can *can) {
    const bool back = can->is_back;
    can->is_back = false;
    return back;
}
