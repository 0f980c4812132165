/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/usart.h"

#include "hal/stm32f405/mcu.h"
#include "hal/stm32f405/time.h"

enum {
    RX_BYTES = 256, /* a whole Modbus frame */
    TX_BYTES = 256,
    CONSOLE_BYTES = 4096, /* a second of output, which never delays the next cycle */
    RX_AT_ONCE = 16,      /* maximum per interrupt; the rest follows in the next */
    NO_PIN = 16,
    USART_1_ENABLE = 1 << 4,
    USART_2_ENABLE = 1 << 17,
    USART_3_ENABLE = 1 << 18,
    GPIO_A_AND_B_ENABLE = 3,
    ALTERNATE_USART = 7,
};

/* Counts only grow; index = count % size, a power of two. Each has one writer and one reader. */
struct port {
    struct cb_usart_registers *registers;
    uint32_t interrupt;
    struct cb_gpio *enable_gpio; /* RS-485 driver enable … */
    uint32_t enable_pin;         /* … NO_PIN: none */
    uint32_t clock_hz;
    struct cb_usart_byte *rx;
    uint8_t *tx;
    uint32_t tx_size;
    cb_cell rx_written, rx_taken, tx_written, tx_taken;
    cb_cell sending; /* 1 from the first byte to the last stop bit, else 0 */
    bool gap;        /* bytes were lost before the next one */
    struct cb_usart_counters counters;
};

static struct cb_usart_byte plc_rx[RX_BYTES], bus_rx[RX_BYTES], console_rx[RX_BYTES / 4];
static uint8_t plc_tx[TX_BYTES], bus_tx[TX_BYTES], console_tx[CONSOLE_BYTES];

static struct port ports[CB_USARTS] = {
    {.registers = CB_USART1,
     .interrupt = CB_IRQ_USART1,
     .enable_gpio = CB_GPIOA,
     .enable_pin = 8,
     .rx = plc_rx,
     .tx = plc_tx,
     .tx_size = TX_BYTES},
    {.registers = CB_USART2,
     .interrupt = CB_IRQ_USART2,
     .enable_gpio = CB_GPIOA,
     .enable_pin = 1,
     .rx = bus_rx,
     .tx = bus_tx,
     .tx_size = TX_BYTES},
    {.registers = CB_USART3,
     .interrupt = CB_IRQ_USART3,
     .enable_pin = NO_PIN,
     .rx = console_rx,
     .tx = console_tx,
     .tx_size = CONSOLE_BYTES},
};

static uint32_t rx_size(const struct port *port) {
    return port->rx == console_rx ? RX_BYTES / 4 : RX_BYTES;
}

/* ---- pins ---- */

enum { MODE_OUTPUT = 1, MODE_ALTERNATE = 2, PULL_UP = 1 };

static void set_mode(struct cb_gpio *gpio, uint32_t pin, uint32_t mode) {
    cb_replace_bits(&gpio->moder, 3u << 2 * pin, mode << 2 * pin);
}

static void make_serial(struct cb_gpio *gpio, uint32_t pin) {
    cb_cell *const function = pin < 8 ? &gpio->afrl : &gpio->afrh;
    const uint32_t at = 4 * (pin % 8);
    cb_replace_bits(function, 15u << at, (uint32_t)ALTERNATE_USART << at);
    cb_replace_bits(&gpio->pupdr, 3u << 2 * pin, (uint32_t)PULL_UP << 2 * pin);
    set_mode(gpio, pin, MODE_ALTERNATE);
}

static void drive_line(const struct port *port, bool on) {
    if (port->enable_pin == NO_PIN) return;
    cb_write(&port->enable_gpio->bsrr, 1u << (port->enable_pin + (on ? 0 : 16)));
}

