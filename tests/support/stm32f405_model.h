// SPDX-License-Identifier: MIT
// The STM32F405 for its program: every access to a register or to a word shared with an interrupt
// is one call, before which time passes and interrupts come. Included by one file of a test.
//
// Modelled: SysTick, the three serial ports with their interrupts and line times, the pending bits
// of the NVIC, PRIMASK and WFI, the clock tree's ready bits, the independent watchdog, the reset
// flags. All interrupts have one priority, as on the target.
#ifndef COMPBOX_TESTS_SUPPORT_STM32F405_MODEL_H
#define COMPBOX_TESTS_SUPPORT_STM32F405_MODEL_H

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

extern "C" {
#define _Noreturn __attribute__((noreturn))
#include "hal/stm32f405/guard.h"
#define CB_MCU_MODEL 1
#include "hal/stm32f405/mcu.h"
#include "hal/stm32f405/time.h"
#include "hal/stm32f405/usart.h"
#undef _Noreturn

__attribute__((weak)) struct cb_mcu_model cb_mcu_model;
__attribute__((weak)) uint8_t cb_model_slots[2][CB_FLASH_SLOT_BYTES];
}

namespace stm32f405 {

// Thrown by an access that ends the program.
struct ended {
    std::string why;
};

constexpr std::uint64_t cycles_per_us = 168;

struct received_byte {
    std::uint64_t at;  // cycle of its last stop bit
    std::uint8_t byte;
    std::uint32_t errors;  // CB_USART_SR_PE, _FE, _NE
};

struct sent_byte {
    std::uint8_t byte;
    std::uint64_t from, to;  // cycles of its first and last bit
    bool driven;             // whether the driver was enabled all the time
};

struct serial_port {
    cb_usart_registers *registers = nullptr;
    unsigned interrupt = 0;
    unsigned bus_divider = 1;  // of the core's clock
    cb_gpio *driver_gpio = nullptr;
    unsigned driver_pin = 0;
    std::deque<received_byte> line;
    std::uint32_t errors = 0, errors_read = 0;  // bits of SR; those that were read
    bool rxne = false, holding = false, shifting = false, tc = true;
    std::uint8_t received = 0, held = 0;
    std::vector<sent_byte> sent;
    std::function<void()> on_idle = [] {};  // the last stop bit has left

    std::uint64_t bit_cycles() const { return (registers->brr.word & 0xFFFF) * bus_divider; }
    std::uint64_t byte_cycles() const {
        const unsigned data = registers->cr1.word & CB_USART_CR1_M ? 9 : 8;
        const unsigned stop = registers->cr2.word & CB_USART_CR2_STOP_2 ? 2 : 1;
        return (1 + data + stop) * bit_cycles();
    }
    bool on(std::uint32_t bit) const {
        return (registers->cr1.word & CB_USART_CR1_UE) && (registers->cr1.word & bit);
    }
    bool asks() const {
        const bool ore = errors & CB_USART_SR_ORE;
        return (on(CB_USART_CR1_RXNEIE) && (rxne || ore)) || (on(CB_USART_CR1_TXEIE) && !holding) ||
               (on(CB_USART_CR1_TCIE) && tc);
    }
};

struct machine {
    std::uint64_t cycles = 0, accesses = 0;
    std::uint64_t access_cycles = 6;        // including the instructions up to the next one
    std::uint64_t end = ~std::uint64_t{0};  // cycle at which the test ends
    bool masked = false, handling = false;
    bool systick_pending = false;
    std::uint64_t systick_from = 0;            // cycle at which the counter was set
    std::uint64_t systick_wraps = 0;           // that were seen
    unsigned latency = 0;                      // accesses until a written pending bit takes effect
    std::map<unsigned, std::uint64_t> pended;  // interrupt: access from which it takes effect
    std::multimap<std::uint64_t, std::function<void()>> at_access;
    std::map<const cb_gpio *, std::uint32_t> pins;
    serial_port ports[3];
    std::vector<std::pair<const cb_cell *, std::uint32_t>> writes;
    // behaviour of the clock tree's hardware
    bool crystal_works = true, pll_works = true, flash_works = true;
    std::uint64_t ready_after = 0;  // accesses until a ready bit appears
    std::map<std::uint32_t, std::uint64_t> enabled_at;
    // independent watchdog
    bool watchdog_runs = false, watchdog_open = false, watchdog_answers = true;
    std::uint64_t fed_at = 0;

