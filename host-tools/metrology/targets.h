// SPDX-License-Identifier: MIT
// Whether targets see periodic errors (ISO 230-2: target positions).
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace compbox::metrology {

// in : strictly ascending targets; period of an error that is to be seen, such as the pitch of a
//      screw; empty: not known
// out: a sentence if an error of this period stays hidden, because the targets meet it at nearly
// one
//      phase; without a period, if the targets are equally spaced. Else "".
std::string hidden_period(const std::vector<double> &target_mm, std::optional<double> period_mm);

}  // namespace compbox::metrology
