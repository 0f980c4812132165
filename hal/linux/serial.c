/* SPDX-License-Identifier: MIT */
#include "hal/linux/serial.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

enum { FIRST_BACKOFF_US = 50000, MAX_BACKOFF_US = 1000000 };

static const struct {
    uint32_t baud;
    speed_t speed;
} SPEEDS[] = {
    {1200, B1200},     {2400, B2400},     {4800, B4800},     {9600, B9600},
    {19200, B19200},   {38400, B38400},   {57600, B57600},   {115200, B115200},
    {230400, B230400}, {460800, B460800}, {921600, B921600},
};

void cb_serial_start(struct cb_serial *serial, const struct cb_serial_config *config) {
    *serial = (struct cb_serial){.config = *config, .fd = -1};
}

/* The loader lets no other rates through. */
static speed_t speed_of(uint32_t baud) {
    for (size_t i = 0; i < sizeof SPEEDS / sizeof SPEEDS[0]; ++i)
        if (SPEEDS[i].baud == baud) return SPEEDS[i].speed;
    return B19200;
}

/* A pseudo-terminal has no parity, and its driver says so by an error. */
static bool is_pseudo_terminal(int fd) {
    enum { FIRST_PTS_MAJOR = 136, LAST_PTS_MAJOR = 143 };
    struct stat device;
    if (fstat(fd, &device) != 0) return false;
    return major(device.st_rdev) >= FIRST_PTS_MAJOR && major(device.st_rdev) <= LAST_PTS_MAJOR;
}

/* Raw bytes, no flow control, no signals, no waiting. out: 0 or errno */
static int set_line(int fd, const struct cb_rtu_line *line) {
    struct termios raw;
    if (tcgetattr(fd, &raw) != 0) return errno;
    cfmakeraw(&raw);
    raw.c_cflag &= ~(tcflag_t)(PARENB | PARODD | CSTOPB | CRTSCTS);
    raw.c_cflag |= CS8 | CLOCAL | CREAD;
    if (line->stop_bits == 2) raw.c_cflag |= CSTOPB;
    if (line->parity != CB_PARITY_NONE && !is_pseudo_terminal(fd))
        raw.c_cflag |= line->parity == CB_PARITY_ODD ? PARENB | PARODD : PARENB;
    raw.c_cc[VMIN] = 1; /* so that nothing yet is EAGAIN, and 0 bytes a device that is gone */
    raw.c_cc[VTIME] = 0;
    const speed_t speed = speed_of(line->baud);
    if (cfsetispeed(&raw, speed) != 0 || cfsetospeed(&raw, speed) != 0) return errno;
    return tcsetattr(fd, TCSANOW, &raw) == 0 ? 0 : errno;
}

/* USB adapters keep bytes back for up to 16 ms unless asked not to. Not every driver knows this. */
static void ask_for_low_latency(int fd) {
    struct serial_struct settings;
    if (ioctl(fd, TIOCGSERIAL, &settings) != 0) return;
    settings.flags |= (int)ASYNC_LOW_LATENCY;
    ioctl(fd, TIOCSSERIAL, &settings);
}

/* The driver switches the RS-485 transmitter on by RTS while it sends. out: 0 or errno */
static int switch_driver_by_rts(int fd) {
    struct serial_rs485 rs485 = {.flags = SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND};
    return ioctl(fd, TIOCSRS485, &rs485) == 0 ? 0 : errno;
}

static void longer_backoff(struct cb_serial *serial) {
    const uint32_t doubled = serial->backoff_us == 0 ? FIRST_BACKOFF_US : 2 * serial->backoff_us;
    serial->backoff_us = doubled > MAX_BACKOFF_US ? MAX_BACKOFF_US : doubled;
}

/* Closing a device must not wait for bytes that nobody will take. */
void cb_serial_close(struct cb_serial *serial) {
    if (serial->fd < 0) return;
    tcflush(serial->fd, TCIOFLUSH);
    close(serial->fd);
    serial->fd = -1;
}

static void attempt_failed(struct cb_serial *serial, int error_number, int64_t now_us) {
    cb_serial_close(serial);
    serial->failures++;
    serial->error_number = error_number;
    serial->since_us = now_us;
    longer_backoff(serial);
}

static void lost(struct cb_serial *serial, int error_number, int64_t now_us) {
    cb_serial_close(serial);
    serial->disconnects++;
    serial->error_number = error_number;
    serial->since_us = now_us;
    if (serial->backoff_us > 0) longer_backoff(serial);
}

static void attempt(struct cb_serial *serial, int64_t now_us) {
    serial->fd = open(serial->config.device, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (serial->fd < 0) {
        attempt_failed(serial, errno, now_us);
        return;
    }
    const int error = set_line(serial->fd, &serial->config.line);
    if (error != 0) {
        attempt_failed(serial, error, now_us);
        return;
    }
    ask_for_low_latency(serial->fd);
    if (serial->config.rs485) serial->rs485_error = switch_driver_by_rts(serial->fd);
    tcflush(serial->fd, TCIOFLUSH);
    serial->connects++;
    longer_backoff(serial); /* until a slave has answered */
}

bool cb_serial_ready(struct cb_serial *serial, int64_t now_us) {
    if (serial->fd < 0 && now_us - serial->since_us >= serial->backoff_us) attempt(serial, now_us);
    return serial->fd >= 0;
}

void cb_serial_proven(struct cb_serial *serial) {
    serial->backoff_us = 0;
}

size_t cb_serial_receive(struct cb_serial *serial, uint8_t *bytes, size_t size, int64_t now_us) {
    if (serial->fd < 0) return 0;
    const ssize_t got = read(serial->fd, bytes, size);
    if (got > 0) return (size_t)got;
    if (got == 0 || (errno != EAGAIN && errno != EINTR))
        lost(serial, got == 0 ? EIO : errno, now_us);
    return 0;
}

bool cb_serial_send(struct cb_serial *serial, const uint8_t *bytes, size_t count, int64_t now_us) {
    if (serial->fd < 0) return false;
    const ssize_t sent = write(serial->fd, bytes, count);
    if (sent == (ssize_t)count) return true;
    lost(serial, sent < 0 ? errno : EAGAIN, now_us);
    return false;
}