    machine() {
        cb_mcu_model = {};
        cb_mcu_model.rcc.cr.word = CB_RCC_CR_HSION | CB_RCC_CR_HSIRDY;
        cb_mcu_model.flash.optcr.word = 0x0FFFAAED;
        cb_mcu_model.iwdg.rlr.word = 0xFFF;
        ports[0].registers = CB_USART1, ports[0].interrupt = CB_IRQ_USART1;
        ports[0].bus_divider = 4, ports[0].driver_gpio = CB_GPIOA, ports[0].driver_pin = 8;
        ports[1].registers = CB_USART2, ports[1].interrupt = CB_IRQ_USART2;
        ports[1].bus_divider = 4, ports[1].driver_gpio = CB_GPIOA, ports[1].driver_pin = 1;
        ports[2].registers = CB_USART3, ports[2].interrupt = CB_IRQ_USART3;
        ports[2].bus_divider = 4;
    }

    double us() const { return static_cast<double>(cycles) / cycles_per_us; }

    // ---- time ----

    std::uint64_t systick_period() const { return cb_mcu_model.systick.rvr.word + 1; }
    bool systick_runs() const { return cb_mcu_model.systick.csr.word & 1; }
    std::uint32_t systick_value() const {
        if (!systick_runs()) return 0;
        return static_cast<std::uint32_t>(cb_mcu_model.systick.rvr.word -
                                          (cycles - systick_from) % systick_period());
    }
    // The counter interrupts as it reaches 0, one cycle before it restarts.
    std::uint64_t next_wrap() const {
        return systick_from + (systick_wraps + 1) * systick_period() - 1;
    }
    std::uint64_t watchdog_cycles() const {
        return (cb_mcu_model.iwdg.rlr.word + std::uint64_t{1}) * 8000 * cycles_per_us;
    }

    void receive(serial_port &port) {
        const received_byte one = port.line.front();
        port.line.pop_front();
        if (!port.on(CB_USART_CR1_RE)) return;
        if (port.rxne) {
            port.errors |= CB_USART_SR_ORE;
            return;
        }
        port.rxne = true;
        port.received = one.byte;
        port.errors |= one.errors;
    }

    bool driven(const serial_port &port) {
        return !port.driver_gpio || (pins[port.driver_gpio] >> port.driver_pin & 1);
    }

    void shift(serial_port &port, std::uint64_t from) {
        port.shifting = true;
        port.holding = false;
        port.sent.push_back({port.held, from, from + port.byte_cycles(), driven(port)});
    }

    void end_of_byte(serial_port &port) {
        const std::uint64_t at = port.sent.back().to;
        port.shifting = false;
        if (port.holding) return shift(port, at);
        port.tc = true;
        port.on_idle();
    }

    std::uint64_t next_event() const {
        std::uint64_t next = end;
        const auto at_most = [&next](std::uint64_t at) { next = at < next ? at : next; };
        if (systick_runs()) at_most(next_wrap());
        if (watchdog_runs) at_most(fed_at + watchdog_cycles());
        for (const auto &port : ports) {
            if (!port.line.empty()) at_most(port.line.front().at);
            if (port.shifting) at_most(port.sent.back().to);
        }
        return next;
    }

    // Executes the events up to and including this cycle, in order.
    void run_to(std::uint64_t until) {
        for (std::uint64_t at = next_event(); at <= until; at = next_event()) {
            if (at > cycles) cycles = at;
            if (at >= end) throw ended{"the end of the test"};
            if (watchdog_runs && at >= fed_at + watchdog_cycles()) throw ended{"watchdog"};
            if (systick_runs() && at >= next_wrap()) ++systick_wraps, systick_pending = true;
            for (auto &port : ports) {
                if (!port.line.empty() && port.line.front().at <= at) receive(port);
                if (port.shifting && port.sent.back().to <= at) end_of_byte(port);
            }
        }
        if (until > cycles) cycles = until;
    }

    // ---- interrupts ----

    bool port_asks(const serial_port &port) const {
        const bool enabled =
            cb_mcu_model.nvic_iser[port.interrupt / 32].word >> port.interrupt % 32 & 1;
        const auto bit = pended.find(port.interrupt);
        return enabled && (port.asks() || (bit != pended.end() && bit->second <= accesses));
    }

