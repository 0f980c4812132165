/* SPDX-License-Identifier: MIT */
#include "hal/linux/tcp.h"

#include <errno.h>
#include <poll.h>
#include <string.h>

#include "hal/linux/clock.h"

enum {
    HEADER_BYTES = 7,         /* transaction, protocol, length, unit */
    LENGTH_OFFSET = 6,        /* the length field counts from here, from the unit on */
    UNIT_OFFSET = 6,          /* in the header */
    MIN_LENGTH = 2,           /* unit and function */
    MAX_LENGTH = 254,         /* unit and the longest function and data */
    MAX_FAILURES_IN_ROW = 3,  /* then a new connection is made */
    REMEMBERED_REQUESTS = 64, /* number of ids whose replies count as late */
    MAX_STRAY_FRAMES = 8,     /* dropped before one request; the rest waits for the next */
    MAX_SILENCE_US = 10000,   /* longest gap within a frame */
};

/* Result of waiting for a frame. */
enum wait {
    WAIT_FRAME,   /* a whole frame */
    WAIT_WRONG,   /* a frame whose id was never sent */
    WAIT_TIMEOUT, /* no whole frame by the deadline */
    WAIT_LOST,    /* the connection is lost */
};

bool cb_tcp_start(struct cb_tcp *tcp, const char *host, uint16_t port, uint8_t unit) {
    *tcp = (struct cb_tcp){.unit = unit};
    if (!cb_link_start(&tcp->link, host, port)) return false;
    cb_link_ready(&tcp->link, cb_boottime_us());
    return true;
}

static uint16_t get_u16(const uint8_t *at) {
    return (uint16_t)(at[0] << 8 | at[1]);
}

/* Forgets the pending request and the received bytes of a closed connection. */
static void forget(struct cb_tcp *tcp) {
    tcp->awaiting = tcp->read_answered = tcp->write_answered = false;
    tcp->failures_in_row = 0;
    tcp->have = 0;
}

/* Drops the connection with its pending request. */
static void drop(struct cb_tcp *tcp, enum cb_link_cause cause, int error_number) {
    forget(tcp);
    cb_link_drop(&tcp->link, cause, error_number, cb_boottime_us());
}

/* Counts an exchange without a valid reply. Several in a row drop the connection. An incomplete
 * reply drops it at once, because its bytes would be taken for the head of the next reply. */
static void failed(struct cb_tcp *tcp) {
    if (tcp->have > 0 && cb_boottime_us() - tcp->received_us >= MAX_SILENCE_US) {
        tcp->counters.incomplete_replies++;
        drop(tcp, CB_LINK_CAUSE_FRAMING, 0);
    } else if (++tcp->failures_in_row >= MAX_FAILURES_IN_ROW) {
        tcp->counters.given_up++;
        drop(tcp, CB_LINK_CAUSE_SILENT, 0);
    }
}

/* out: length of the first received frame; 0 when its header is incomplete, -1 when it is no
 * header */
static int frame_bytes(const struct cb_tcp *tcp) {
    if (tcp->have < LENGTH_OFFSET) return 0;
    uint16_t protocol = get_u16(tcp->received + 2);
    uint16_t length = get_u16(tcp->received + 4);
    if (protocol != 0 || length < MIN_LENGTH || length > MAX_LENGTH) return -1;
    return LENGTH_OFFSET + length;
}

/* Removes the first received frame. */
static void use_up(struct cb_tcp *tcp) {
    size_t frame = (size_t)frame_bytes(tcp);
    tcp->have -= frame;
    memmove(tcp->received, tcp->received + frame, tcp->have);
}

static void lost_by_peer(struct cb_tcp *tcp) {
    tcp->counters.closed_by_peer++;
    drop(tcp, CB_LINK_CAUSE_PEER, 0);
}

static void lost_by_error(struct cb_tcp *tcp, int error_number) {
    tcp->counters.socket_errors++;
    drop(tcp, CB_LINK_CAUSE_ERRNO, error_number);
}

/* Takes the pending bytes of the socket, without waiting. There is always room, because at most a
 * part of one frame is stored. out: false when the connection is lost. */
