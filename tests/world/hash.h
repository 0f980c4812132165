// SPDX-License-Identifier: MIT
// One number for everything that a run sent, wrote and logged: FNV-1a, 64 bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace compbox::world {

class run_hash {
  public:
    void add(const void *bytes, std::size_t count) {
        const auto *at = static_cast<const unsigned char *>(bytes);
        for (std::size_t i = 0; i < count; ++i) value_ = (value_ ^ at[i]) * 0x100000001b3u;
    }
    void add(std::string_view text) { add(text.data(), text.size()); }
    void add(std::int64_t number) { add(&number, sizeof number); }
    std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace compbox::world
