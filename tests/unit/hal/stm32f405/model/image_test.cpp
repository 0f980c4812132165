// SPDX-License-Identifier: MIT
// The whole program of the STM32F405, from its first line on, on modelled registers. Each run is a
// process of its own: the program's memory begins empty.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "tests/support/config_fixture.h"
#include "tests/support/stm32f405_model.h"

extern "C" {
#define _Noreturn __attribute__((noreturn))
#include "firmware/base/crc32.h"
#include "firmware/load/slot.h"
#include "firmware/wire/modbus_rtu.h"
#include "hal/stm32f405/app/commands.h"
#include "hal/stm32f405/app/last_cycles.h"
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

// in : names_plc: the header has the place of the PLC's status register
void flash(unsigned slot, const std::string &text, bool names_plc = false) {
    const cb_slot_report place = {115200, 101, 1, CB_PARITY_EVEN, 1};
    cb_slot_header(7, text.data(), static_cast<std::uint32_t>(text.size()), cb_model_slots[slot]);
    if (names_plc) cb_slot_set_report(cb_model_slots[slot], &place);
    text.copy(reinterpret_cast<char *>(cb_model_slots[slot]) + CB_SLOT_HEADER_BYTES, text.size());
}

// Commands of this test's image: on silicon they take a defect, or ten minutes.
void corrupt(cb_app *app) {
    app->box.config.period_us ^= 1;
}
void near_the_end_of_a_good_run(cb_app *app) {
    app->box.counters.cycles = 19990;
}
void lose_channels(cb_app *app) {
    app->box.config.channels_count = 0;
}
void invent_channels(cb_app *app) {
    app->box.config.channels_count = 255;
}
void count_all(cb_app *app) {
    std::memset(&app->box.counters, 0xEE, sizeof app->box.counters);
}
void say_too_much(cb_app *app) {
    cb_console_say(&app->console, std::string(CB_TEXT_BYTES + 1, 'x').c_str());
}
void wear(cb_app *) {
    cb_model_slots[0][CB_SLOT_HEADER_BYTES] ^= 1;
}
const cb_command commands[] = {{"corrupt", "", corrupt},
                               {"count all", "", count_all},
                               {"say too much", "", say_too_much},
                               {"wear", "", wear},
                               {"lose channels", "", lose_channels},
                               {"invent channels", "", invent_channels},
                               {"age", "", near_the_end_of_a_good_run}};

}  // namespace

extern "C" const cb_command_list cb_test_commands = {commands, std::size(commands)};

namespace {

// A good file without a bus: two positions, one channel.
std::string small_file(const char *period_ms = "30") {
    return std::string(
               R"({"format": "compbox/1", "revision": 7, "machine": {"name": "small", "axes": ["X", "Y", "Z"]},
  "cycle": {"period_ms": )") +
           period_ms + R"(},
  "plc": {"profile": "generic", "transport": {"rtu": {"device": "/dev/ttyS0", "baud": 115200, "unit": 1}},
    "exchange": "fc3+fc16", "read": {"start": 0, "count": 16}, "write": {"start": 100, "count": 16},
    "control": 0, "plc_heartbeat": 1, "status": 101, "box_heartbeat": 102, "heartbeat_timeout_ms": 500},
  "signals": [
    {"name": "X", "unit": "mm", "plc": 8, "type": "int16", "scale": 1, "min": 0, "max": 1000},
    {"name": "Y", "unit": "mm", "plc": 9, "type": "int16", "scale": 1, "min": 0, "max": 1000}],
  "terms": [
    {"name": "EZX", "type": "polyline", "signal": "X", "positions": [0, 1000], "values": [0, 50]},
    {"name": "EZY", "type": "polyline", "signal": "Y", "positions": [0, 1000], "values": [0, 50]}],
  "channels": [{"name": "Z", "sum": ["EZX", "EZY"], "limit_um": 300, "error_um": 400, "slew_um_per_s": 500,
    "plc": 104, "type": "int32", "scale": 0.01}],
  "safety": {"hold_ms": 500, "ramp_um_per_s": 50}})";
}

// A file that every loader refuses, with a header that names the PLC.
std::string refused_file() {
    std::string text = small_file();
    return text.replace(text.find("\"hold_ms\": 500"), 14, "\"hold_ms\": -50");
}

