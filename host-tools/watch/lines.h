// SPDX-License-Identifier: MIT
// A snapshot of the box (docs/snapshot.md) as lines for a terminal: for a person at the cabinet.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "host-tools/formats/json_type.h"

namespace compbox::watch {

enum class tone { plain, faint, strong, good, warning, bad };

// Part of a line in one tone. The text has no control character.
struct piece {
    std::string text;
    tone in = tone::plain;
};
using line = std::vector<piece>;

struct window {
    std::size_t rows, columns;
};

// in : box: as box_files/snapshot.h accepts it, an object whose lists hold objects with names, or
// null
//      why_not: why it does not run, as a sentence; "": it runs
//      events: the newest lines of docs/events.md, parsed
// out: at most window.rows lines of at most window.columns characters. What matters most comes
//      first: mode and cause, channels, shares of the terms, signals, counters, events. The last
//      line says how many are left out.
std::vector<line> lines_of(const json &box, const std::string &why_not,
                           const std::vector<json> &events, const window &into);

// out: the text of a line, with the terminal's colours if `coloured`
std::string text_of(const line &pieces, bool coloured);

}  // namespace compbox::watch
