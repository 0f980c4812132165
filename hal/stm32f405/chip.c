/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/chip.h"

#include "hal/stm32f405/mcu.h"

/* Every reset also sets the pin's flag, and power-on that of brown-out: the first set one in this
 * list is used. */
static const struct {
    uint32_t flag;
    enum cb_start_cause cause;
} causes[] = {
    {CB_RCC_CSR_PORRSTF, CB_START_POWER},      {CB_RCC_CSR_BORRSTF, CB_START_BROWN_OUT},
    {CB_RCC_CSR_LPWRRSTF, CB_START_LOW_POWER}, {CB_RCC_CSR_IWDGRSTF, CB_START_WATCHDOG},
    {CB_RCC_CSR_WWDGRSTF, CB_START_WINDOW},    {CB_RCC_CSR_SFTRSTF, CB_START_SOFTWARE},
    {CB_RCC_CSR_PINRSTF, CB_START_PIN},
};

enum cb_start_cause cb_chip_reset_cause(void) {
    const uint32_t flags = cb_read(&CB_RCC->csr);
    cb_set_bits(&CB_RCC->csr, CB_RCC_CSR_RMVF);
    for (unsigned i = 0; i < sizeof causes / sizeof causes[0]; ++i)
        if (flags & causes[i].flag) return causes[i].cause;
    return CB_START_UNKNOWN;
}

struct cb_chip cb_chip_read(bool emulated) {
    struct cb_chip chip = {.brown_out = CB_BROWN_OUT_UNKNOWN};
    if (emulated) return chip;
    for (unsigned i = 0; i < 3; ++i) chip.unique_id[i] = cb_read(&CB_UNIQUE_ID[i]);
    chip.brown_out = (enum cb_brown_out)(cb_read(&CB_FLASH->optcr) >> CB_FLASH_OPTCR_BOR_LEV & 3);
    return chip;
}

bool cb_chip_is_guarded(const struct cb_chip *chip) {
    return chip->brown_out == CB_BROWN_OUT_3 || chip->brown_out == CB_BROWN_OUT_UNKNOWN;
}

const char *cb_brown_out_text(enum cb_brown_out level) {
    static const char *const texts[] = {
#define CB_X(name, text) text,
        CB_BROWN_OUTS(CB_X)
#undef CB_X
    };
    return level < sizeof texts / sizeof texts[0] ? texts[level] : "unknown";
}
