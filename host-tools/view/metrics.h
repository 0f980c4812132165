// SPDX-License-Identifier: MIT
// The snapshot as metrics for Prometheus and others.
#pragma once

#include <string>
#include <string_view>

#include "host-tools/box_files/snapshot.h"

namespace compbox::view {

// Which text format a scraper gets: OpenMetrics, or the older one of Prometheus if its header
// Accept names that alone.
enum class metrics_format { openmetrics, prometheus };
metrics_format metrics_format_of(const std::string &accept);
std::string metrics_type(metrics_format format);

// out: all metrics; without a box that runs compbox_up 0 alone. in : wall clock, s
std::string metrics_text(const box_files::snapshot_file &file, double unix_s,
                         metrics_format format);

// out: a label's value between its quotes: \ " and line ends escaped
std::string escaped_label(std::string_view value);

}  // namespace compbox::view
