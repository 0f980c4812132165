// SPDX-License-Identifier: MIT
// Conformity with limits by the decision rule of ISO 14253-1.
#include "host-tools/test_report/conformity.h"

#include <gtest/gtest.h>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/test_report/page.h"

namespace {

using namespace compbox;
using namespace compbox::test_report;

TEST(conformity, uncertainty_counts_against_whoever_proves) {
    EXPECT_EQ(judged(8.0, 10.0, 2.0), verdict::conforms);
    EXPECT_EQ(judged(8.1, 10.0, 2.0), verdict::undecided);
    EXPECT_EQ(judged(12.0, 10.0, 2.0), verdict::undecided);
    EXPECT_EQ(judged(12.1, 10.0, 2.0), verdict::does_not);
}

TEST(conformity, without_uncertainty_the_value_is_compared) {
    EXPECT_EQ(judged(10.0, 10.0, {}), verdict::conforms);
    EXPECT_EQ(judged(10.1, 10.0, {}), verdict::does_not);
}

TEST(conformity, the_worst_verdict_counts_for_all) {
    const json figures = {{"file", "d.csv"}, {"positioning", {{"A", 8.0}, {"E", 5.0}, {"R", 3.0}}}};
    const auto whole = [&](const by_figure &limits) {
        return conformity_of(figures, limits, {{"A", 1.0}})["verdict"];
    };
    EXPECT_EQ(whole({{"A", 10.0}, {"E", 5.0}}), "conforms");
    EXPECT_EQ(whole({{"A", 8.5}, {"E", 5.0}}), "undecided");
    EXPECT_EQ(whole({{"A", 8.5}, {"E", 4.0}}), "does not conform");
}

TEST(conformity, a_figure_that_is_not_there_is_refused) {
    const json figures = {{"file", "d.csv"}, {"positioning", {{"A", nullptr}}}};
    for (const char *key : {"A", "B", "A+", "Q"}) {
        EXPECT_THROW(conformity_of(figures, {{key, 1.0}}, {}), input_error) << key;
    }
    EXPECT_THROW(conformity_of(figures, {}, {{"Q", 1.0}}), input_error);
}

TEST(particulars, a_name_is_an_error_of_iso_230_1) {
    EXPECT_EQ(iso_name("EZX.csv"), "EZX");
    EXPECT_EQ(iso_name("EXX 3. Lauf"), "EXX");
    for (const char *text : {"", "EX", "EXXL.csv", "EDX", "report.csv"}) {
        EXPECT_EQ(iso_name(text), "") << text;
    }
}

TEST(particulars, what_is_stated_outweighs_the_files) {
    fitting::measurement data;
    data.file = "/data/EZX_after.rtl";
    data.about.machine = "of the file";
    data.about.by = "Müller";
    particulars stated;
    stated.machine = "of the option";
    const particulars about = completed(stated, {data});
    EXPECT_EQ(about.machine, "of the option");
    EXPECT_EQ(about.by, "Müller");
    EXPECT_EQ(about.name, "EZX");
    EXPECT_EQ(about.axis, "X");
    EXPECT_EQ(heading_of(about, "um"), "EZX: Straightness of axis X in Z, of the option");
    EXPECT_EQ(heading_of(about, "urad"), "EZX: Angular error of axis X about Z, of the option");
}

}  // namespace
