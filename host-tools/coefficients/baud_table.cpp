// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/baud_table.h"

#include <fmt/core.h>

extern "C" {
#include "firmware/config/config.h"
#include "firmware/config/rtu_budget.h"
}

namespace compbox::coefficients {

namespace {

double cycle_ms(cb_plc_config plc, std::uint8_t exchange, const cb_rtu_line &line) {
    plc.exchange = exchange;
    return cb_rtu_cycle_us(&plc, &line) * 1e-3;
}

}  // namespace

double exchange_budget_ms(const cb_config &config) {
    return cb_exchange_budget_us(config.period_us) * 1e-3;
}

std::vector<baud_row> baud_table(const cb_config &config) {
    std::vector<baud_row> rows;
    if (config.plc.transport != CB_TRANSPORT_RTU) return rows;
    for (const std::uint32_t *baud = cb_usual_bauds; *baud != 0; ++baud) {
        cb_rtu_line line = config.plc.serial.line;
        line.baud = *baud;
        rows.push_back(
            {*baud, cycle_ms(config.plc, CB_EXCHANGE_FC3_FC16, line),
             cycle_ms(config.plc, CB_EXCHANGE_FC23, line),
             cb_rtu_resync_us(&config.plc, &line) * 1e-3,
             cb_rtu_longest_us(&config.plc, &line) <= cb_exchange_budget_us(config.period_us)});
    }
    return rows;
}

std::string baud_table_text(const cb_config &config) {
    const auto rows = baud_table(config);
    if (rows.empty()) return "";
    const cb_serial_config &serial = config.plc.serial;
    std::string text = fmt::format(
        "Exchange of {} and {} registers on {}, {} bits a character, slave delay {:.4g} ms; "
        "{:.4g} ms of the period are there:\n"
        "   baud  fc3+fc16 ms   fc23 ms  after a loss ms\n",
        config.plc.read.count, config.plc.write.count, serial.device,
        cb_rtu_character_bits(&serial.line), serial.slave_delay_us * 1e-3,
        exchange_budget_ms(config));
    for (const auto &row : rows) {
        text += fmt::format("{:7}  {:11.2f}  {:8.2f}  {:15.2f}  {}{}\n", row.baud, row.fc3_fc16_ms,
                            row.fc23_ms, row.after_loss_ms, row.fits ? "fits" : "too slow",
                            row.baud == serial.line.baud ? "  <- this file" : "");
    }
    return text;
}

}  // namespace compbox::coefficients