static bool fill(struct cb_tcp *tcp) {
    ssize_t got = recv(tcp->link.fd, tcp->received + tcp->have, sizeof tcp->received - tcp->have,
                       MSG_DONTWAIT);
    if (got > 0) {
        tcp->have += (size_t)got;
        tcp->received_us = cb_boottime_us();
        return true;
    }
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return true;
    if (got == 0 || errno == ECONNRESET)
        lost_by_peer(tcp);
    else
        lost_by_error(tcp, errno);
    return false;
}

static void sleep_until_readable(int fd, int64_t left_us) {
    struct pollfd wait = {.fd = fd, .events = POLLIN};
    struct timespec left = cb_timespec(left_us * 1000);
    ppoll(&wait, 1, &left, NULL);
}

/* Waits until a whole frame is received. */
static enum wait next_frame(struct cb_tcp *tcp, int64_t deadline_us) {
    for (;;) {
        size_t before = tcp->have;
        int frame = frame_bytes(tcp);
        if (frame < 0) {
            tcp->counters.framing_errors++;
            drop(tcp, CB_LINK_CAUSE_FRAMING, 0);
            return WAIT_LOST;
        }
        if (frame > 0 && tcp->have >= (size_t)frame) return WAIT_FRAME;
        if (!fill(tcp)) return WAIT_LOST;
        int64_t left_us = deadline_us - cb_boottime_us();
        if (tcp->have == before && left_us <= 0) return WAIT_TIMEOUT;
        if (tcp->have == before) sleep_until_readable(tcp->link.fd, left_us);
    }
}

/* Removes a frame that is not the awaited reply. out: true when its id was never sent: it then
 * counts as the only reply of this server to the pending request, although it cannot be used. */
static bool drop_unexpected(struct cb_tcp *tcp) {
    uint16_t requests_ago = (uint16_t)(tcp->transaction - get_u16(tcp->received));
    bool ours = requests_ago <= REMEMBERED_REQUESTS;
    if (ours)
        tcp->counters.stray_replies++;
    else
        tcp->counters.wrong_ids++;
    use_up(tcp);
    return !ours;
}

/* Waits for the reply to the pending request, and drops other frames. */
static enum wait next_reply(struct cb_tcp *tcp, int64_t deadline_us) {
    for (int strays = 0; strays < MAX_STRAY_FRAMES; strays++) {
        enum wait waited = next_frame(tcp, deadline_us);
        if (waited != WAIT_FRAME) return waited;
        if (get_u16(tcp->received) == tcp->transaction && tcp->awaiting) return WAIT_FRAME;
        if (drop_unexpected(tcp) && tcp->awaiting) return WAIT_WRONG;
    }
    return WAIT_TIMEOUT;
}

/* Waits for the reply to an abandoned request that is still pending, and drops it. */
static bool await_late_reply(struct cb_tcp *tcp, int64_t deadline_us) {
    enum wait waited = next_reply(tcp, deadline_us);
    if (waited == WAIT_LOST) return false;
    if (waited == WAIT_TIMEOUT) {
        tcp->counters.blocked++;
        failed(tcp);
        return false;
    }
    if (waited == WAIT_FRAME) {
        tcp->counters.late_replies++;
        cb_peer_note_time(&tcp->peer, cb_boottime_us() - tcp->sent_us);
        tcp->failures_in_row = 0;
        use_up(tcp);
    }
    tcp->awaiting = false;
    return true;
}

static bool has_time(struct cb_tcp *tcp, int64_t deadline_us) {
    if (cb_boottime_us() < deadline_us) return true;
    tcp->counters.out_of_time++;
    return false;
}

/* Ensures that a request may be sent: in time, connected, no pending request, no bytes left over.
 * Behind the wait for a late reply the computer may have been suspended: a write would then have
 * the outputs of long ago. */
static bool ready_to_send(struct cb_tcp *tcp, int64_t deadline_us) {
    if (!has_time(tcp, deadline_us)) return false;
    if (!cb_link_ready(&tcp->link, cb_boottime_us())) {
        tcp->counters.not_connected++;
        return false;
    }
    if (tcp->awaiting && !await_late_reply(tcp, deadline_us)) return false;
    return next_reply(tcp, 0) != WAIT_LOST && has_time(tcp, deadline_us);
}

