// SPDX-License-Identifier: MIT
// Options, sub-commands and checks of the command line.
#include "host-tools/command_line/command_line.h"

#include <gtest/gtest.h>

#include <sstream>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/progress.h"

namespace compbox::cli {
namespace {

enum class colour { red, green };

// One command with an option of each kind; `run` says that its callback was called.
struct fixture {
    std::ostringstream out, err;
    cli::program program{"tool: for tests", {-1, out, err}};
    cli::command measure = program.add_subcommand("measure", "Measures");
    std::string file, output = "out.csv";
    int count = 3;
    unsigned revision = 0;
    std::size_t points = 0;
    double step_mm = 0.5;
    std::optional<double> limit;
    std::optional<unsigned> unit;
    std::optional<std::uint64_t> seed;
    std::vector<double> vector;
    std::vector<std::string> names;
    colour paint = colour::red;
    bool as_json = false, add_back = true, run = false;

    fixture() {
        program.set_version_flag("--version", "tool 7");
        program.set_help_all_flag("--help-all", "Help of every command");
        program.require_subcommand();
        measure.footer("Example: tool measure a.csv");
        measure.add_option("file", file, "What to read").required();
        measure.add_option("-o,--output F.csv", output, "What to write").capture_default_str();
        const auto counted =
            measure.add_option("--count", count, "How many").check(whole_between(1, 9));
        measure.add_option("--revision", revision).excludes(counted);
        measure.add_option("--points", points);
        measure.add_option("--step-mm S", step_mm, "Step").check(above_zero());
        measure.add_option("--limit", limit);
        measure.add_option("--unit N", unit).check(whole_between(1, 247));
        measure.add_option("--seed", seed).needs(counted);
        measure.add_option("--vector", vector).expected(3).delimiter(',').check(any_number());
        measure.add_option("--names", names);
        const std::map<std::string, colour> colours = {{"red", colour::red},
                                                       {"green", colour::green}};
        measure.add_choice("--paint C", paint, colours, "Colour");
        measure.add_flag("--json", as_json, "As JSON");
        measure.add_flag("!--keep", add_back, "Keep");
        measure.callback([this](const cli::streams &io) {
            run = true;
            if (file == "bad") throw cli::usage_error("--count", "is not for this file");
            io.out << file;
            io.err << output;
        });
    }
    // What is wrong with the words; "" for nothing.
    std::string refusal(std::vector<std::string> words) {
        words.insert(words.begin(), "measure");
        try {
            program.parse(std::move(words));
        } catch (const cli::usage_error &error) {
            return error.what();
        }
        return "";
    }
};

std::string refusal(const std::vector<std::string> &words) {
    return fixture().refusal(words);
}

TEST(CommandLine, SetsVariablesOfEveryKind) {
    fixture all;
    ASSERT_EQ(all.refusal({"a.csv",
                           "-o",
                           "b.csv",
                           "--count",
                           "4",
                           "--points=12",
                           "--step-mm",
                           "0.25",
                           "--limit=-1.5",
                           "--unit",
                           "3",
                           "--seed",
                           "18446744073709551615",
                           "--vector=1,-2,3",
                           "--names",
                           "p",
                           "q",
                           "--paint",
                           "green",
                           "--json",
                           "--keep"}),
              "");
    EXPECT_TRUE(all.run && all.as_json && !all.add_back);
    EXPECT_EQ(all.file + all.output, "a.csvb.csv");
    EXPECT_EQ(all.count, 4);
    EXPECT_EQ(all.points, 12u);
    EXPECT_EQ(all.step_mm, 0.25);
    EXPECT_EQ(all.limit, -1.5);
    EXPECT_EQ(all.unit, 3u);
    EXPECT_EQ(all.seed, 18446744073709551615u);
    EXPECT_EQ(all.vector, (std::vector<double>{1, -2, 3}));
    EXPECT_EQ(all.names, (std::vector<std::string>{"p", "q"}));
    EXPECT_EQ(all.paint, colour::green);
}

TEST(CommandLine, LeavesWhatIsNotGiven) {
    fixture all;
    ASSERT_EQ(all.refusal({"a.csv", "--revision", "4294967295"}), "");
    EXPECT_EQ(all.revision, 4294967295u);
    EXPECT_EQ(all.output, "out.csv");
    EXPECT_EQ(all.count, 3);
    EXPECT_FALSE(all.limit || all.unit || all.seed || all.as_json);
    EXPECT_TRUE(all.add_back);
    EXPECT_EQ(all.paint, colour::red);
}

TEST(CommandLine, NamesWhatIsWrong) {
    EXPECT_EQ(refusal({}), "file is missing");
    EXPECT_EQ(refusal({"a", "--bogus"}), "unknown argument --bogus");
    EXPECT_EQ(refusal({"a", "--count"}), "--count needs 1 value");
    EXPECT_EQ(refusal({"a", "--paint"}), "--paint needs 1 value");
    EXPECT_EQ(refusal({"a", "--limit", "x"}), "not a number: --limit = x");
    EXPECT_EQ(refusal({"a", "--vector", "1,2"}), "--vector needs 3 values, not 2");
    EXPECT_EQ(refusal({"a", "--seed", "1"}), "--seed needs --count");
    EXPECT_EQ(refusal({"a", "--count", "1", "--revision", "1"}),
              "--count cannot be combined with --revision");
    EXPECT_EQ(refusal({"a", "--paint", "blue"}), "--paint: must be one of green, red, not blue");
    EXPECT_EQ(refusal({"a", "--unit", "0"}), "--unit: must be a whole number from 1 to 247, not 0");
    EXPECT_EQ(refusal({"bad"}), "--count: is not for this file");
}

TEST(CommandLine, DoesNotRunWhatIsWrong) {
    fixture all;
    ASSERT_NE(all.refusal({"a.csv", "--count", "0"}), "");
    EXPECT_FALSE(all.run);
}

TEST(CommandLine, ChecksSayWhatMustBe) {
    EXPECT_EQ(whole_between(1, 9)("9"), "");
    EXPECT_EQ(whole_between(1, 9)("1.5"), "must be a whole number from 1 to 9, not 1.5");
    EXPECT_EQ(above_zero()("+1e-3"), "");
    EXPECT_EQ(above_zero()("0"), "must be above 0, not 0");
    EXPECT_EQ(above_zero()("nan"), "'nan' is not a finite number");
    EXPECT_EQ(one_of({"X", "Y"})("Y"), "");
    EXPECT_EQ(one_of({"X", "Y"})("Z"), "must be one of X, Y, not Z");
    EXPECT_EQ(between(0, 1e6)("-1"), "must be from 0 to 1000000, not -1");
}

// What a program called so prints, and its exit code; -1: it goes on.
struct printed {
    std::string out, reported;
    int exit;
};
printed call(std::vector<const char *> words) {
    fixture all;
    words.insert(words.begin(), "tool");
    const auto end = all.program.parse(static_cast<int>(words.size()), words.data());
    return {all.out.str(), all.err.str(), end.value_or(-1)};
}

TEST(CommandLine, GoesOnWhereAllIsRight) {
    const printed got = call({"measure", "a.csv"});
    EXPECT_EQ(got.exit, -1);
    EXPECT_EQ(got.out, "a.csv");
    EXPECT_EQ(got.reported, "out.csv");
}

TEST(CommandLine, WrongUsageIsExit2AndASentence) {
    const char *const more = "\nRun with --help for more information.\n";
    for (const auto &[file, sentence] :
         {std::pair{"--count=0", "--count: must be a whole number from 1 to 9, not 0"},
          {"bad", "--count: is not for this file"}}) {
        const printed got = call({"measure", file});
        EXPECT_EQ(got.exit, 2);
        EXPECT_EQ(got.out, "");
        EXPECT_EQ(got.reported, std::string("tool: ") + sentence + more);
    }
    EXPECT_EQ(call({}).exit, 2);
}

TEST(CommandLine, HelpShowsDefaultsChecksAndTexts) {
    const printed got = call({"measure", "--help", "--bogus"});
    EXPECT_EQ(got.exit, 0);
    EXPECT_EQ(got.reported, "");
    for (const char *line :
         {"file REQUIRED", "-o,--output F.csv=out.csv", "--step-mm S ", "--paint C", "--keep  ",
          "--unit N ", "Usage: tool measure [OPTIONS] file", "Example: tool measure a.csv"}) {
        EXPECT_NE(got.out.find(line), std::string::npos) << line << "\n" << got.out;
    }
    EXPECT_NE(call({"--help-all"}).out.find("--step-mm S"), std::string::npos);
    EXPECT_EQ(call({"--help"}).out.find("--step-mm S"), std::string::npos);
}

TEST(CommandLine, PrintsItsVersion) {
    const printed got = call({"--version"});
    EXPECT_EQ(got.out, "tool 7\n");
    EXPECT_EQ(got.exit, 0);
}

TEST(CommandLine, KnowsItsCommands) {
    const fixture all;
    EXPECT_TRUE(all.program.has_subcommand("measure"));
    EXPECT_FALSE(all.program.has_subcommand("fly"));
}

TEST(CommandLine, ShowsProgressOnATerminalOnly) {
    std::ostringstream out, err;
    EXPECT_FALSE(progress_of({-1, out, err}, "runs"));
    EXPECT_FALSE(progress_bar_of({-1, out, err}, "training", "loss"));
    progress_of({-1, out, err, true}, "runs")(0.5);
    progress_bar_of({-1, out, err, true}, "training", "loss")(0.5, 2.0);
    EXPECT_EQ(err.str(),
              "\rruns 50 %\rtraining [###############...............]  50 %  loss 2\033[K");
    EXPECT_EQ(out.str(), "");
}

TEST(CommandLine, OutputsMustDiffer) {
    EXPECT_NO_THROW(different_files({{"-o", "a"}, {"--plot", "b"}, {"--band", ""}, {"--log", ""}}));
    EXPECT_THROW(different_files({{"-o", "a"}, {"--plot", "a"}}), cli::usage_error);
}

}  // namespace
}  // namespace compbox::cli
