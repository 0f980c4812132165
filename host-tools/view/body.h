// SPDX-License-Identifier: MIT
// Bodies of replies. A slow reader holds its body until it has read it, so all bodies together
// have a limit.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

namespace compbox::view {

using body = std::shared_ptr<const std::string>;

class body_store {
  public:
    explicit body_store(std::size_t most_bytes) : most_bytes_(most_bytes) {}

    // out: the text, counted until its last holder is gone; null: the limit is reached
    body keep(std::string text);

    std::size_t held_bytes() const { return *held_bytes_; }

  private:
    std::size_t most_bytes_;
    std::shared_ptr<std::size_t> held_bytes_ = std::make_shared<std::size_t>(0);
};

}  // namespace compbox::view
