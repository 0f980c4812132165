// SPDX-License-Identifier: MIT
// Values as lines for a person, and their changes with time.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "host-tools/plc/items.h"

namespace compbox::plc {

// One line for each item: address, name, value, registers in hexadecimal.
void print_items(std::ostream &out, const std::vector<item> &items, const words_at &words);

struct watch_options {
    int every_ms = 200;
    int count = 0;  // number of readings; 0: until SIGINT or SIGTERM
    bool as_json = false;
};

// Reads the items again and again. Prints all of them at first, then each that changed, with the
// time; with as_json one JSON object for each line. After the first reading a lost server is
// reported once to err, and connected again.
// out: whether the last reading succeeded. Throws input_error if the first one fails.
bool watch(const wire &to, const std::vector<item> &items, const watch_options &options,
           std::ostream &out, std::ostream &err);

}  // namespace compbox::plc
