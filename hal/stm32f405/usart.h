/* SPDX-License-Identifier: MIT
 * The three serial ports: rings between the interrupt and the program, in both directions. Nothing
 * here waits.
 *
 * The interrupt sends the bytes. The hardware raises it by "transmit register empty", and
 * cb_usart_send() and SysTick call it too. A port whose transmit interrupt is missing, as in the
 * emulator, therefore still sends. */
#ifndef COMPBOX_HAL_STM32F405_USART_H
#define COMPBOX_HAL_STM32F405_USART_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/stm32f405/clock.h"

enum cb_usart { CB_USART_PLC, CB_USART_BUS, CB_USART_CONSOLE, CB_USARTS };
enum cb_usart_parity { CB_USART_NONE, CB_USART_EVEN, CB_USART_ODD };

struct cb_usart_byte {
    uint32_t time_us; /* time of reception; low part of cb_time_us(): compare it signed */
    uint8_t byte;
    bool bad; /* parity, framing or noise, or bytes before it were lost */
};

struct cb_usart_counters {
    uint32_t received, sent, errors; /* errors: bytes with parity, framing, noise or overrun */
    uint32_t lost;                   /* bytes dropped because the ring was full */
};

/* Sets pins, clocks and interrupts of all three; the ports stay off. */
void cb_usart_prepare(const struct cb_clock *clock);

/* Starts or restarts one port with empty rings. in : stop_bits 1 or 2 */
void cb_usart_open(enum cb_usart port, uint32_t baud, enum cb_usart_parity parity,
                   unsigned stop_bits);

/* out: the oldest received byte; false when there is none */
bool cb_usart_take(enum cb_usart port, struct cb_usart_byte *byte);

/* out: number of bytes that cb_usart_send() accepts now */
size_t cb_usart_room(enum cb_usart port);

/* in : size <= cb_usart_room()
 * out: true: all bytes will be sent, with the driver enabled before and disabled after them; false:
 *      none will */
bool cb_usart_send(enum cb_usart port, const void *bytes, size_t size);

/* out: true until the last stop bit was sent */
bool cb_usart_busy(enum cb_usart port);

struct cb_usart_counters cb_usart_counted(enum cb_usart port);

/* For SysTick: continues pending output. */
void cb_usart_kick(void);

/* The interrupts. */
void cb_usart1_handler(void);
void cb_usart2_handler(void);
void cb_usart3_handler(void);

#endif
