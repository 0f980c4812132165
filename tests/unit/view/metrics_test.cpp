// SPDX-License-Identifier: MIT
#include "host-tools/view/metrics.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "host-tools/view/status_words.h"
#include "tests/support/temporary.h"

using namespace compbox;
using namespace compbox::view;

namespace {

json snapshot() {
    return json::parse(R"({"snapshot":1,"machine":"a \"b\" \\ c\nd","revision":7,"crc":"00ab",
        "version":"1.2","mode":"HOLD","reason":"the PLC's heartbeat does not change",
        "signals":[{"name":"X","unit":"mm","value":12.5,"age_ms":1.5},
                   {"name":"T1","unit":"degC","value":null,"age_ms":null}],
        "terms":[{"name":"EXX","value":-3}],
        "channels":[{"name":"X","demand_um":3,"output_um":2.5,"applied_um":null,"limit_um":300}],
        "counters":{"cycles":5,"Wrong name":1,"holds":2},
        "jitter_us":{"count":9,"sum":1000,"up_to":{"10":3,"100000":8,"-1":5,"x":6}}})");
}

std::string text_of(const json &value, metrics_format format = metrics_format::openmetrics,
                    double later_s = 0.0,
                    const std::optional<uplink::figures> &plant = std::nullopt) {
    const auto path = compbox_test::temporary("snapshot");
    std::ofstream(path) << value.dump();
    box_files::snapshot_file file(path);
    file.poll();
    return metrics_text(file, plant, box_files::unix_now_s() + later_s, format);
}

bool has(const std::string &text, const std::string &line) {
    return ("\n" + text).find("\n" + line + "\n") != std::string::npos;
}

}  // namespace

TEST(view_metrics, labels_are_escaped) {
    EXPECT_EQ(escaped_label("a\\b\"c\nd"), "a\\\\b\\\"c\\nd");
    EXPECT_TRUE(has(text_of(snapshot()),
                    R"(compbox_file_info{revision="7",crc="00ab",version="1.2",machine="a \"b\" )"
                    R"(\\ c\nd"} 1)"));
}

TEST(view_metrics, values_are_those_of_the_snapshot) {
    const std::string text = text_of(snapshot());
    for (const char *line :
         {"compbox_up 1", "compbox_mode 2", "compbox_reason 4",
          "compbox_signal_value{name=\"X\",unit=\"mm\"} 12.5",
          "compbox_signal_age_seconds{name=\"X\"} 0.0015", "compbox_term_value{name=\"EXX\"} -3",
          "compbox_channel_demand_um{name=\"X\"} 3", "compbox_channel_output_um{name=\"X\"} 2.5",
          "compbox_channel_limit_um{name=\"X\"} 300", "# TYPE compbox_cycles counter",
          "compbox_cycles_total 5", "compbox_holds_total 2",
          "compbox_wakeup_seconds_bucket{le=\"1e-05\"} 3",
          "compbox_wakeup_seconds_bucket{le=\"0.1\"} 8",
          "compbox_wakeup_seconds_bucket{le=\"+Inf\"} 9", "compbox_wakeup_seconds_count 9",
          "compbox_wakeup_seconds_sum 0.001"}) {
        EXPECT_TRUE(has(text, line)) << line << "\n" << text;
    }
    for (const char *part : {"T1", "applied_um{", "rong", "exchange", "null", "nan"}) {
        EXPECT_EQ(text.find(part), std::string::npos) << part;
    }
    EXPECT_EQ(text.substr(text.size() - 6), "# EOF\n");
}

TEST(view_metrics, without_a_box_that_runs_there_is_up_0_alone) {
    const char *const down =
        "# TYPE compbox_up gauge\n# HELP compbox_up 1: compboxd runs and its "
        "snapshot is fresh\ncompbox_up 0\n# EOF\n";
    EXPECT_EQ(text_of("broken"), down);
    EXPECT_EQ(text_of(snapshot(), metrics_format::openmetrics, 60.0), down);
    json ended = snapshot();
    ended["finished"] = true;
    EXPECT_EQ(text_of(ended), down);
}

TEST(view_metrics, the_older_format_has_the_same_samples_and_no_end) {
    const std::string text = text_of(snapshot(), metrics_format::prometheus);
    EXPECT_TRUE(has(text, "# TYPE compbox_cycles_total counter"));
    EXPECT_TRUE(has(text, "compbox_cycles_total 5"));
    EXPECT_TRUE(has(text, "# TYPE compbox_file_info gauge"));
    EXPECT_EQ(text.find("# EOF"), std::string::npos);
}

TEST(view_metrics, the_scraper_chooses_the_format) {
    EXPECT_EQ(metrics_format_of(""), metrics_format::openmetrics);
    EXPECT_EQ(metrics_format_of("*/*"), metrics_format::openmetrics);
    EXPECT_EQ(metrics_format_of("text/plain"), metrics_format::prometheus);
    EXPECT_EQ(metrics_format_of("application/openmetrics-text;version=1.0.0,text/plain;q=0.5"),
              metrics_format::openmetrics);
}

TEST(view_metrics, words_of_a_later_version_have_no_number) {
    json later = snapshot();
    later["mode"] = "DANCING";
    const std::string text = text_of(later);
    EXPECT_EQ(text.find("\ncompbox_mode "), std::string::npos);
    EXPECT_TRUE(has(text, "compbox_reason 4"));
    EXPECT_EQ(mode_word(4), "FAULT");
    EXPECT_EQ(mode_word(77), "");
    EXPECT_EQ(reason_word(-1), "");
    EXPECT_LT(mode_severity(1), mode_severity(2));
    EXPECT_LT(mode_severity(77), mode_severity(1));
}

TEST(view_metrics, figures_of_mqtt_are_there_with_mqtt_alone) {
    EXPECT_EQ(text_of(snapshot()).find("compbox_mqtt"), std::string::npos);
    const uplink::figures plant = {false, 3, 40, 5000, 6000000000, 7};
    for (const double later_s : {0.0, 60.0}) {  // also without a box
        const std::string text = text_of(snapshot(), metrics_format::openmetrics, later_s, plant);
        for (const char *line :
             {"compbox_mqtt_connected 0", "compbox_mqtt_connections_total 3",
              "compbox_mqtt_waiting_messages 40", "compbox_mqtt_waiting_bytes 5000",
              "compbox_mqtt_messages_total 6000000000", "compbox_mqtt_lost_messages_total 7"}) {
            EXPECT_TRUE(has(text, line)) << line;
        }
    }
}
