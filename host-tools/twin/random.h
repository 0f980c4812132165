// SPDX-License-Identifier: MIT
// Random numbers that depend on the seed alone, on every platform: xoshiro256** seeded by
// splitmix64, normal deviates by Box-Muller. The std:: distributions differ between libraries.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace compbox::twin {

class random_stream {
  public:
    // One independent stream for each (seed, purpose): another curve or instrument in a twin does
    // not change the existing ones.
    random_stream(std::uint64_t seed, std::string_view purpose);

    std::uint64_t next();
    // Uniform in [0, 1), 53 bits.
    double uniform();
    // Uniform in [-limit, limit).
    double symmetric(double limit);
    // Mean 0, standard deviation 1; |result| < 9.
    double normal();

  private:
    std::array<std::uint64_t, 4> state_;
    double spare_ = 0.0;
    bool has_spare_ = false;
};

}  // namespace compbox::twin