    bool interrupt_waits() const {
        if (systick_pending) return true;
        for (const auto &port : ports)
            if (port_asks(port)) return true;
        return false;
    }

    // Runs one pending interrupt, SysTick first, then the ports in order.
    void handle_one() {
        static void (*const handlers[])() = {cb_usart1_handler, cb_usart2_handler,
                                             cb_usart3_handler};
        handling = true;
        if (systick_pending) {
            systick_pending = false;
            cb_systick_handler();
        } else {
            for (unsigned i = 0; i < 3; ++i) {
                if (!port_asks(ports[i])) continue;
                pended.erase(ports[i].interrupt);
                handlers[i]();
                break;
            }
        }
        handling = false;
    }

    void take_interrupts() {
        for (unsigned i = 0; !masked && !handling && interrupt_waits(); ++i) {
            if (i > 50) throw ended{"an interrupt that never ends"};
            handle_one();
        }
    }

    // Runs before each access.
    void step() {
        ++accesses;
        run_to(cycles + access_cycles);
        while (!at_access.empty() && at_access.begin()->first <= accesses) {
            const auto action = at_access.begin()->second;
            at_access.erase(at_access.begin());
            action();
        }
        take_interrupts();
    }

    // The program computes without an access until this cycle; interrupts still occur.
    void compute_to(std::uint64_t until) {
        while (cycles < until) {
            const std::uint64_t next = next_event();
            run_to(next < until ? next : until);
            take_interrupts();
        }
    }
    void compute(std::uint64_t for_cycles) { compute_to(cycles + for_cycles); }

    void wait_for_interrupt() {
        step();
        while (!interrupt_waits()) run_to(next_event());
        take_interrupts();
    }

    // ---- registers ----

    serial_port *port_of(const cb_cell *at, std::size_t member) {
        for (auto &port : ports)
            if (reinterpret_cast<const char *>(at) ==
                reinterpret_cast<const char *>(port.registers) + member)
                return &port;
        return nullptr;
    }

    static std::uint32_t status(const serial_port &port) {
        std::uint32_t word = port.errors;
        if (port.rxne) word |= CB_USART_SR_RXNE;
        if (port.tc) word |= CB_USART_SR_TC;
        if (!port.holding) word |= CB_USART_SR_TXE;
        return word;
    }

    bool is_ready(std::uint32_t which) {
        const auto found = enabled_at.find(which);
        return found != enabled_at.end() && accesses >= found->second + ready_after;
    }

    std::uint32_t clock_control() {
        std::uint32_t word = cb_mcu_model.rcc.cr.word;
        if ((word & CB_RCC_CR_HSEON) && crystal_works && is_ready(CB_RCC_CR_HSEON))
            word |= CB_RCC_CR_HSERDY;
        if ((word & CB_RCC_CR_PLLON) && pll_works && is_ready(CB_RCC_CR_PLLON))
            word |= CB_RCC_CR_PLLRDY;
        return word;
    }

    // in : at: a register of the model
    // out: its value after one access' time, with the side effects of reading it
    std::uint32_t read(const cb_cell *at) {
        step();
        if (auto *port = port_of(at, offsetof(cb_usart_registers, sr))) {
            port->errors_read = port->errors;
            return status(*port);
        }
        if (auto *port = port_of(at, offsetof(cb_usart_registers, dr))) {
            port->rxne = false;
            port->errors &= ~port->errors_read;  // a later one remains
            return port->received;
        }
        if (at == &cb_mcu_model.systick.cvr) return systick_value();
        if (at == &cb_mcu_model.scb.icsr) return systick_pending ? CB_SCB_ICSR_PENDSTSET : 0;
        if (at == &cb_mcu_model.rcc.cr) return clock_control();
        if (at == &cb_mcu_model.rcc.cfgr) return at->word | (at->word & CB_RCC_CFGR_SW) << 2;
        if (at == &cb_mcu_model.flash.acr) return flash_works ? at->word : 0;
        if (at == &cb_mcu_model.iwdg.sr) return watchdog_answers ? 0 : 3;
        return at->word;
    }

