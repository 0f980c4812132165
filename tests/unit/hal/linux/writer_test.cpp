// SPDX-License-Identifier: MIT
// The writer of JSON: what nlohmann's reader makes of it.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

extern "C" {
#include "hal/linux/files/writer.h"
}

namespace {

using nlohmann::json;

std::string with_everything(bool one_line) {
    std::string text(1000, '\0');
    cb_writer writer = cb_writer_begin(text.data(), text.size(), one_line);
    cb_writer_text(&writer, "text", "\"a\" \\ \n µ");
    cb_writer_array(&writer, "empty");
    cb_writer_close(&writer);
    cb_writer_array(&writer, "list");
    cb_writer_whole(&writer, nullptr, std::numeric_limits<int64_t>::min());
    cb_writer_truth(&writer, nullptr, true);
    cb_writer_object(&writer, nullptr);
    cb_writer_number(&writer, "tenth", 0.1f);
    cb_writer_number(&writer, "no number", std::nan(""));
    cb_writer_null(&writer, "nothing");
    cb_writer_close(&writer);
    cb_writer_close(&writer);
    cb_writer_thousandths(&writer, "time_s", 1.0625);
    text.resize(cb_writer_end(&writer));
    return text;
}

TEST(writer, what_is_written_reads_back) {
    const json all = json::parse(with_everything(false));
    EXPECT_EQ(all["text"], "\"a\" \\ \n µ");
    EXPECT_EQ(all["empty"], json::array());
    EXPECT_EQ(all["list"][0], std::numeric_limits<int64_t>::min());
    EXPECT_EQ(all["list"][1], true);
    EXPECT_EQ(all["list"][2]["tenth"].get<float>(), 0.1f);
    EXPECT_TRUE(all["list"][2]["no number"].is_null() && all["list"][2]["nothing"].is_null());
    EXPECT_EQ(all["time_s"], 1.062);
    EXPECT_EQ(json::parse(with_everything(true)), all);
}

TEST(writer, a_line_of_a_log_is_one_line) {
    const std::string line = with_everything(true);
    EXPECT_EQ(line.find('\n'), line.size() - 1);
}

TEST(writer, what_does_not_fit_is_no_object) {
    const size_t bytes = with_everything(false).size();
    for (size_t size = 0; size <= bytes; ++size) {
        std::string text(size + 1, '#');
        cb_writer writer = cb_writer_begin(text.data(), size, false);
        cb_writer_text(&writer, "text", std::string(bytes, 'x').c_str());
        EXPECT_EQ(cb_writer_end(&writer), 0u) << size;
        EXPECT_EQ(text[size], '#') << size;
    }
}

}  // namespace