// A PLC on the wire: it answers each request a millisecond after its last bit.
struct plc {
    machine &m;
    std::array<std::uint16_t, 256> registers{};
    std::size_t seen = 0;  // bytes of earlier requests
    std::function<void(double ms)> duties = [](double) {};

    explicit plc(machine &of) : m(of) {
        registers[0] = 1 | 2;  // enabled and referenced
        m.access_cycles =
            100;  // long runs on a slow processor: where it waits, it looks less often
        m.ports[CB_USART_PLC].on_idle = [this] { look(); };
    }
    unsigned word(std::size_t at) const {
        const auto &sent = m.ports[CB_USART_PLC].sent;
        return sent[seen + at].byte * 256u + sent[seen + at + 1].byte;
    }
    void look() {
        const auto &sent = m.ports[CB_USART_PLC].sent;
        const std::size_t have = sent.size() - seen;
        if (have < 8) return;
        const bool writes = sent[seen + 1].byte == 16;
        if (writes && have < 9u + sent[seen + 6].byte) return;
        duties(m.us() / 1000);
        ++registers[1];
        answer(writes);
        seen = sent.size();
    }
    void answer(bool writes) {
        const auto &sent = m.ports[CB_USART_PLC].sent;
        const unsigned start = word(2), count = word(4);
        std::vector<std::uint8_t> reply = {sent[seen].byte, sent[seen + 1].byte};
        if (writes) {
            for (unsigned i = 0; i < count; ++i)
                registers[start + i] = static_cast<std::uint16_t>(word(7 + 2 * i));
            for (unsigned i = 2; i < 6; ++i) reply.push_back(sent[seen + i].byte);
        } else {
            reply.push_back(static_cast<std::uint8_t>(2 * count));
            for (unsigned i = 0; i < count; ++i) {
                reply.push_back(static_cast<std::uint8_t>(registers[start + i] >> 8));
                reply.push_back(static_cast<std::uint8_t>(registers[start + i]));
            }
        }
        send(reply);
    }
    void send(std::vector<std::uint8_t> reply) {
        const unsigned crc = cb_rtu_crc(reply.data(), reply.size());
        reply.push_back(static_cast<std::uint8_t>(crc));
        reply.push_back(static_cast<std::uint8_t>(crc >> 8));
        auto &port = m.ports[CB_USART_PLC];
        std::uint64_t at = m.cycles + 1000 * stm32f405::cycles_per_us;
        for (const auto byte : reply) port.line.push_back({at += port.byte_cycles(), byte, 0});
    }
};

// A person types this at the console, later than what was typed before.
// in : errors of its first byte
void type(machine &m, unsigned at_ms, const std::string &text, std::uint32_t errors = 0) {
    std::uint64_t at = at_ms * 1000 * stm32f405::cycles_per_us;
    for (const char one : text) {
        m.ports[CB_USART_CONSOLE].line.push_back(
            {at += 15000, static_cast<std::uint8_t>(one), errors});
        errors = 0;
    }
}

