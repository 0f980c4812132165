/* SPDX-License-Identifier: MIT
 * libmodbus as the client of a TCP PLC, for sites that demand a known stack. Its calls block, so a
 * thread of its own makes them, and the loop never waits for it
 * (docs/decisions/0006-own-modbus-client.md).
 *
 * In each cycle the loop hands over one job: the write block, then the readings. At the next tick
 * it takes the results, each with the time of its request. Requests follow each other on the wire
 * as with the box's own client; a reading is made so that it is done just before that tick.
 *
 *   IDLE ──loop: post──► POSTED ──thread: take──► RUNNING ──thread──► DONE ──loop: collect──► IDLE
 *                          └──loop: withdraw──► IDLE
 *
 * The state determines the owner of the job, so there is no lock. While it is RUNNING the loop has
 * no reading and sends nothing. */
#ifndef COMPBOX_HAL_LINUX_LIBMODBUS_H
#define COMPBOX_HAL_LINUX_LIBMODBUS_H

#include <pthread.h>
#include <semaphore.h>
#include <stdbool.h>
#include <stdint.h>

#include "firmware/config/config.h"
#include "hal/linux/realtime.h"
#include "hal/linux/tcp.h"

enum cb_job_state { CB_JOB_IDLE, CB_JOB_POSTED, CB_JOB_RUNNING, CB_JOB_DONE };
enum { CB_JOB_READS = 2 }; /* the read block and the read-back of the write block */

/* in: start, count, count 0: none. out: the rest, with the result. */
struct cb_job_read {
    uint16_t start, count;
    uint8_t result;     /* enum cb_transfer */
    int64_t request_us; /* time of the request */
    uint16_t registers[CB_MAX_READ_REGISTERS];
};

struct cb_job_write {
    uint16_t start, count;
    uint8_t result;
    int64_t done_us; /* time of the reply */
    uint16_t registers[CB_MAX_WRITE_REGISTERS];
};

/* The requests of a cycle, in the order on the wire. */
struct cb_job {
    struct cb_job_write write;
    struct cb_job_read reads[CB_JOB_READS];
    int64_t due_us; /* the next tick, before which the readings end */
};

/* Whether the previous cycle's write was handed over. */
enum cb_handing { CB_HANDED_NOTHING, CB_HANDED_OVER, CB_HANDED_BLOCKED };

struct cb_libmodbus {
    uint32_t state; /* enum cb_job_state, atomic: sets the owner of the next four */
    struct cb_job job;
    struct cb_tcp_counters counters; /* of the wire, as the box's own client has them */
    struct cb_peer peer;
    struct cb_link link; /* without its descriptor and times */
    uint32_t ended; /* enum cb_transfer, atomic: result of the job's write while RUNNING, with its
                       time; NONE: it has not ended */

    /* the loop's */
    struct cb_tcp *shown;  /* gets counters, peer and link with each result */
    bool combined;         /* FC23 for a write and a reading */
    struct cb_job next;    /* requests of this cycle so far */
    struct cb_job results; /* of the job collected last */
    bool taken, fresh;     /* this cycle has looked for results; and they are new */
    uint8_t handing;       /* enum cb_handing */
    uint8_t fate;          /* enum cb_transfer */
    int64_t read_us;       /* request time of the reading returned last */
    int64_t written_us;    /* time of the reply to the write with this fate */
    uint32_t blocked;      /* cycles in which the thread was busy */

    /* the thread's */
    void *context;    /* modbus_t */
    int64_t retry_us; /* earliest next attempt to connect */
    uint32_t period_us;
    uint32_t reading_us; /* time of a job's readings, the longest of late */

    bool leave; /* from the loop: close in order behind the present request; atomic */
    bool quit;  /* a cb_flag */
    sem_t wake;
    pthread_t thread;
};

/* in : shown, which gets what the log and the statistics need
 * out: 0 or errno. The caller keeps *client and *shown until cb_libmodbus_stop. */
int cb_libmodbus_start(struct cb_libmodbus *client, const struct cb_plc_config *plc,
                       uint32_t period_us, const struct cb_schedule *schedule,
                       struct cb_tcp *shown);

/* Ends the thread after its present call and closes the connection in order.
 * out: false: the call has blocked for a second; *client must stay valid */
bool cb_libmodbus_stop(struct cb_libmodbus *client);

/* ---- the loop: none of these waits ---- */

/* As the operations of hal.h, one cycle late.
 * cb_libmodbus_read: out: the reading of this block that was requested in an earlier cycle and has
 *      ended since the last cycle; FAILED: none has; NONE: none was requested
 * cb_libmodbus_write: out: NONE; cb_libmodbus_handed has the result in the next cycle */
enum cb_transfer cb_libmodbus_read(struct cb_libmodbus *client, uint16_t start, uint16_t count,
                                   uint16_t *registers);
enum cb_transfer cb_libmodbus_write(struct cb_libmodbus *client, uint16_t start, uint16_t count,
                                    const uint16_t *registers);

struct cb_handed cb_libmodbus_handed(struct cb_libmodbus *client);

/* At the end of a cycle: posts its requests. in: next_tick_us, of the loop, by CLOCK_BOOTTIME */
void cb_libmodbus_post(struct cb_libmodbus *client, int64_t next_tick_us);

/* As cb_tcp_leave. */
void cb_libmodbus_leave(struct cb_libmodbus *client);

#endif
