// SPDX-License-Identifier: MIT
// The box's own loader, for the host tools: the same code that runs on every target.
#pragma once

#include <memory>
#include <string>
#include <vector>

extern "C" {
#include "firmware/load/load.h"
}

namespace compbox::coefficients {

// Abilities of the box that is to run a file: those of any, and of the microcontroller, equal to
// the target of hal/stm32f405/app/load.c.
extern const cb_target any_target, stm32f405_target;

// out: the file's configuration. Throws input_error with the loader's message: "FILE:
// terms[3].knots[7]: sentence, line L, column C". text: set to the file's text, if not null.
std::unique_ptr<cb_config> load_coefficients(const std::string &path, std::string *text = nullptr,
                                             const cb_target &target = any_target);

// The same for text that is not in a file yet; the message has neither file nor place.
// Returns null and fills in *message where the box would refuse it.
std::unique_ptr<cb_config> load_coefficient_text(const std::string &text, cb_message *message,
                                                 const cb_target &target = any_target);

// "3 signals, 6 terms, 3 channels, coefficients 512 of 8192".
std::string summary(const cb_config &config);

// A part of the box's memory that files fill. It is the same on every target.
struct memory_share {
    std::string name;
    unsigned used, most;
};
std::vector<memory_share> memory_of(const cb_config &config, std::size_t text_bytes);

// "the STM32F405 holds it: text 5120 of 131040 bytes, …"
std::string memory_text(const cb_target &target, const std::vector<memory_share> &memory);

}  // namespace compbox::coefficients
