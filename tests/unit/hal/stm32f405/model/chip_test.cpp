// SPDX-License-Identifier: MIT
// Clock, watchdog and what the chip knows of itself, on modelled registers.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/stm32f405_model.h"

extern "C" {
#define _Noreturn __attribute__((noreturn))
#include "firmware/config/rtu_budget.h"
#include "hal/stm32f405/chip.h"
#include "hal/stm32f405/watchdog.h"
#undef _Noreturn
}

namespace {

using stm32f405::machine;

struct rig {
    machine m;
    rig() { stm32f405::the_machine = &m; }
    ~rig() { stm32f405::the_machine = nullptr; }
    rig(const rig &) = delete;
    rig &operator=(const rig &) = delete;
};

// ---- time ----

// A processor so slow that each look is disturbed by the next interrupt.
TEST(stm32f405_time, a_look_that_is_always_disturbed_ends_after_four) {
    rig r;
    cb_time_start(168000000);
    r.m.access_cycles = 14000;  // 12 of them in a millisecond, 11 in the interrupt
    std::uint64_t most = 0;
    for (unsigned i = 0; i < 10; ++i) {
        const std::uint64_t accesses = r.m.accesses;
        const auto now_us = static_cast<double>(cb_time_us());  // before the model's time
        EXPECT_NEAR(now_us, r.m.us(), 3000);
        most = std::max(most, r.m.accesses - accesses);
    }
    EXPECT_GT(most, 40u);
    EXPECT_LT(most, 100u);
}

// ---- clock ----

TEST(stm32f405_clock, runs_from_the_crystal_and_watches_it) {
    rig r;
    const cb_clock clock = cb_clock_start(true);
    EXPECT_EQ(clock.source, CB_CLOCK_CRYSTAL);
    EXPECT_EQ(clock.core_hz, 168000000u);
    EXPECT_EQ(clock.apb1_hz, 42000000u);
    EXPECT_EQ(clock.apb2_hz, 42000000u);
    EXPECT_TRUE(cb_mcu_model.rcc.cr.word & CB_RCC_CR_CSSON);
    EXPECT_EQ(cb_mcu_model.rcc.cfgr.word & CB_RCC_CFGR_SW, std::uint32_t{CB_RCC_CFGR_SW_PLL});
}

// The wait states have to be there before the processor is fast.
TEST(stm32f405_clock, the_flash_is_slowed_before_the_processor_is_fast) {
    rig r;
    (void)cb_clock_start(true);
    const auto place = [&r](const cb_cell *at, std::uint32_t bits) {
        return std::find_if(r.m.writes.begin(), r.m.writes.end(), [&](const auto &one) {
            return one.first == at && (one.second & bits) == bits;
        });
    };
    const auto states = place(&cb_mcu_model.flash.acr, 5);
    const auto fast = place(&cb_mcu_model.rcc.cfgr, CB_RCC_CFGR_SW_PLL);
    ASSERT_NE(fast, r.m.writes.end());
    EXPECT_LT(states, fast);
}

TEST(stm32f405_clock, each_thing_that_never_gets_ready_has_its_way_out) {
    const struct {
        bool crystal, crystal_works, pll_works, flash_works;
        cb_clock_source source;
    } cases[] = {
        {true, false, true, true, CB_CLOCK_INTERNAL}, {false, true, true, true, CB_CLOCK_INTERNAL},
        {true, true, false, true, CB_CLOCK_SLOW},     {true, true, true, false, CB_CLOCK_SLOW},
        {true, false, false, true, CB_CLOCK_SLOW},
    };
    for (const auto &one : cases) {
        rig r;
        r.m.crystal_works = one.crystal_works;
        r.m.pll_works = one.pll_works;
        r.m.flash_works = one.flash_works;
        const cb_clock clock = cb_clock_start(one.crystal);
        EXPECT_EQ(clock.source, one.source);
        EXPECT_EQ(clock.core_hz, one.source == CB_CLOCK_SLOW ? 16000000u : 168000000u);
        EXPECT_LT(r.m.accesses, 1000000u);
        EXPECT_FALSE(cb_mcu_model.rcc.cr.word & CB_RCC_CR_CSSON);
        EXPECT_EQ((cb_mcu_model.rcc.cfgr.word & CB_RCC_CFGR_SW) == CB_RCC_CFGR_SW_PLL,
                  one.source != CB_CLOCK_SLOW);
    }
}

TEST(stm32f405_clock, a_late_crystal_is_waited_for) {
    for (std::uint64_t after = 0; after < 2000; after += 100) {
        rig r;
        r.m.ready_after = after;
        EXPECT_EQ(cb_clock_start(true).source, CB_CLOCK_CRYSTAL) << after;
    }
}

TEST(stm32f405_clock, registers_that_read_0_are_the_emulator) {
    rig r;
    cb_mcu_model.rcc.cr.word = 0;
    EXPECT_EQ(cb_clock_start(true).source, CB_CLOCK_EMULATED);
    EXPECT_TRUE(r.m.writes.empty());
}

TEST(stm32f405_clock, each_port_has_each_usual_baud_rate) {
    rig r;
    const cb_clock clock = cb_clock_start(true);
    cb_usart_prepare(&clock);
    for (unsigned i = 0; i < CB_USARTS; ++i) {
        for (const std::uint32_t *baud = cb_usual_bauds; *baud != 0; ++baud) {
            cb_usart_open(static_cast<cb_usart>(i), *baud, CB_USART_NONE, 1);
            const double bits = 168e6 / static_cast<double>(r.m.ports[i].bit_cycles());
            EXPECT_NEAR(bits, *baud, *baud * 0.01) << i;
        }
    }
}

// ---- watchdog ----

TEST(stm32f405_watchdog, runs_with_the_time_asked_for) {
    const struct {
        std::uint32_t asked_ms, counts;
    } cases[] = {{8, 1}, {300, 38}, {8000, 1000}, {32000, 4000}, {100000, 4095}};
    for (const auto &one : cases) {
        rig r;
        cb_watchdog_start(one.asked_ms);
        EXPECT_TRUE(r.m.watchdog_runs);
        EXPECT_EQ(cb_mcu_model.iwdg.pr.word, 6u);
        EXPECT_EQ(cb_mcu_model.iwdg.rlr.word, one.counts);
    }
}

TEST(stm32f405_watchdog, bites_when_it_is_not_fed_and_not_before) {
    rig r;
    cb_watchdog_start(304);
    for (int i = 0; i < 20; ++i) {
        r.m.compute(300 * 1000 * stm32f405::cycles_per_us);
        cb_watchdog_feed();
    }
    EXPECT_THROW(r.m.compute(400 * 1000 * stm32f405::cycles_per_us), stm32f405::ended);
}

TEST(stm32f405_watchdog, a_status_that_never_clears_is_not_waited_for) {
    rig r;
    r.m.watchdog_answers = false;
    cb_watchdog_start(8000);
    EXPECT_TRUE(r.m.watchdog_runs);
    EXPECT_EQ(r.m.writes.back().first, &CB_IWDG->kr);
    EXPECT_EQ(r.m.writes.back().second, 0xAAAAu);
}

// ---- reset flags, note of the box ----

constexpr std::uint32_t power = CB_RCC_CSR_PORRSTF, brown_out = CB_RCC_CSR_BORRSTF,
                        pin = CB_RCC_CSR_PINRSTF, software = CB_RCC_CSR_SFTRSTF,
                        watchdog = CB_RCC_CSR_IWDGRSTF, window = CB_RCC_CSR_WWDGRSTF,
                        low_power = CB_RCC_CSR_LPWRRSTF;

// As the hardware sets them: the pin's flag with every reset, brown-out's with power-on.
TEST(stm32f405_chip, the_reset_cause_is_distinguished_and_the_flags_are_cleared) {
    const struct {
        std::uint32_t flags;
        cb_start_cause cause;
    } cases[] = {
        {power | brown_out | pin, CB_START_POWER},
        {brown_out | pin, CB_START_BROWN_OUT},
        {pin, CB_START_PIN},
        {software | pin, CB_START_SOFTWARE},
        {watchdog | pin, CB_START_WATCHDOG},
        {window | pin, CB_START_WINDOW},
        {low_power | pin, CB_START_LOW_POWER},
        {0, CB_START_UNKNOWN},
        {watchdog | software, CB_START_WATCHDOG},
    };
    for (const auto &one : cases) {
        rig r;
        cb_mcu_model.rcc.csr.word = one.flags | 3;  // the watchdog's oscillator is on
        EXPECT_EQ(cb_chip_reset_cause(), one.cause) << one.flags;
        EXPECT_EQ(cb_mcu_model.rcc.csr.word, 3u) << one.flags;
        EXPECT_STRNE(cb_start_text(one.cause), "unknown");
    }
}

TEST(stm32f405_chip, what_the_box_noted_before_its_restart_counts_once) {
    rig r;
    (void)cb_retained_open(CB_START_POWER);
    EXPECT_THROW(cb_restart(CB_START_FAULT), stm32f405::ended);
    EXPECT_EQ(cb_retained_open(CB_START_SOFTWARE), CB_START_FAULT);
    EXPECT_EQ(cb_retained.fault_starts, 1u);
    EXPECT_EQ(cb_retained_open(CB_START_WATCHDOG), CB_START_WATCHDOG);
    EXPECT_EQ(cb_retained.fault_starts, 2u);
    EXPECT_EQ(cb_retained_open(CB_START_PIN), CB_START_PIN);
    EXPECT_EQ(cb_retained.fault_starts, 2u);
    cb_retained.faults ^= 1;  // memory that power-on filled with anything
    EXPECT_EQ(cb_retained_open(CB_START_POWER), CB_START_POWER);
    EXPECT_EQ(cb_retained.fault_starts, 0u);
}

TEST(stm32f405_chip, resets_that_the_box_did_not_want_need_permission) {
    for (const auto cause :
         {CB_START_WATCHDOG, CB_START_WINDOW, CB_START_LOW_POWER, CB_START_FAULT, CB_START_STACK})
        EXPECT_TRUE(cb_start_was_fault(cause)) << cb_start_text(cause);
    for (const auto cause : {CB_START_UNKNOWN, CB_START_POWER, CB_START_BROWN_OUT, CB_START_PIN,
                             CB_START_SOFTWARE, CB_START_CLOCK, CB_START_REQUESTED})
        EXPECT_FALSE(cb_start_was_fault(cause)) << cb_start_text(cause);
}

// ---- option bytes, unique id ----

TEST(stm32f405_chip, the_brown_out_level_is_that_of_the_option_bytes) {
    const struct {
        std::uint32_t word;
        cb_brown_out level;
        bool guarded;
    } cases[] = {{0x0FFFAAE1, CB_BROWN_OUT_3, true},
                 {0x0FFFAAE5, CB_BROWN_OUT_2, false},
                 {0x0FFFAAE9, CB_BROWN_OUT_1, false},
                 {0x0FFFAAED, CB_BROWN_OUT_OFF, false}};  // as delivered
    for (const auto &one : cases) {
        rig r;
        cb_mcu_model.flash.optcr.word = one.word;
        const cb_chip chip = cb_chip_read(false);
        EXPECT_EQ(chip.brown_out, one.level) << one.word;
        EXPECT_EQ(cb_chip_is_guarded(&chip), one.guarded) << one.word;
        EXPECT_TRUE(r.m.writes.empty()) << "option bytes are for the programmer to change";
    }
}

TEST(stm32f405_chip, the_unique_id_is_not_touched_in_the_emulator) {
    rig r;
    for (std::uint32_t i = 0; i < 3; ++i) cb_mcu_model.unique_id[i].word = 0x11111111 * (i + 1);
    const cb_chip real = cb_chip_read(false);
    EXPECT_EQ(real.unique_id[0], 0x11111111u);
    EXPECT_EQ(real.unique_id[2], 0x33333333u);
    const auto accesses = r.m.accesses;
    const cb_chip emulated = cb_chip_read(true);
    EXPECT_EQ(r.m.accesses, accesses);
    EXPECT_EQ(emulated.brown_out, CB_BROWN_OUT_UNKNOWN);
    EXPECT_TRUE(cb_chip_is_guarded(&emulated));
}

}  // namespace
