/* SPDX-License-Identifier: MIT */
#include "hal/linux/libmodbus.h"

#include <errno.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>

#include "hal/linux/clock.h"
#include "hal/linux/mailbox.h"

enum {
    FIRST_BACKOFF_US = 50000,
    MAX_BACKOFF_US = 1000000,
    CONNECT_TIMEOUT_US = 1000000,
    REPLY_PERIODS = 3,  /* time for the first byte of a reply */
    SILENCE_US = 10000, /* longest gap within a reply */
    MARGIN_PART = 5,    /* of the period, before the tick: time for a reading that takes longer */
    LEAVE_TIMEOUT_MS = 1000,
    PATIENCE_S = 1, /* with a call that blocks the thread at the end */
};

static uint32_t state_of(const struct cb_libmodbus *client) {
    return __atomic_load_n(&client->state, __ATOMIC_ACQUIRE);
}

static void hand_over(struct cb_libmodbus *client, enum cb_job_state state) {
    __atomic_store_n(&client->state, (uint32_t)state, __ATOMIC_RELEASE);
}

/* Loop and thread: takes a job that is POSTED. out: false: the other one was first */
static bool grab_posted(struct cb_libmodbus *client, uint32_t to) {
    uint32_t posted = CB_JOB_POSTED;
    return __atomic_compare_exchange_n(&client->state, &posted, to, false, __ATOMIC_ACQ_REL,
                                       __ATOMIC_ACQUIRE);
}

/* ---- the thread: the connection ---- */

static void set_reply_timeout(struct cb_libmodbus *client, uint32_t us) {
    modbus_set_response_timeout(client->context, us / 1000000, us % 1000000);
}

static void back_off(struct cb_libmodbus *client) {
    struct cb_link *link = &client->link;
    const uint32_t doubled = link->backoff_us == 0 ? FIRST_BACKOFF_US : 2 * link->backoff_us;
    link->backoff_us = doubled > MAX_BACKOFF_US ? MAX_BACKOFF_US : doubled;
    client->retry_us = cb_boottime_us() + link->backoff_us;
}

/* Connects when the pause is over, which may block for CONNECT_TIMEOUT_US. out: whether it is up */
static bool is_connected(struct cb_libmodbus *client) {
    struct cb_link *link = &client->link;
    if (link->state == CB_LINK_UP) return true;
    if (cb_boottime_us() < client->retry_us) return false;
    set_reply_timeout(client, CONNECT_TIMEOUT_US);
    if (modbus_connect(client->context) != 0) {
        link->error_number = errno == EINPROGRESS ? ETIMEDOUT : errno;
        link->cause = CB_LINK_CAUSE_ERRNO;
        link->failures++;
        back_off(client);
        return false;
    }
    set_reply_timeout(client, REPLY_PERIODS * client->period_us);
    link->connects++;
    link->state = CB_LINK_UP;
    __atomic_store_n(&client->leave, false, __ATOMIC_RELEASE); /* it was meant for the last one */
    return true;
}

/* Ends the stream behind the last request, then drops what still comes until the PLC closes too:
 * unread bytes would turn the close into a reset. */
static void close_in_order(struct cb_libmodbus *client) {
    char left_over[512];
    const int fd = modbus_get_socket(client->context);
    struct pollfd wait = {.fd = fd, .events = POLLIN};
    const int64_t until_us = cb_boottime_us() + LEAVE_TIMEOUT_MS * 1000;
    shutdown(fd, SHUT_WR);
    while (cb_boottime_us() < until_us)
        if (poll(&wait, 1, LEAVE_TIMEOUT_MS / 10) > 0 &&
            recv(fd, left_over, sizeof left_over, MSG_DONTWAIT) <= 0)
            break;
    modbus_close(client->context);
}

/* Closes without the bytes in the queue, because no request may arrive long after its time. */
static void reset(struct cb_libmodbus *client) {
    const struct linger discard = {.l_onoff = 1, .l_linger = 0};
    setsockopt(modbus_get_socket(client->context), SOL_SOCKET, SO_LINGER, &discard, sizeof discard);
    modbus_close(client->context);
}

