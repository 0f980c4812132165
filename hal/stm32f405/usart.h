/* SPDX-License-Identifier: MIT
 * The three serial ports: rings between the interrupt and the program, in both directions. Nothing
 * here waits.
 *
 * Bytes go out from the interrupt. It comes by the hardware's "transmit register empty", and it is
 * called by cb_usart_send() and by SysTick as well: a port whose transmit interrupt is missing, as
 * in the emulator, sends all the same. */
#ifndef COMPBOX_HAL_STM32F405_USART_H
#define COMPBOX_HAL_STM32F405_USART_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/stm32f405/clock.h"

enum cb_usart { CB_USART_PLC, CB_USART_BUS, CB_USART_CONSOLE, CB_USARTS };
enum cb_usart_parity { CB_USART_NONE, CB_USART_EVEN, CB_USART_ODD };

struct cb_usart_byte {
    uint32_t time_us; /* when it was received; low part of cb_time_us(): compare it signed */
    uint8_t byte;
    bool bad; /* parity, framing or noise, or bytes before it were lost */
};

struct cb_usart_counters {
    uint32_t received, sent, errors; /* errors: bytes with parity, framing, noise or overrun */
    uint32_t lost;                   /* bytes that found the ring full */
};

/* Pins, clocks and interrupts of all three; the ports stay off. */
void cb_usart_prepare(const struct cb_clock *clock);

/* Starts or restarts one port with empty rings. in : stop_bits 1 or 2 */
void cb_usart_open(enum cb_usart port, uint32_t baud, enum cb_usart_parity parity,
                   unsigned stop_bits);

/* out: the oldest byte received; false when there is none */
bool cb_usart_take(enum cb_usart port, struct cb_usart_byte *byte);

/* out: how many bytes can be handed to cb_usart_send() now */
size_t cb_usart_room(enum cb_usart port);

/* in : size <= cb_usart_room()
 * out: all of it will be sent, driver enabled before and disabled behind it; false: nothing will */
bool cb_usart_send(enum cb_usart port, const void *bytes, size_t size);

/* True until the last stop bit has left. */
bool cb_usart_busy(enum cb_usart port);

struct cb_usart_counters cb_usart_counted(enum cb_usart port);

/* From SysTick: goes on with what waits to be sent. */
void cb_usart_kick(void);

/* The interrupts. */
void cb_usart1_handler(void);
void cb_usart2_handler(void);
void cb_usart3_handler(void);

#endif