// What is observed of a run, one line each: the console's text, the end's cause, the watchdog, the
// first bytes to the PLC.
void report(const machine &m, const std::string &why, int to) {
    std::string text;
    for (const auto &one : m.ports[CB_USART_CONSOLE].sent) text += static_cast<char>(one.byte);
    text += "\nended: " + why + "\n";
    const bool first = !m.writes.empty() && m.writes.front().first == &cb_mcu_model.iwdg.kr;
    text += std::string("watchdog first: ") + (first ? "yes" : "no") + "\n";
    const auto &sent = m.ports[CB_USART_PLC].sent;
    text += "plc: " + std::to_string(sent.size()) + " bytes, ";
    for (std::size_t i = 0; i < std::min<std::size_t>(sent.size(), 9); ++i) {
        char hex[3];
        std::snprintf(hex, sizeof hex, "%02x", unsigned{sent[i].byte});
        text += hex;
    }
    text += "\n";
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

void never(const std::string &text, const std::string &piece) {
    EXPECT_EQ(text.find(piece), std::string::npos) << piece << "\nis in\n" << text;
}

TEST(stm32f405_image, the_console_reports_each_change_of_mode_reason_and_signal_once) {
    const std::string text = run(900, [](machine &m) {
        flash(0, small_file());
        auto *control = new plc(m);
        control->duties = [control](double ms) {
            const auto far = static_cast<std::uint16_t>(2000);
            control->registers[8] = ms > 300 && ms < 550 ? far : 100;
            control->registers[9] = ms > 400 && ms < 700 ? far : 100;
        };
    });
    expect(text, "now ACTIVE: ");
    expect(text, "now HOLD: ");
    expect(text, "signal X ");
    expect(text, "signal Y ");
    EXPECT_EQ(text.find("signal Y "), text.rfind("signal Y ")) << text;
}

TEST(stm32f405_image, commands_are_lines_of_either_end_that_fit) {
    const std::string text = run(400, [](machine &m) {
        type(m, 20, "counters\r");
        type(m, 60, "\r\nwires\n");
        type(m, 100, std::string(CB_CONSOLE_LINE + 5, 'x') + "\rcount\r");
    });
    expect(text, "counters:");
    expect(text, "plc:");
    expect(text, "no such command; `help` lists them");
    EXPECT_EQ(text.find("no such command"), text.rfind("no such command")) << text;
}

TEST(stm32f405_image, a_damaged_byte_is_part_of_no_command_and_ends_none) {
    const std::string text = run(400, [](machine &m) {
        type(m, 20, "wir");
        type(m, 60, "es\r", CB_USART_SR_FE);
        type(m, 100, "wires");
        type(m, 140, "\r", CB_USART_SR_FE);
        type(m, 180, "\rcounters\r");
    });
    never(text, " plc:");
    expect(text, "no such command");
    expect(text, "counters:");
}

TEST(stm32f405_image, the_counters_are_whole_however_many_there_are) {
    const std::string text = run(400, [](machine &m) { type(m, 20, "count all\rcounters\r"); });
    for (unsigned i = 0; i < CB_COUNTERS_COUNT; ++i)
        expect(text, std::string(" ") + cb_counter_name(i) + "=4008636142");
    never(text, "...");
}

TEST(stm32f405_image, a_line_that_is_cut_off_shows_it) {
    const std::string text = run(400, [](machine &m) { type(m, 20, "say too much\r"); });
    expect(text, "\n" + std::string(CB_TEXT_BYTES - 3, 'x') + "...\r\n");
}

// Reading two full ones takes 26 ms, which a cycle does not have.
TEST(stm32f405_image, the_slots_are_read_at_the_start_alone) {
    const std::string text = run(400, [](machine &m) {
        flash(0, small_file());
        type(m, 100, "wear\rslots\r");
    });
    expect(text, "runs revision 7 of slot A");
    EXPECT_NE(text.find("slot A: revision 7"), text.rfind("slot A: revision 7")) << text;
    never(text, "BROKEN");
}

TEST(stm32f405_image, the_trace_pauses_when_the_configuration_is_corrupt) {
    const std::string text = run(600, [](machine &m) {
        flash(0, small_file());
        new plc(m);
        type(m, 200, "trace on\r");
        type(m, 400, "corrupt\r");
    });
    expect(text, "\nT ");
    expect(text, "FAULT: ");
    EXPECT_LT(text.rfind("\nT "), text.find("FAULT: ")) << text;
}

TEST(stm32f405_image, a_dump_has_every_record_once) {
    const std::string text = run(4000, [](machine &m) {
        flash(0, small_file());
        new plc(m);
        type(m, 2500, "dump\r");
    });
    expect(text, "dump: cycle time_us mode reason control counters detail channels\r\n");
    expect(text, "dump: end\r\n");
    std::size_t lines = 0;
    for (std::size_t at = 0; (at = text.find("\nD ", at)) != std::string::npos; ++at) ++lines;
    EXPECT_GT(lines, 70u);  // more than the console has room for at once
    EXPECT_LT(lines, 90u);
}

TEST(stm32f405_image, a_dump_without_a_record_ends_too) {
    expect(run(400, [](machine &m) { type(m, 100, "dump\r"); }), "dump: end\r\n");
}

// Of each line of a dump: its channels.
std::vector<unsigned> dumped_channels(const std::string &text) {
    std::vector<unsigned> found;
    for (std::size_t at = 0; (at = text.find("\nD ", at)) != std::string::npos; ++at) {
        const std::string line = text.substr(at + 1, text.find('\r', at) - at - 1);
        found.push_back(static_cast<unsigned>(std::count(line.begin(), line.end(), ' ')) - 7);
    }
    return found;
}

TEST(stm32f405_image, a_dump_has_the_channels_of_the_file_or_all_where_its_count_is_lost) {
    const struct {
        const char *command;
        unsigned channels;
    } cases[] = {{"", 1}, {"lose channels", CB_MAX_CHANNELS}, {"invent channels", CB_MAX_CHANNELS}};
    for (const auto &one : cases) {
        const std::string text = run(2500, [&one](machine &m) {
            flash(0, small_file());
            new plc(m);
            type(m, 300, one.command + std::string("\r"));
            type(m, 400, "dump\r");
        });
        expect(text, "dump: end\r\n");
        const auto found = dumped_channels(text);
        ASSERT_GT(found.size(), 5u) << text;
        EXPECT_EQ(found, std::vector<unsigned>(found.size(), one.channels)) << one.command;
    }
}

TEST(stm32f405_image, a_dump_before_has_all_channels_without_a_file) {
    const std::string text = run(500, [](machine &m) {
        const auto box = std::make_unique<cb_box>();
        box->counters.cycles = 4711;
        cb_last_cycles_open(CB_START_POWER);
        cb_last_cycles_note(box.get());
        cb_retained.cause = CB_START_ASSERTION;
        cb_retained_seal();
        type(m, 100, "dump before\r");
    });
    expect(text, "STANDBY: there is no");
    expect(text, "\nD 4711 ");
    EXPECT_EQ(dumped_channels(text), std::vector<unsigned>{CB_MAX_CHANNELS}) << text;
}

TEST(stm32f405_image, ten_good_minutes_forget_earlier_faults) {
    for (const std::uint32_t faults : {0u, 2u}) {
        const std::string text = run(1500, [faults](machine &m) {
            cb_retained.cause = CB_START_ASSERTION;
            cb_retained.fault_starts = faults;
            std::strcpy(cb_retained.assertion, "box.c");
            if (faults > 0) cb_retained_seal();
            flash(0, small_file());
            new plc(m);
            type(m, 100, "age\rstart\r");
            type(m, 1000, "start\r");
        });
        expect(text, faults > 0 ? "assertion failed" : "no reset flag is set");
        expect(text, faults > 0 ? "restarts by faults 3" : "restarts by faults 0");
        EXPECT_NE(text.rfind("restarts by faults 0"), std::string::npos) << text;
    }
}

TEST(stm32f405_image, the_other_slot_runs_where_the_newest_is_refused) {
    const std::string good = small_file(), bad = refused_file();
    const struct {
        const char *a, *b, *says;
    } cases[] = {{bad.c_str(), good.c_str(), "runs revision 7 of slot B"},
                 {bad.c_str(), bad.c_str(), "STANDBY: there is no"},
                 {bad.c_str(), nullptr, "STANDBY: there is no"}};
    for (const auto &one : cases) {
        const std::string text = run(300, [&one](machine &) {
            flash(0, one.a);
            if (one.b) flash(1, one.b);
        });
        expect(text, "slot A: REFUSED, not used: ");
        expect(text, one.says);
    }
}

// Reason 15 (docs/faults.md), every 32 cycles of 30 ms, and nothing else.
TEST(stm32f405_image, a_box_without_a_file_tells_the_plc_where_a_header_names_it) {
    const std::string text = run(1500, [](machine &m) {
        flash(0, refused_file(), true);
        new plc(m);
    });
    expect(text, "STANDBY: there is no");
    expect(text, "plc: 22 bytes, 011000650001020f00");
}

// A period of 30.5 ms ends between two interrupts of SysTick.
TEST(stm32f405_image, a_period_of_half_a_millisecond_is_kept) {
    const std::string text = run(1000, [](machine &m) {
        flash(0, small_file("30.5"));
        new plc(m);
        type(m, 900, "trace on\r");
    });
    expect(text, "now ACTIVE: ");
    never(text, "missed 1");
    expect(text, "\nT ");
}

}  // namespace
