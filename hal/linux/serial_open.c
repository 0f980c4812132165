/* SPDX-License-Identifier: MIT
 * The calls that open and close a serial device, the only ones that may take long. */
#include <errno.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "firmware/wire/rtu_line.h"
#include "hal/linux/clock.h"
#include "hal/linux/serial_opener.h"

static const struct {
    uint32_t baud;
    speed_t speed;
} SPEEDS[] = {
    {1200, B1200},     {2400, B2400},     {4800, B4800},     {9600, B9600},
    {19200, B19200},   {38400, B38400},   {57600, B57600},   {115200, B115200},
    {230400, B230400}, {460800, B460800}, {921600, B921600},
};

/* The loader permits no other rates. */
static speed_t speed_of(uint32_t baud) {
    for (size_t i = 0; i < sizeof SPEEDS / sizeof SPEEDS[0]; ++i)
        if (SPEEDS[i].baud == baud) return SPEEDS[i].speed;
    return B19200;
}

/* A pseudo-terminal has no parity, and its driver reports an error. */
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
    raw.c_cc[VMIN] = 1; /* makes "no bytes yet" EAGAIN, and 0 bytes a lost device */
    raw.c_cc[VTIME] = 0;
    const speed_t speed = speed_of(line->baud); /* termios knows all of these */
    cfsetispeed(&raw, speed);
    cfsetospeed(&raw, speed);
    return tcsetattr(fd, TCSANOW, &raw) == 0 ? 0 : errno;
}

/* USB adapters hold bytes back for up to 16 ms by default. Not every driver supports this
 * request. */
static void request_low_latency(int fd) {
    struct serial_struct settings;
    if (ioctl(fd, TIOCGSERIAL, &settings) != 0) return;
    settings.flags |= (int)ASYNC_LOW_LATENCY;
    ioctl(fd, TIOCSSERIAL, &settings);
}

/* The driver switches the RS-485 transmitter by RTS while it sends.
 * out: 0 or errno, ENOSYS if it cannot */
static int switch_driver_by_rts(int fd) {
    struct serial_rs485 rs485 = {.flags = SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND};
    if (ioctl(fd, TIOCSRS485, &rs485) == 0) return 0;
    return errno == ENOTTY ? ENOSYS : errno;
}

/* Reserves the line, because two masters would accept each other's replies. The lock excludes
 * programs that request it, such as another compboxd. TIOCEXCL makes every later open() fail,
 * except root's, until the last close; on a pseudo-terminal it would outlive the close while the
 * other end is open.
 * out: 0 or errno, EBUSY if another program has the line */
static int take_line(int fd) {
    if (flock(fd, LOCK_EX | LOCK_NB) != 0) return errno == EWOULDBLOCK ? EBUSY : errno;
    if (is_pseudo_terminal(fd)) return 0;
    return ioctl(fd, TIOCEXCL) == 0 ? 0 : errno;
}

static struct cb_serial_opened failed(int fd, int error) {
    if (fd >= 0) cb_serial_shut(fd);
    return (struct cb_serial_opened){.fd = -1, .error = error};
}

/* The pending bytes belong to the program that has the line, so they are not flushed. */
static struct cb_serial_opened not_taken(int fd, int error) {
    close(fd);
    return (struct cb_serial_opened){.fd = -1, .error = error};
}

/* A frame may be on its way, and none begins within 3.5 characters behind it (Modbus over serial
 * line, 2.5.1). Bytes that come meanwhile are kept: they show the reader that one was. */
static void await_silence(const struct cb_rtu_line *line) {
    const struct timespec silence = cb_timespec(cb_rtu_silences(line).between_us * 1000LL);
    nanosleep(&silence, NULL);
}

struct cb_serial_opened cb_serial_open(const struct cb_serial_config *config) {
    const int fd = open(config->device, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) return failed(fd, errno);
    const int taken = take_line(fd);
    if (taken != 0) return not_taken(fd, taken);
    int error = set_line(fd, &config->line);
    if (error == 0 && config->rs485) error = switch_driver_by_rts(fd);
    if (error != 0) return failed(fd, error);
    request_low_latency(fd);
    tcflush(fd, TCIOFLUSH);
    await_silence(&config->line);
    return (struct cb_serial_opened){.fd = fd};
}

const char *cb_serial_error(int error_number) {
    if (error_number == EBUSY) return "another program has it open";
    if (error_number == ENOSYS)
        return "its driver has no RS-485 mode: leave rs485 out, or use an adapter that switches by "
               "itself";
    return strerror(error_number);
}

void cb_serial_shut(int fd) {
    tcflush(fd, TCIOFLUSH);
    close(fd);
}
