// SPDX-License-Identifier: MIT
// Factors between units, for several parts of the machine.
#pragma once

namespace compbox::twin {

constexpr double m_per_mm = 1e-3;
constexpr double um_per_mm = 1e3;
constexpr double s_per_min = 60.0;
constexpr double s_per_h = 3600.0;
constexpr double s_per_day = 86400.0;
constexpr double pi = 3.14159265358979323846;
constexpr double two_pi = 6.28318530717958647692;  // rad in a turn

}  // namespace compbox::twin
