// SPDX-License-Identifier: MIT
#include "host-tools/metrology/temperature.h"

namespace compbox::metrology {

double expansion_um(double from_mm, double to_mm, double expansion_um_per_m_K, double degC) {
    constexpr double m_per_mm = 1e-3;
    return expansion_um_per_m_K * (degC - reference_degC) * (to_mm - from_mm) * m_per_mm;
}

double degC_of_run(const formats::start_and_end &material, std::size_t run, std::size_t runs) {
    const double elapsed = (static_cast<double>(run) + 0.5) / static_cast<double>(runs);
    return material.start + elapsed * (material.end - material.start);
}

void convert_to_20_degC(const std::vector<double> &position_mm, std::vector<double> &error_um,
                        double origin_mm, double expansion_um_per_m_K, double degC) {
    for (std::size_t i = 0; i < position_mm.size(); ++i) {
        error_um[i] -= expansion_um(origin_mm, position_mm[i], expansion_um_per_m_K, degC);
    }
}

}  // namespace compbox::metrology
