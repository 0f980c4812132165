// SPDX-License-Identifier: MIT
// The section "sensors": how it loads, and what is refused.
#include <gtest/gtest.h>

#include "tests/support/config_fixture.h"
#include "tests/support/config_invariants.h"

using namespace compbox_test;

namespace {

const std::string three =
    with(R"("scale": 0.1, "zero": -20, "min": -10, "max": 90, "essential": true},)",
         R"("scale": 0.1, "min": -10, "max": 90},
    {"name": "T3", "unit": "degC", "plc": 14, "min": -10, "max": 90},
    {"name": "L3", "unit": "degC", "lag_of": "T3", "tau_s": 60},)");
const std::string section_text =
    R"("sensors": {"signals": ["T1", "T2", "T3"], "center": [20, 21, 22],
    "precision": [[2, -1, -0.5], [-1, 3, -0.75], [-0.5, -0.75, 4]], "threshold": 6}, )";
const std::string whole = with("\"terms\": [", section_text + "\"terms\": [", three);

TEST(config_sensors, arrive_with_their_matrix) {
    const auto got = load(whole);
    ASSERT_EQ(got.error, CB_OK) << got.text;
    EXPECT_EQ(invariants(*got.config).broken, "");
    const cb_config &c = *got.config;
    ASSERT_EQ(c.sensors_count, 3);
    const uint8_t signals[] = {1, 2, 3};
    const float numbers[] = {20, 21, 22, 2, -1, -0.5f, -1, 3, -0.75f, -0.5f, -0.75f, 4};
    for (int i = 0; i < 3; ++i) EXPECT_EQ(c.sensors.signal[i], signals[i]);
    for (int i = 0; i < 12; ++i) EXPECT_EQ(c.pool[c.sensors.pool + i], numbers[i]) << i;
    EXPECT_EQ(c.sensors.after_us, 120000000u);
    EXPECT_EQ(c.sensors.threshold_square, 36.0f);
}

TEST(config_sensors, every_mistake_has_its_sentence) {
    const struct {
        const char *piece, *other, *message;
    } mistakes[] = {
        {R"(["T1", "T2", "T3"])", R"(["T1", "T9", "T3"])",
         "CB_ERROR_NAME sensors.signals[1]: no signal is called \"T9\""},
        {R"(["T1", "T2", "T3"])", R"(["T1", "T2", "T1"])",
         "CB_ERROR_NAME sensors.signals[2]: \"T1\" occurs twice"},
        {R"(["T1", "T2", "T3"])", R"(["T1", "T2"])",
         "CB_ERROR_RANGE sensors.signals: at least three sensors are needed to find one"},
        {R"(["T1", "T2", "T3"])", R"(["T1", "T2", "L3"])",
         "CB_ERROR_RANGE sensors.signals[2]: \"L3\" is a lag or essential; name measured signals "
         "that may go stale"},
        {R"(["T1", "T2", "T3"])", R"(["X", "T2", "T3"])",
         "CB_ERROR_RANGE sensors.signals[0]: \"X\" is a lag or essential; name measured signals "
         "that may go stale"},
        {"[20, 21, 22]", "[20, 21]",
         "CB_ERROR_RANGE sensors.center: 2 numbers for 3 sensors; each needs one"},
        {", [-0.5, -0.75, 4]]", "]",
         "CB_ERROR_RANGE sensors.precision: 2 rows for 3 sensors; each needs one"},
        {"[-1, 3, -0.75]", "[-2, 3, -0.75]",
         "CB_ERROR_RANGE sensors.precision[1][0]: row 1 differs here from column 1, and the matrix "
         "is symmetric"},
        {"[-1, 3, -0.75]", "[-1, 0, -0.75]",
         "CB_ERROR_RANGE sensors.precision[1][1]: on the diagonal a number must be at least 1e-9"},
        {R"("threshold": 6)", R"("threshold": 0.5)",
         "CB_ERROR_RANGE sensors.threshold: 0.5 is outside the range of 1 to 1000000"},
        {R"("threshold": 6)", R"("threshold": 6, "after_s": 4000)",
         "CB_ERROR_RANGE sensors.after_s: 4000 is outside the range of 1 to 3600"},
    };
    for (const auto &[piece, other, message] : mistakes) {
        const auto got = load(with(piece, other, whole));
        EXPECT_EQ(error_name(got.error) + " " + got.text, message) << piece << " -> " << other;
    }
}

}  // namespace