void cb_usart_prepare(const struct cb_clock *clock) {
    cb_set_bits(&CB_RCC->ahb1enr, GPIO_A_AND_B_ENABLE);
    cb_set_bits(&CB_RCC->apb2enr, USART_1_ENABLE);
    cb_set_bits(&CB_RCC->apb1enr, USART_2_ENABLE | USART_3_ENABLE);
    cb_barrier();
    make_serial(CB_GPIOA, 9); /* USART1: TX, RX */
    make_serial(CB_GPIOA, 10);
    make_serial(CB_GPIOA, 2); /* USART2 */
    make_serial(CB_GPIOA, 3);
    make_serial(CB_GPIOB, 10); /* USART3 */
    make_serial(CB_GPIOB, 11);
    for (unsigned i = 0; i < CB_USARTS; ++i) {
        struct port *port = &ports[i];
        port->clock_hz = port->registers == CB_USART1 ? clock->apb2_hz : clock->apb1_hz;
        drive_line(port, false);
        if (port->enable_pin != NO_PIN) set_mode(port->enable_gpio, port->enable_pin, MODE_OUTPUT);
        cb_write(&CB_NVIC_ISER[port->interrupt / 32], 1u << port->interrupt % 32);
    }
}

/* out: whether bytes are pending for the hardware */
static bool has_bytes(const struct port *port) {
    return cb_read(&port->tx_taken) != cb_read(&port->tx_written);
}

/* ---- the program's side ---- */

static uint32_t frame_bits(enum cb_usart_parity parity) {
    switch (parity) {
        case CB_USART_EVEN:
            return CB_USART_CR1_M | CB_USART_CR1_PCE;
        case CB_USART_ODD:
            return CB_USART_CR1_M | CB_USART_CR1_PCE | CB_USART_CR1_PS_ODD;
        case CB_USART_NONE:
            break;
    }
    return 0;
}

void cb_usart_open(enum cb_usart which, uint32_t baud, enum cb_usart_parity parity,
                   unsigned stop_bits) {
    struct port *port = &ports[which];
    cb_interrupts_off(); /* SysTick may have called this port's interrupt */
    cb_write(&port->registers->cr1, 0);
    cb_write(&port->tx_taken, 0);
    cb_write(&port->tx_written, 0);
    cb_write(&port->rx_taken, 0);
    cb_write(&port->rx_written, 0);
    cb_write(&port->sending, 0);
    port->gap = false;
    drive_line(port, false);
    cb_write(&port->registers->brr, (port->clock_hz + baud / 2) / baud);
    cb_write(&port->registers->cr2, stop_bits == 2 ? CB_USART_CR2_STOP_2 : 0);
    cb_write(&port->registers->cr3, 0);
    cb_write(&port->registers->cr1, frame_bits(parity) | CB_USART_CR1_UE | CB_USART_CR1_TE |
                                        CB_USART_CR1_RE | CB_USART_CR1_RXNEIE);
    cb_interrupts_on();
}

bool cb_usart_take(enum cb_usart which, struct cb_usart_byte *byte) {
    struct port *port = &ports[which];
    const uint32_t taken = cb_read(&port->rx_taken);
    if (taken == cb_read(&port->rx_written)) return false;
    cb_barrier(); /* the byte is read after the count that announces it */
    *byte = port->rx[taken % rx_size(port)];
    cb_barrier();
    cb_write(&port->rx_taken, taken + 1);
    return true;
}

size_t cb_usart_room(enum cb_usart which) {
    const struct port *port = &ports[which];
    return port->tx_size - (cb_read(&port->tx_written) - cb_read(&port->tx_taken));
}

/* The interrupt of this port, called by the program. */
static void call_interrupt(const struct port *port) {
    cb_write(&CB_NVIC_ISPR[port->interrupt / 32], 1u << port->interrupt % 32);
}

