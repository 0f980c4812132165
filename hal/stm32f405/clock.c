/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/clock.h"

#include "hal/stm32f405/mcu.h"

/* PLL: 1 MHz in, times 336, by 2 = 168 MHz; by 7 = 48 MHz for peripherals with USB's clock. */
_Static_assert(CB_CRYSTAL_MHZ >= 4 && CB_CRYSTAL_MHZ <= 26, "the range of the oscillator");

enum {
    CRYSTAL_MHZ = CB_CRYSTAL_MHZ, /* of the build */
    INTERNAL_MHZ = 16,
    PLL_TIMES = 336,
    PLL_BY_7 = 7 << 24,
    FLASH_5_WAIT_STATES_PREFETCH_CACHES = 5 | 7 << 8,
    TRIES = 200000, /* at 16 MHz and some 8 cycles each: 100 ms; a crystal takes 2 ms */
};

/* out: whether the bits appeared within TRIES */
static bool wait_for(const cb_cell *at, uint32_t mask, uint32_t bits) {
    for (uint32_t i = 0; i < TRIES; ++i)
        if ((cb_read(at) & mask) == bits) return true;
    return false;
}

static bool start_crystal(void) {
    cb_set_bits(&CB_RCC->cr, CB_RCC_CR_HSEON);
    if (wait_for(&CB_RCC->cr, CB_RCC_CR_HSERDY, CB_RCC_CR_HSERDY)) return true;
    cb_clear_bits(&CB_RCC->cr, CB_RCC_CR_HSEON);
    return false;
}

/* in : the PLL's input, in MHz, and its source bit
 * out: whether the processor runs from the PLL; if not, its clock is unchanged */
static bool switch_to_pll(uint32_t input_mhz, uint32_t source) {
    cb_clear_bits(&CB_RCC->cr, CB_RCC_CR_PLLON);
    cb_write(&CB_RCC->pllcfgr, input_mhz | PLL_TIMES << 6 | PLL_BY_7 | source);
    cb_set_bits(&CB_RCC->cr, CB_RCC_CR_PLLON);
    if (!wait_for(&CB_RCC->cr, CB_RCC_CR_PLLRDY, CB_RCC_CR_PLLRDY)) return false;
    cb_write(&CB_FLASH->acr, FLASH_5_WAIT_STATES_PREFETCH_CACHES);
    if (!wait_for(&CB_FLASH->acr, 7, 5)) return false;
    cb_write(&CB_RCC->cfgr, CB_RCC_CFGR_APB1_BY_4 | CB_RCC_CFGR_APB2_BY_4);
    cb_set_bits(&CB_RCC->cfgr, CB_RCC_CFGR_SW_PLL);
    return wait_for(&CB_RCC->cfgr, CB_RCC_CFGR_SWS, CB_RCC_CFGR_SWS_PLL);
}

/* At most 78 MHz for a port: 1200 baud must fit into the 16 bits of its divider. */
static struct cb_clock fast(enum cb_clock_source source) {
    return (struct cb_clock){source, 168000000, 42000000, 42000000};
}

/* Returns to the internal oscillator, from which every start begins. */
static void leave_pll(void) {
    cb_write(&CB_RCC->cfgr, 0);
    (void)wait_for(&CB_RCC->cfgr, CB_RCC_CFGR_SWS, 0);
    cb_clear_bits(&CB_RCC->cr, CB_RCC_CR_PLLON);
}

static struct cb_clock slow(void) {
    leave_pll();
    return (struct cb_clock){CB_CLOCK_SLOW, 16000000, 16000000, 16000000};
}

struct cb_clock cb_clock_start(bool crystal) {
    /* On silicon the internal oscillator runs after every reset. All bits 0 identifies the
     * emulator, whose processor runs at 168 MHz and whose registers ignore writes. */
    if (cb_read(&CB_RCC->cr) == 0) return fast(CB_CLOCK_EMULATED);
    if (crystal && start_crystal() && switch_to_pll(CRYSTAL_MHZ, CB_RCC_PLL_HSE)) {
        cb_set_bits(&CB_RCC->cr, CB_RCC_CR_CSSON);
        return fast(CB_CLOCK_CRYSTAL);
    }
    leave_pll();
    if (switch_to_pll(INTERNAL_MHZ, 0)) return fast(CB_CLOCK_INTERNAL);
    return slow();
}

const char *cb_clock_text(enum cb_clock_source source) {
    static const char *const texts[] = {
#define CB_X(name, text) text,
        CB_CLOCKS(CB_X)
#undef CB_X
    };
    return source < sizeof texts / sizeof texts[0] ? texts[source] : "unknown";
}
