// SPDX-License-Identifier: MIT
#include "host-tools/view/body.h"

namespace compbox::view {

body body_store::keep(std::string text) {
    const std::size_t bytes = text.capacity();
    if (bytes > most_bytes_ - *held_bytes_) return nullptr;
    *held_bytes_ += bytes;
    return body(new std::string(std::move(text)),
                [held = held_bytes_, bytes](const std::string *one) {
                    *held -= bytes;
                    delete one;
                });
}

}  // namespace compbox::view