/* out: false when the request certainly has no effect, because it was not sent completely */
static bool send_request(struct cb_tcp *tcp, const struct cb_modbus_request *request) {
    uint8_t frame[CB_TCP_MAX_FRAME] = {0};
    size_t bytes = HEADER_BYTES + cb_modbus_encode(request, frame + HEADER_BYTES);
    tcp->transaction++;
    frame[0] = (uint8_t)(tcp->transaction >> 8);
    frame[1] = (uint8_t)(tcp->transaction & 0xFF);
    frame[4] = (uint8_t)((bytes - LENGTH_OFFSET) >> 8);
    frame[5] = (uint8_t)((bytes - LENGTH_OFFSET) & 0xFF);
    frame[UNIT_OFFSET] = tcp->unit;
    ssize_t sent = send(tcp->link.fd, frame, bytes, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent != (ssize_t)bytes) {
        lost_by_error(tcp, sent < 0 ? errno : EAGAIN);
        return false;
    }
    tcp->counters.requests++;
    tcp->sent_us = cb_boottime_us();
    tcp->awaiting = true;
    return true;
}

static void count_exception(struct cb_tcp *tcp, uint8_t code) {
    tcp->counters.exceptions++;
    tcp->counters.exceptions_by_code[code < CB_TCP_EXCEPTIONS ? code : 0]++;
}

/* A connection is proven when reads and writes get replies, exceptions included. A PLC that replies
 * to only one of the two would otherwise be reconnected repeatedly without a pause. */
static void note_answered(struct cb_tcp *tcp, uint8_t function) {
    tcp->read_answered |= function != CB_MODBUS_WRITE;
    tcp->write_answered |= function != CB_MODBUS_READ;
    if (tcp->read_answered && tcp->write_answered) cb_link_proven(&tcp->link);
}

/* Decodes the awaited reply. Behind a gateway another unit is another device. */
static enum cb_transfer take_reply(struct cb_tcp *tcp, const struct cb_modbus_request *request,
                                   uint16_t *registers) {
    uint8_t exception = 0;
    size_t bytes = (size_t)frame_bytes(tcp) - HEADER_BYTES;
    enum cb_modbus_answer answer = CB_MODBUS_INVALID;
    if (tcp->received[UNIT_OFFSET] == tcp->unit)
        answer =
            cb_modbus_decode(request, tcp->received + HEADER_BYTES, bytes, registers, &exception);
    if (answer == CB_MODBUS_INVALID)
        cb_peer_note_odd(&tcp->peer, tcp->unit, request, tcp->received + UNIT_OFFSET, 1 + bytes);
    use_up(tcp);
    tcp->awaiting = false;
    if (answer == CB_MODBUS_INVALID) {
        tcp->counters.invalid_replies++;
        failed(tcp);
        return CB_TRANSFER_UNKNOWN;
    }
    tcp->counters.replies++;
    tcp->failures_in_row = 0;
    note_answered(tcp, request->function);
    cb_peer_note_time(&tcp->peer, cb_boottime_us() - tcp->sent_us);
    cb_peer_note_answer(&tcp->peer, request->function, exception);
    if (answer == CB_MODBUS_OK) return CB_TRANSFER_OK;
    count_exception(tcp, exception);
    return CB_TRANSFER_REFUSED;
}

enum cb_transfer cb_tcp_exchange(struct cb_tcp *tcp, const struct cb_modbus_request *request,
                                 uint16_t *registers, int64_t deadline_us) {
    if (!ready_to_send(tcp, deadline_us) || !send_request(tcp, request)) return CB_TRANSFER_FAILED;
    switch (next_reply(tcp, deadline_us)) {
        case WAIT_FRAME:
            return take_reply(tcp, request, registers);
        case WAIT_WRONG:
            tcp->awaiting = false;
            failed(tcp);
            return CB_TRANSFER_UNKNOWN;
        case WAIT_TIMEOUT:
            tcp->counters.timeouts++;
            failed(tcp);
            return CB_TRANSFER_UNKNOWN;
        case WAIT_LOST:
            return CB_TRANSFER_UNKNOWN;
    }
    return CB_TRANSFER_UNKNOWN;
}

void cb_tcp_leave(struct cb_tcp *tcp) {
    if (tcp->link.state != CB_LINK_UP) return;
    forget(tcp);
    cb_link_leave(&tcp->link, cb_boottime_us());
}
