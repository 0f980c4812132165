// SPDX-License-Identifier: MIT
// A box for a rig from the text of a coefficient file, read by the box's own loader.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/support/box_fixture.h"
#include "tests/support/config_fixture.h"

namespace compbox {

inline config_builder from_text(const std::string &text) {
    config_builder b;
    const auto got = compbox_test::load(text);
    EXPECT_EQ(got.error, CB_OK) << got.text << ", line " << got.line;
    *b.config = *got.config;
    return b;
}

}  // namespace compbox
