// SPDX-License-Identifier: MIT
// The expansion of a warm scale by values worked out by hand.
#include "host-tools/metrology/temperature.h"

#include <gtest/gtest.h>

namespace {

using namespace compbox::metrology;

TEST(temperature, a_metre_of_steel_grows_by_11_5_um_per_kelvin) {
    EXPECT_DOUBLE_EQ(expansion_um(0, 1000, 11.5, 21), 11.5);
    EXPECT_DOUBLE_EQ(expansion_um(-200, 300, 10, 16), -20.0);
    EXPECT_DOUBLE_EQ(expansion_um(0, 1000, 11.5, 20), 0.0);
}

TEST(temperature, a_run_has_the_temperature_of_its_middle) {
    EXPECT_DOUBLE_EQ(degC_of_run({20, 24}, 0, 2), 21.0);
    EXPECT_DOUBLE_EQ(degC_of_run({20, 24}, 1, 2), 23.0);
}

// A scale that is 2 K warm and otherwise right shows its growth from the origin, and nothing at 20
// °C.
TEST(temperature, a_warm_scale_without_errors_has_none_at_20_degrees) {
    const std::vector<double> position{100, 300, 600};
    std::vector<double> error{0.0, 4.6, 11.5};
    convert_to_20_degC(position, error, 100, 11.5, 22);
    for (const double rest : error) EXPECT_NEAR(rest, 0.0, 1e-12);
}

}  // namespace