/* Closes the connection; the next attempt follows at once if the last one was proven. */
static void drop(struct cb_libmodbus *client, enum cb_link_cause cause, int error_number) {
    struct cb_link *link = &client->link;
    const bool leaves = __atomic_exchange_n(&client->leave, false, __ATOMIC_ACQUIRE);
    const bool proven = link->backoff_us == 0;
    if (leaves)
        close_in_order(client);
    else
        reset(client);
    link->state = CB_LINK_DOWN;
    link->cause = (uint8_t)(leaves ? CB_LINK_CAUSE_LEFT : cause);
    link->error_number = error_number;
    link->disconnects++;
    back_off(client);
    if (proven) client->retry_us = 0;
}

/* ---- the thread: requests ---- */

/* Counts an error of libmodbus other than an exception, after which its stream cannot be trusted:
 * it keeps no part of a reply, and takes a late one for the next. */
static void lose(struct cb_libmodbus *client, int error) {
    struct cb_tcp_counters *counters = &client->counters;
    if (error == ETIMEDOUT) {
        counters->timeouts++;
        drop(client, CB_LINK_CAUSE_SILENT, 0);
    } else if (error == ECONNRESET || error == EPIPE) {
        counters->closed_by_peer++;
        drop(client, CB_LINK_CAUSE_PEER, 0);
    } else if (error > MODBUS_ENOBASE) {
        counters->invalid_replies++;
        drop(client, CB_LINK_CAUSE_FRAMING, 0);
    } else {
        counters->socket_errors++;
        drop(client, CB_LINK_CAUSE_ERRNO, error);
    }
}

/* in : result of a call of libmodbus, function: of CB_MODBUS_…, request_us: its begin
 * out: what it means for the box; without a valid reply the connection is dropped */
static enum cb_transfer conclude(struct cb_libmodbus *client, int result, uint8_t function,
                                 int64_t request_us) {
    const int error = errno;
    const bool exception = result < 0 && error > MODBUS_ENOBASE && error <= EMBXGTAR;
    const unsigned code = exception ? (unsigned)(error - MODBUS_ENOBASE) : 0;
    client->counters.requests++;
    if (result < 0 && !exception) {
        lose(client, error);
        return CB_TRANSFER_UNKNOWN;
    }
    client->counters.replies++;
    client->link.backoff_us = 0;
    cb_peer_note_time(&client->peer, cb_boottime_us() - request_us);
    cb_peer_note_answer(&client->peer, function, (uint8_t)code);
    if (!exception) return CB_TRANSFER_OK;
    client->counters.exceptions++;
    client->counters.exceptions_by_code[code < CB_TCP_EXCEPTIONS ? code : 0]++;
    return CB_TRANSFER_REFUSED;
}

static void end_write(struct cb_libmodbus *client, struct cb_job_write *write,
                      enum cb_transfer end) {
    write->result = (uint8_t)end;
    write->done_us = cb_boottime_us();
    __atomic_store_n(&client->ended, write->result, __ATOMIC_RELEASE);
}

static void do_write(struct cb_libmodbus *client, struct cb_job_write *write) {
    const int64_t request_us = cb_boottime_us();
    errno = 0;
    const int result =
        modbus_write_registers(client->context, write->start, write->count, write->registers);
    end_write(client, write, conclude(client, result, CB_MODBUS_WRITE, request_us));
}

static void do_read(struct cb_libmodbus *client, struct cb_job_read *read) {
    read->request_us = cb_boottime_us();
    errno = 0;
    const int result =
        modbus_read_registers(client->context, read->start, read->count, read->registers);
    read->result = (uint8_t)conclude(client, result, CB_MODBUS_READ, read->request_us);
}

static void do_both(struct cb_libmodbus *client, struct cb_job_write *write,
                    struct cb_job_read *read) {
    read->request_us = cb_boottime_us();
    errno = 0;
    const int result = modbus_write_and_read_registers(client->context, write->start, write->count,
                                                       write->registers, read->start, read->count,
                                                       read->registers);
    const enum cb_transfer end = conclude(client, result, CB_MODBUS_WRITE_READ, read->request_us);
    read->result = (uint8_t)end;
    end_write(client, write, end);
}

/* Waits until the readings are just done by the next tick. */
static void wait_for_readings(const struct cb_libmodbus *client) {
    const int64_t margin_us = client->period_us / MARGIN_PART;
    const int64_t begin_us = client->job.due_us - 2 * (int64_t)client->reading_us - margin_us;
    const struct timespec until = cb_timespec(begin_us * 1000);
    if (begin_us <= cb_boottime_us()) return;
    while (clock_nanosleep(CLOCK_BOOTTIME, TIMER_ABSTIME, &until, NULL) == EINTR) continue;
}

