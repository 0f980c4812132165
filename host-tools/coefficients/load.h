// SPDX-License-Identifier: MIT
// The box's own loader, for the host tools: the same code that runs on every target.
#pragma once

#include <memory>
#include <string>

extern "C" {
#include "firmware/load/load.h"
}

namespace compbox::coefficients {

// out: the file's configuration. Throws input_error with the loader's message: "FILE:
// terms[3].knots[7]: sentence, line L, column C". text: set to the file's text, if not null.
std::unique_ptr<cb_config> load_coefficients(const std::string &path, std::string *text = nullptr);

// The same for text that is not in a file yet; the message has neither file nor place.
// Returns null and fills in *message where the box would refuse it.
std::unique_ptr<cb_config> load_coefficient_text(const std::string &text, cb_message *message);

// "3 signals, 6 terms, 3 channels, coefficients 512 of 8192".
std::string summary(const cb_config &config);

}  // namespace compbox::coefficients
