// SPDX-License-Identifier: MIT
// Figures by gnuplot. A figure is written completely or not at all.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace compbox::formats {

// out: a gnuplot data block `$name` of equally long columns; NaN is a gap. Put it before the
// commands that plot '$name'.
std::string plot_data(const std::string &name, const std::vector<std::vector<double>> &columns);

// out: text as a gnuplot string in single quotes, quotes doubled. The terminal is noenhanced, so _
// and ^ of file names are plain characters.
std::string plot_text(const std::string &text);

// Runs gnuplot on `script`, with the terminal chosen by the suffix of `path` (.svg, .png or .pdf),
// a white ground and `width` by `height` pixels. Throws input_error with one sentence when the
// suffix is none of these, gnuplot is not installed, or it refuses the script; then no file is
// left.
void run_gnuplot(const std::string &path, const std::string &script, int width = 1000,
                 int height = 700);

// Likewise: out: the figure as an <svg> element, for a page.
std::string gnuplot_svg(const std::string &script, int width, int height);

// The line colours of every figure: readable in print and by colour-blind eyes.
namespace plot_colour {
inline constexpr const char *curve = "#0b6fb8";
inline constexpr const char *band = "#bcd9ee";
inline constexpr const char *mean = "#111111";
inline constexpr const char *second = "#c8501e";
inline constexpr const char *grey = "#9aa0a6";
// Readings of a direction, paler than the lines `curve` and `second` through them.
inline constexpr const char *forward = "#7fb2dc";
inline constexpr const char *backward = "#e3a184";
}  // namespace plot_colour

}  // namespace compbox::formats
