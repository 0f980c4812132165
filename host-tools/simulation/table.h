// SPDX-License-Identifier: MIT
// Rows and numbers of the tables and reports of a simulation.
#pragma once

#include <fmt/core.h>

#include <functional>
#include <optional>
#include <string>

#include "host-tools/formats/json_type.h"
#include "host-tools/simulation/figures.h"

namespace compbox::simulation::table {

constexpr const char *heading = "before   after     less";

std::string percent(double value);

// The text or number of a direction, 0 to 2 for X to Z.
using cell = std::function<std::string(std::size_t)>;
using number = std::function<double(std::size_t)>;

// out: one line with a column for each letter of `directions`
std::string row(const std::string &name, const std::string &directions, const cell &text_of);
std::string headings(const std::string &directions);
std::string percent_row(const std::string &name, const std::string &directions,
                        const number &value);

// For report.json: four decimals; an object by the letters of `directions`.
double rounded(double value);
json by_axis(const std::string &directions, const number &value);
// [low, high] by letter; null: no interval is known.
json intervals_by_axis(const std::string &directions,
                       const std::function<std::optional<interval>(std::size_t)> &of);

}  // namespace compbox::simulation::table
