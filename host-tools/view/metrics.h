// SPDX-License-Identifier: MIT
// The snapshot as metrics for Prometheus and others.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "host-tools/box_files/snapshot.h"
#include "host-tools/uplink/uplink.h"

namespace compbox::view {

// Which text format a scraper gets: OpenMetrics, or the older one of Prometheus if its header
// Accept names that alone.
enum class metrics_format { openmetrics, prometheus };
metrics_format metrics_format_of(const std::string &accept);
std::string metrics_type(metrics_format format);

// in : plant: nothing: without --mqtt; wall clock, s
// out: all metrics; of a box that does not run compbox_up 0 alone
std::string metrics_text(const box_files::snapshot_file &file,
                         const std::optional<uplink::figures> &plant, double unix_s,
                         metrics_format format);

// out: a label's value between its quotes: \ " and line ends escaped
std::string escaped_label(std::string_view value);

}  // namespace compbox::view