/* in : first: index of the first reading that is still to do */
static void do_reads(struct cb_libmodbus *client, unsigned first) {
    struct cb_job_read *reads = client->job.reads;
    const int64_t from_us = cb_boottime_us();
    for (unsigned i = first; i < CB_JOB_READS && client->link.state == CB_LINK_UP; ++i)
        if (reads[i].count > 0) do_read(client, &reads[i]);
    const uint32_t took_us = (uint32_t)(cb_boottime_us() - from_us);
    const uint32_t faded_us = client->reading_us - client->reading_us / 8;
    client->reading_us = took_us > faded_us ? took_us : faded_us;
}

/* Does the job's requests in their order; after an error those that follow are not sent. Nor is the
 * write sent after the next tick, which a slow connect may reach: its outputs are too old then.
 * in : RUNNING, results FAILED */
static void work(struct cb_libmodbus *client) {
    struct cb_job *job = &client->job;
    if (!is_connected(client)) {
        client->counters.not_connected++;
        return;
    }
    const bool writes = job->write.count > 0 && cb_boottime_us() < job->due_us;
    const bool combined = client->combined && writes && job->reads[0].count > 0;
    if (combined)
        do_both(client, &job->write, &job->reads[0]);
    else if (writes)
        do_write(client, &job->write);
    if (client->link.state != CB_LINK_UP) return;
    if (__atomic_load_n(&client->leave, __ATOMIC_ACQUIRE)) {
        drop(client, CB_LINK_CAUSE_LEFT, 0);
        return;
    }
    if (!combined) wait_for_readings(client);
    do_reads(client, combined ? 1 : 0);
}

static void *run(void *argument) {
    struct cb_libmodbus *client = argument;
    cb_settle_thread("compboxd-modbus");
    for (;;) {
        while (sem_wait(&client->wake) != 0) continue; /* EINTR */
        if (grab_posted(client, CB_JOB_RUNNING)) {
            work(client);
            hand_over(client, CB_JOB_DONE);
        }
        if (cb_flag_is_raised(&client->quit)) break;
    }
    if (modbus_get_socket(client->context) >= 0) close_in_order(client);
    return NULL;
}

/* ---- start and end ---- */

int cb_libmodbus_start(struct cb_libmodbus *client, const struct cb_plc_config *plc,
                       uint32_t period_us, const struct cb_schedule *schedule,
                       struct cb_tcp *shown) {
    char port[8];
    *client = (struct cb_libmodbus){.shown = shown,
                                    .combined = plc->exchange == CB_EXCHANGE_FC23,
                                    .period_us = period_us,
                                    .link.fd = -1};
    *shown = (struct cb_tcp){.link.fd = -1};
    snprintf(port, sizeof port, "%u", (unsigned)plc->port);
    client->context = modbus_new_tcp_pi(plc->host, port);
    if (client->context == NULL) return errno;
    modbus_set_slave(client->context, plc->unit);
    modbus_set_byte_timeout(client->context, 0, SILENCE_US);
    if (sem_init(&client->wake, 0, 0) != 0) return errno;
    return cb_start_thread(&client->thread, schedule, run, client);
}

bool cb_libmodbus_stop(struct cb_libmodbus *client) {
    struct timespec until = cb_timespec(cb_clock_ns(CLOCK_REALTIME));
    until.tv_sec += PATIENCE_S;
    cb_flag_raise(&client->quit);
    sem_post(&client->wake);
    if (pthread_timedjoin_np(client->thread, NULL, &until) != 0) {
        pthread_detach(client->thread);
        return false;
    }
    modbus_free(client->context);
    sem_destroy(&client->wake);
    return true;
}

/* ---- the loop ---- */

/* in : results of the job of the previous cycle, or of an earlier one, whose write was reported
 * UNKNOWN then */
static void take_results(struct cb_libmodbus *client) {
    client->results = client->job;
    client->shown->counters = client->counters;
    client->shown->counters.blocked = client->blocked;
    client->shown->peer = client->peer;
    client->shown->link = client->link;
    hand_over(client, CB_JOB_IDLE);
}

