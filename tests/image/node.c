/* SPDX-License-Identifier: MIT
 * A sensor node for the emulated CAN bus, written from CiA 301 and without anything of the box:
 * boots, beats, and once it was told to start sends two temperatures every 100 ms, one in a TPDO
 * and one in a 29-bit frame of the style of J1939. The temperatures come from a file: two whole
 * numbers, in tenths of a degree. */
#define _GNU_SOURCE
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

static const char usage[] =
    "node run INTERFACE NODE FILE   until killed; SIGHUP: it boots anew\n"
    "node flood INTERFACE COUNT     as many frames, one a millisecond, a quarter of them foreign\n"
    "node bus-off INTERFACE         what a driver tells when the controller left the bus …\n"
    "node restarted INTERFACE       … and came back; the emulated controller never does either\n";

enum { BEAT_MS = 500, SEND_MS = 100 };

static volatile sig_atomic_t reboot_asked;

static void ask_reboot(int number) {
    (void)number;
    reboot_asked = 1;
}

static int open_bus(const char *interface) {
    struct sockaddr_can address = {.can_family = AF_CAN,
                                   .can_ifindex = (int)if_nametoindex(interface)};
    int bus = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    if (bus < 0 || address.can_ifindex == 0 ||
        bind(bus, (struct sockaddr *)&address, sizeof address) != 0) {
        perror(interface);
        exit(1);
    }
    return bus;
}

static int send_frame(int bus, uint32_t id, int length, const uint8_t *data) {
    struct can_frame frame = {.can_id = id, .can_dlc = (uint8_t)length};
    memcpy(frame.data, data, (size_t)length);
    return write(bus, &frame, sizeof frame) == (ssize_t)sizeof frame;
}

static int64_t now_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* true: the frame tells this node, or all, to become operational. */
static int is_start(const struct can_frame *frame, int node) {
    return frame->can_id == 0 && frame->can_dlc == 2 && frame->data[0] == 1 &&
           (frame->data[1] == node || frame->data[1] == 0);
}

static void send_temperatures(int bus, int node, const char *file) {
    int first = 0, second = 0;
    FILE *from = fopen(file, "r");
    if (from == NULL) return;
    const int got = fscanf(from, "%d %d", &first, &second);
    fclose(from);
    if (got != 2) return;
    const uint8_t tpdo[8] = {(uint8_t)first, (uint8_t)((unsigned)first >> 8)};
    const uint8_t message[8] = {0xFF, 0xFF, (uint8_t)second, (uint8_t)((unsigned)second >> 8)};
    send_frame(bus, 0x180u + (unsigned)node, 8, tpdo);
    send_frame(bus, 0x18FEEE00u | CAN_EFF_FLAG | (unsigned)node, 8, message);
}

static void run(int bus, int node, const char *file) {
    uint8_t state = 0; /* booted */
    int64_t beat_ms = 0, sent_ms = 0;
    for (;;) {
        if (reboot_asked) state = 0;
        reboot_asked = 0;
        if (state == 0) {
            send_frame(bus, 0x700u + (unsigned)node, 1, &state);
            state = 127;
            beat_ms = now_ms();
        }
        struct pollfd wait = {.fd = bus, .events = POLLIN};
        struct can_frame frame;
        if (poll(&wait, 1, 20) > 0 && read(bus, &frame, sizeof frame) == (ssize_t)sizeof frame &&
            is_start(&frame, node))
            state = 5;
        if (now_ms() - beat_ms >= BEAT_MS) {
            send_frame(bus, 0x700u + (unsigned)node, 1, &state);
            beat_ms = now_ms();
        }
        if (state == 5 && now_ms() - sent_ms >= SEND_MS) {
            send_temperatures(bus, node, file);
            sent_ms = now_ms();
        }
    }
}

/* A value that is not plausible (it is refused and counted) and an identifier that nobody wants. */
static void flood(int bus, int count) {
    static const uint8_t far_off[8] = {0xFF, 0x7F};
    for (int i = 0; i < count; usleep(1000))
        i += send_frame(bus, i % 4 ? 0x185u : 0x2AAu, 8, far_off);
}

int main(int argc, char **argv) {
    static const uint8_t nothing[8];
    if (argc < 3) {
        fputs(usage, stderr);
        return 2;
    }
    int bus = open_bus(argv[2]);
    signal(SIGHUP, ask_reboot);
    if (strcmp(argv[1], "bus-off") == 0)
        return !send_frame(bus, CAN_ERR_FLAG | CAN_ERR_BUSOFF, 8, nothing);
    if (strcmp(argv[1], "restarted") == 0)
        return !send_frame(bus, CAN_ERR_FLAG | CAN_ERR_RESTARTED, 8, nothing);
    if (strcmp(argv[1], "flood") == 0 && argc == 4) flood(bus, atoi(argv[3]));
    if (strcmp(argv[1], "flood") == 0) return 0;
    if (argc == 5) run(bus, atoi(argv[3]), argv[4]);
    return 2;
}
