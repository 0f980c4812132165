// SPDX-License-Identifier: MIT
// The table of units: spellings, factors, names with brackets.
#include "host-tools/formats/units.h"

#include <gtest/gtest.h>

namespace {

using namespace compbox;
using namespace compbox::formats;

TEST(units, spellings_of_one_unit) {
    const std::pair<const char *, const char *> spelled[] = {{"\u00b5m", "um"},
                                                             {"\u03bcm", "um"},
                                                             {"[UM]", "um"},
                                                             {"Micron", "um"},
                                                             {"Zoll", "in"},
                                                             {"in.", "in"},
                                                             {"INCH", "in"},
                                                             {"\u00b5in", "uin"},
                                                             {"mil", "thou"},
                                                             {"\u00b0", "deg"},
                                                             {"arc sec", "arcsec"},
                                                             {"\u2033", "arcsec"},
                                                             {"\u00b5m/m", "um/m"},
                                                             {"\u00b0C", "degC"},
                                                             {"K", "K"},
                                                             {"min\u207b\u00b9", "rpm"},
                                                             {"min", "min"},
                                                             {"m", "m"}};
    for (const auto &[text, name] : spelled) {
        ASSERT_NE(find_unit(text), nullptr) << text;
        EXPECT_STREQ(find_unit(text)->name, name) << text;
    }
    for (const char *text : {"", "V", "div", "%", "mmm", "\""}) EXPECT_EQ(find_unit(text), nullptr);
}

TEST(units, factors) {
    const auto in = [](double value, const char *from, const char *to) {
        return converted(value, *find_unit(from), *find_unit(to));
    };
    EXPECT_DOUBLE_EQ(in(1.0, "in", "mm"), 25.4);
    EXPECT_DOUBLE_EQ(in(1.0, "thou", "um"), 25.4);
    EXPECT_DOUBLE_EQ(in(1.0, "uin", "um"), 0.0254);
    EXPECT_DOUBLE_EQ(in(180.0, "deg", "rad"), 3.14159265358979323846);
    EXPECT_DOUBLE_EQ(in(3600.0, "arcsec", "deg"), 1.0);
    EXPECT_DOUBLE_EQ(in(400.0, "gon", "deg"), 360.0);
    EXPECT_DOUBLE_EQ(in(1.0, "mm/m", "urad"), 1000.0);
    EXPECT_NEAR(in(68.0, "degF", "degC"), 20.0, 1e-12);
    EXPECT_NEAR(in(293.15, "K", "degC"), 20.0, 1e-12);
    EXPECT_EQ(in(0.1, "mm", "mm"), 0.1);
}

TEST(units, a_unit_in_brackets_leaves_the_name) {
    EXPECT_EQ(split_brackets("T1 [\u00b0C]").name, "T1");
    EXPECT_EQ(split_brackets("T1 [\u00b0C]").unit, "\u00b0C");
    EXPECT_EQ(split_brackets("X（mm）").unit, "mm");
    EXPECT_EQ(split_brackets("X_mm").unit, "");
    EXPECT_EQ(split_brackets("[mm]").name, "[mm]");
    EXPECT_EQ(machine_unit("time", *find_unit("min")).name, "time_s");
    EXPECT_EQ(machine_unit("time_s", *find_unit("s")).name, "time_s");
    EXPECT_STREQ(machine_unit("X", *find_unit("in")).in->name, "mm");
    EXPECT_STREQ(machine_unit("e", *find_unit("thou")).in->name, "um");
    EXPECT_EQ(units_of_names({"dx1_um"})("dx1", *find_unit("mm")).name, "dx1_um");
}

TEST(units, letters_lose_their_accents) {
    EXPECT_EQ(plain("R\u00dcCKW\u00c4RTS"), "ruckwarts");
    EXPECT_EQ(plain("\u00c9cart"), "ecart");
}

}  // namespace