bool cb_usart_send(enum cb_usart which, const void *bytes, size_t size) {
    struct port *port = &ports[which];
    const uint8_t *const from = bytes;
    if (size > cb_usart_room(which)) return false;
    const uint32_t written = cb_read(&port->tx_written);
    for (size_t i = 0; i < size; ++i) port->tx[(written + i) % port->tx_size] = from[i];
    cb_barrier();
    cb_write(&port->tx_written, written + (uint32_t)size);
    call_interrupt(port);
    return true;
}

bool cb_usart_busy(enum cb_usart which) {
    const struct port *port = &ports[which];
    /* in this order: the interrupt sets `sending` before it takes the last byte */
    return has_bytes(port) || cb_read(&port->sending) != 0;
}

struct cb_usart_counters cb_usart_counted(enum cb_usart which) {
    return ports[which].counters;
}

void cb_usart_kick(void) {
    for (unsigned i = 0; i < CB_USARTS; ++i)
        if (cb_usart_busy((enum cb_usart)i)) call_interrupt(&ports[i]);
}

/* ---- the interrupt's side ---- */

/* in : the status register, read before the data register, which clears its errors */
static void keep_byte(struct port *port, uint32_t status, uint32_t data) {
    const uint32_t errors = CB_USART_SR_PE | CB_USART_SR_FE | CB_USART_SR_NE | CB_USART_SR_ORE;
    const bool bad = (status & errors) != 0;
    const uint32_t written = cb_read(&port->rx_written);
    port->counters.errors += bad;
    if (written - cb_read(&port->rx_taken) >= rx_size(port)) {
        ++port->counters.lost;
        port->gap = true;
        return;
    }
    port->rx[written % rx_size(port)] = (struct cb_usart_byte){
        .time_us = (uint32_t)cb_time_us(), .byte = (uint8_t)data, .bad = bad || port->gap};
    port->gap = false;
    ++port->counters.received;
    cb_barrier();
    cb_write(&port->rx_written, written + 1);
}

static void receive(struct port *port) {
    for (unsigned i = 0; i < RX_AT_ONCE; ++i) {
        const uint32_t status = cb_read(&port->registers->sr);
        if (!(status & (CB_USART_SR_RXNE | CB_USART_SR_ORE))) return;
        keep_byte(port, status, cb_read(&port->registers->dr));
    }
}

/* Passes bytes to the hardware while it accepts them: on silicon two, in the emulator all. Nothing
 * adds bytes meanwhile. */
static void transmit(struct port *port) {
    while (has_bytes(port)) {
        if (!(cb_read(&port->registers->sr) & CB_USART_SR_TXE)) return;
        if (!cb_read(&port->sending)) drive_line(port, true);
        cb_write(&port->sending, 1);
        const uint32_t taken = cb_read(&port->tx_taken);
        cb_write(&port->registers->dr, port->tx[taken % port->tx_size]);
        cb_write(&port->tx_taken, taken + 1);
        ++port->counters.sent;
    }
}

/* Releases the line after the last stop bit; enables the interrupts that are still needed. */
static void finish(struct port *port) {
    const bool waiting = has_bytes(port);
    if (cb_read(&port->sending) && !waiting && (cb_read(&port->registers->sr) & CB_USART_SR_TC)) {
        drive_line(port, false);
        cb_write(&port->sending, 0);
    }
    cb_replace_bits(&port->registers->cr1, CB_USART_CR1_TXEIE | CB_USART_CR1_TCIE,
                    waiting                   ? (uint32_t)CB_USART_CR1_TXEIE
                    : cb_read(&port->sending) ? (uint32_t)CB_USART_CR1_TCIE
                                              : 0);
}

static void serve(struct port *port) {
    cb_time_note_interrupt();
    receive(port);
    transmit(port);
    finish(port);
}

void cb_usart1_handler(void) {
    serve(&ports[CB_USART_PLC]);
}

void cb_usart2_handler(void) {
    serve(&ports[CB_USART_BUS]);
}

void cb_usart3_handler(void) {
    serve(&ports[CB_USART_CONSOLE]);
}