/* in : the write was handed over in the previous cycle
 * out: its result, also while the readings behind it are not done; UNKNOWN: it is pending */
static uint8_t fate_of_write(struct cb_libmodbus *client) {
    if (client->fresh) {
        client->written_us = client->results.write.done_us;
        return client->results.write.result;
    }
    const uint32_t ended = __atomic_load_n(&client->ended, __ATOMIC_ACQUIRE);
    if (ended == CB_TRANSFER_NONE) return CB_TRANSFER_UNKNOWN;
    client->written_us = client->job.write.done_us;
    return (uint8_t)ended;
}

/* Once in a cycle: takes finished results and decides about the write of the previous cycle. */
static void collect(struct cb_libmodbus *client) {
    static const uint8_t fates[] = {[CB_HANDED_NOTHING] = CB_TRANSFER_NONE,
                                    [CB_HANDED_OVER] = CB_TRANSFER_UNKNOWN,
                                    [CB_HANDED_BLOCKED] = CB_TRANSFER_FAILED};
    if (client->taken) return;
    client->taken = true;
    client->fate = fates[client->handing];
    if (grab_posted(client, CB_JOB_IDLE)) { /* the thread has not begun, and will not */
        if (client->handing == CB_HANDED_OVER) client->fate = CB_TRANSFER_FAILED;
        return;
    }
    client->fresh = state_of(client) == CB_JOB_DONE;
    if (client->fresh) take_results(client);
    if (client->handing == CB_HANDED_OVER) client->fate = fate_of_write(client);
}

/* Adds a reading to this cycle's job. out: its index; CB_JOB_READS: there is no room */
static unsigned request(struct cb_libmodbus *client, uint16_t start, uint16_t count) {
    unsigned i = 0;
    while (i < CB_JOB_READS && client->next.reads[i].count > 0) ++i;
    if (i == CB_JOB_READS) return i;
    client->next.reads[i] =
        (struct cb_job_read){.start = start, .count = count, .result = CB_TRANSFER_FAILED};
    return i;
}

enum cb_transfer cb_libmodbus_read(struct cb_libmodbus *client, uint16_t start, uint16_t count,
                                   uint16_t *registers) {
    collect(client);
    const unsigned index = request(client, start, count);
    for (unsigned i = 0; i < CB_JOB_READS && client->fresh; ++i) {
        const struct cb_job_read *read = &client->results.reads[i];
        if (read->start != start || read->count != count) continue;
        if (read->result == CB_TRANSFER_OK) {
            memcpy(registers, read->registers, count * sizeof registers[0]);
            client->read_us = read->request_us;
        }
        return (enum cb_transfer)read->result;
    }
    return index == 0 ? CB_TRANSFER_FAILED : CB_TRANSFER_NONE;
}

enum cb_transfer cb_libmodbus_write(struct cb_libmodbus *client, uint16_t start, uint16_t count,
                                    const uint16_t *registers) {
    struct cb_job_write *write = &client->next.write;
    write->start = start;
    write->count = count;
    write->result = CB_TRANSFER_FAILED;
    memcpy(write->registers, registers, count * sizeof registers[0]);
    return CB_TRANSFER_NONE;
}

struct cb_handed cb_libmodbus_handed(struct cb_libmodbus *client) {
    collect(client);
    return (struct cb_handed){
        .read_us = client->read_us, .write = client->fate, .written_us = client->written_us};
}

void cb_libmodbus_post(struct cb_libmodbus *client, int64_t next_tick_us) {
    const bool free = state_of(client) == CB_JOB_IDLE;
    const bool writes = client->next.write.count > 0;
    client->handing = !writes ? CB_HANDED_NOTHING : free ? CB_HANDED_OVER : CB_HANDED_BLOCKED;
    client->next.due_us = next_tick_us;
    if (free) {
        client->job = client->next;
        client->ended = CB_TRANSFER_NONE;
        hand_over(client, CB_JOB_POSTED);
        sem_post(&client->wake);
    } else {
        client->blocked++;
    }
    client->next = (struct cb_job){.due_us = 0};
    client->taken = client->fresh = false;
}

void cb_libmodbus_leave(struct cb_libmodbus *client) {
    __atomic_store_n(&client->leave, true, __ATOMIC_RELEASE);
}
