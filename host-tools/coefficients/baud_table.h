// SPDX-License-Identifier: MIT
// Duration of the exchange with the PLC on a serial line at each usual baud rate.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host-tools/coefficients/load.h"

namespace compbox::coefficients {

struct baud_row {
    std::uint32_t baud;
    // Of the file's blocks, parity and slave delay; both blocks are read by fc3 after a loss.
    double fc3_fc16_ms, fc23_ms, after_loss_ms;
    bool fits;  // the file's exchange and the reading after a loss, within the budget
};

double exchange_budget_ms(const cb_config &config);

// One row for each rate, ascending; none for a PLC that is reached by TCP.
std::vector<baud_row> baud_table(const cb_config &config);

// The same for people, with a mark at the file's own rate; "" for TCP.
std::string baud_table_text(const cb_config &config);

}  // namespace compbox::coefficients