    void write_watchdog_key(std::uint32_t key) {
        watchdog_open = key == 0x5555;
        if (key == 0xCCCC) watchdog_runs = true;
        if (key == 0xCCCC || key == 0xAAAA) fed_at = cycles;
    }

    void write_clock_control(std::uint32_t word) {
        const std::uint32_t before = cb_mcu_model.rcc.cr.word;
        for (const std::uint32_t which : {CB_RCC_CR_HSEON, CB_RCC_CR_PLLON})
            if (word & ~before & which) enabled_at[which] = accesses;
        cb_mcu_model.rcc.cr.word = word & ~std::uint32_t{CB_RCC_CR_HSERDY | CB_RCC_CR_PLLRDY};
    }

    void send(serial_port &port, std::uint8_t byte) {
        if (!port.on(CB_USART_CR1_TE)) return;
        port.tc = false;
        port.held = byte;
        port.holding = true;
        if (!port.shifting) shift(port, cycles);
    }

    void write_pins(cb_gpio *gpio, std::uint32_t word) {
        pins[gpio] = (pins[gpio] & ~(word >> 16)) | (word & 0xFFFF);
        for (auto &port : ports)
            if (port.shifting && !driven(port)) port.sent.back().driven = false;
    }

    // in : at: a register of the model; word: the written value
    // out: the register's side effects; throws `ended` at a reset
    void store(cb_cell *at, std::uint32_t word) {
        if (at == &cb_mcu_model.iwdg.kr) return write_watchdog_key(word);
        if ((at == &cb_mcu_model.iwdg.pr || at == &cb_mcu_model.iwdg.rlr) && !watchdog_open) return;
        if (at == &cb_mcu_model.rcc.cr) return write_clock_control(word);
        if (at == &cb_mcu_model.scb.aircr) throw ended{"reset"};
        if (at == &cb_mcu_model.gpio_a.bsrr) return write_pins(CB_GPIOA, word);
        if (auto *port = port_of(at, offsetof(cb_usart_registers, dr)))
            return send(*port, static_cast<std::uint8_t>(word));
        for (unsigned i = 0; i < 3; ++i) {
            if (at == &cb_mcu_model.nvic_iser[i]) {
                at->word = at->word | word;
                return;
            }
            for (unsigned bit = 0; at == &cb_mcu_model.nvic_ispr[i] && bit < 32; ++bit)
                if (word >> bit & 1) pended.emplace(32 * i + bit, accesses + latency);
        }
        if (auto *port = port_of(at, offsetof(cb_usart_registers, cr1)))
            if (!(word & CB_USART_CR1_UE)) port->holding = port->rxne = false;
        if (at == &cb_mcu_model.rcc.csr && (word & CB_RCC_CSR_RMVF)) word &= 0x00FFFFFF;
        if (at == &cb_mcu_model.systick.cvr) systick_from = cycles, systick_wraps = 0;
        at->word = word;
    }

    void write(cb_cell *at, std::uint32_t word) {
        step();
        writes.emplace_back(at, word);
        store(at, word);
        take_interrupts();
    }
};

inline machine *the_machine = nullptr;

}  // namespace stm32f405

// Each file that includes it has them, and the linker takes one.
extern "C" {
__attribute__((weak)) uint32_t cb_read(const cb_cell *at) {
    return stm32f405::the_machine->read(at);
}
__attribute__((weak)) void cb_write(cb_cell *at, uint32_t word) {
    stm32f405::the_machine->write(at, word);
}
__attribute__((weak)) void cb_barrier(void) {
    stm32f405::the_machine->step();
}
__attribute__((weak)) void cb_interrupts_off(void) {
    stm32f405::the_machine->step();
    stm32f405::the_machine->masked = true;
}
__attribute__((weak)) void cb_interrupts_on(void) {
    stm32f405::the_machine->step();
    stm32f405::the_machine->masked = false;
    stm32f405::the_machine->take_interrupts();
}
__attribute__((weak)) void cb_wait_for_interrupt(void) {
    stm32f405::the_machine->wait_for_interrupt();
}
__attribute__((weak)) bool cb_guard_intact(void) {
    return true;
}
__attribute__((weak)) uint32_t cb_guard_stack_bytes(void) {
    return 4096;
}
__attribute__((weak)) uint32_t cb_guard_stack_used(void) {
    return 1000;
}
}

#endif
