// SPDX-License-Identifier: MIT
// The whole program of the STM32F405, from its first line on, on modelled registers. Each run is a
// process of its own: the program's memory begins empty.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>

#include "tests/support/config_fixture.h"
#include "tests/support/stm32f405_model.h"

extern "C" {
#define _Noreturn __attribute__((noreturn))
#include "firmware/base/crc32.h"
#include "firmware/load/slot.h"
#include "hal/stm32f405/main.h"
#undef _Noreturn

// Of scripts/report mcdc alone: _exit() leaves without the profile of what ran.
int __llvm_profile_write_file(void) __attribute__((weak));
}

namespace {

using stm32f405::machine;

// Of the fixture what an STM32F405 takes: RTU, no CAN.
std::string a_file() {
    using compbox_test::with;
    std::string text = with(R"({"tcp": {"host": "127.0.0.1", "port": 1502, "unit": 1}})",
                            R"({"rtu": {"device": "/dev/ttyS0", "baud": 115200, "unit": 1}})");
    return with(R"("can": "0x181", "offset": 2, "type": "int16le")",
                R"("plc": 12, "type": "int16")", text);
}

void flash(unsigned slot, const std::string &text) {
    cb_slot_header(7, text.data(), static_cast<std::uint32_t>(text.size()), cb_model_slots[slot]);
    text.copy(reinterpret_cast<char *>(cb_model_slots[slot]) + CB_SLOT_HEADER_BYTES, text.size());
}

// What is observed of a run, one line each: "console TEXT", "watchdog COUNTS at_ms", "first …".
void report(const machine &m, const std::string &why, int to) {
    std::string text;
    for (const auto &one : m.ports[CB_USART_CONSOLE].sent) text += static_cast<char>(one.byte);
    text += "\nended: " + why + "\n";
    const bool first = !m.writes.empty() && m.writes.front().first == &cb_mcu_model.iwdg.kr;
    text += std::string("watchdog first: ") + (first ? "yes" : "no") + "\n";
    for (const auto &one : m.writes)
        if (one.first == &cb_mcu_model.iwdg.rlr)
            text += "watchdog counts: " + std::to_string(one.second) + "\n";
    for (std::size_t done = 0; done < text.size();) {
        const auto size = write(to, text.data() + done, text.size() - done);
        if (size <= 0) return;
        done += static_cast<std::size_t>(size);
    }
}

// Runs the program for so long, or until it ends. out: what report() says
template <typename F>
std::string run(unsigned for_ms, F prepare) {
    int ends[2];
    if (pipe(ends) != 0) return "no pipe";
    const pid_t child = fork();
    if (child == 0) {
        machine m;
        stm32f405::the_machine = &m;
        std::memset(cb_model_slots, 0xFF, sizeof cb_model_slots);
        prepare(m);
        m.end = for_ms * 1000 * stm32f405::cycles_per_us;
        std::string why = "nothing";
        try {
            cb_main();
        } catch (const stm32f405::ended &end) {
            why = end.why;
        }
        report(m, why, ends[1]);
        if (__llvm_profile_write_file) __llvm_profile_write_file();
        _exit(0);
    }
    close(ends[1]);
    std::string text;
    char some[4096];
    for (ssize_t size; (size = read(ends[0], some, sizeof some)) > 0;)
        text.append(some, static_cast<std::size_t>(size));
    close(ends[0]);
    waitpid(child, nullptr, 0);
    return text;
}

void expect(const std::string &text, const std::string &piece) {
    EXPECT_NE(text.find(piece), std::string::npos) << piece << "\nis not in\n" << text;
}

TEST(stm32f405_image, the_console_names_version_chip_file_and_brown_out_level) {
    const std::string file = a_file();
    const std::string text = run(200, [&](machine &) {
        flash(0, file);
        cb_mcu_model.rcc.csr.word = CB_RCC_CSR_PORRSTF | CB_RCC_CSR_BORRSTF | CB_RCC_CSR_PINRSTF;
        cb_mcu_model.flash.optcr.word = 0x0FFFAAE1;
        for (std::uint32_t i = 0; i < 3; ++i) cb_mcu_model.unique_id[i].word = 0x00C0FFEE + i;
    });
    char crc[16];
    std::snprintf(crc, sizeof crc, "%08x", cb_crc32(0, file.data(), file.size()));
    expect(text, "compbox-stm32f405 0.");
    expect(text, "started: power-on; 168 MHz from the crystal");
    expect(text, "chip 00c0ffee00c0ffef00c0fff0; brown-out reset at level 3\r\n");
    expect(text, std::string("slot A: revision 7, ") + std::to_string(file.size()) +
                     " bytes, CRC-32 " + crc);
    expect(text, std::string("runs revision 7 of slot A: gantry 14 m, CRC-32 ") + crc + "\r\n");
    expect(text, "slot B: empty");
}

TEST(stm32f405_image, a_brown_out_level_that_is_off_or_low_is_a_warning) {
    for (const std::uint32_t word : {0x0FFFAAEDu, 0x0FFFAAE9u, 0x0FFFAAE5u}) {
        const std::string text =
            run(100, [word](machine &) { cb_mcu_model.flash.optcr.word = word; });
        expect(text, word == 0x0FFFAAED ? "brown-out reset OFF: set" : ", TOO LOW: set");
        expect(text, "set the option bytes to level 3 (docs/stm32f405.md)");
    }
}

TEST(stm32f405_image, the_console_names_the_reset_cause) {
    const struct {
        std::uint32_t flags;
        const char *text;
    } cases[] = {{CB_RCC_CSR_PINRSTF, "started: reset pin;"},
                 {CB_RCC_CSR_BORRSTF, "started: brown-out: the supply was too low;"},
                 {CB_RCC_CSR_IWDGRSTF, "started: watchdog: no cycle was completed;"},
                 {CB_RCC_CSR_LPWRRSTF, "started: low-power reset"}};
    for (const auto &one : cases) {
        expect(run(20, [&one](machine &) { cb_mcu_model.rcc.csr.word = one.flags; }), one.text);
    }
}

// 8 s (1000 counts of 8 ms) from the first access on, ten periods from the first cycle on.
TEST(stm32f405_image, the_watchdog_runs_before_all_else_and_is_shortened_by_the_first_cycle) {
    const std::string with_file = run(200, [](machine &) { flash(0, a_file()); });
    expect(with_file, "watchdog first: yes\n");
    expect(with_file, "watchdog counts: 1000\nwatchdog counts: 38\n");
    expect(with_file, "ended: the end of the test\n");
    expect(run(200, [](machine &) {}), "watchdog counts: 1000\nwatchdog counts: 38\n");
}

// A clock whose registers never answer, without a file.
TEST(stm32f405_image, comes_up_on_whatever_the_hardware_gives) {
    expect(run(300, [](machine &m) { m.crystal_works = false; }), "168 MHz from the internal");
    expect(run(300, [](machine &m) { m.watchdog_answers = false; }), "STANDBY: there is no");
    const std::string emulated = run(100, [](machine &) { cb_mcu_model.rcc.cr.word = 0; });
    expect(emulated, "started: no reset flag is set; 168 MHz, emulated");
    expect(emulated, "brown-out reset unknown, emulated\r\n");
}

}  // namespace
