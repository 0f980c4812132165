// SPDX-License-Identifier: MIT
#include "host-tools/twin/random.h"

#include <cmath>

#include "host-tools/twin/units.h"

namespace compbox::twin {

namespace {

std::uint64_t splitmix64(std::uint64_t &state) {
    state += 0x9E3779B97F4A7C15u;
    std::uint64_t z = state;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

// FNV-1a of a name.
std::uint64_t hash(std::string_view text) {
    std::uint64_t h = 0xCBF29CE484222325u;
    for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001B3u;
    return h;
}

std::uint64_t rotate_left(std::uint64_t x, int bits) {
    return (x << bits) | (x >> (64 - bits));
}

}  // namespace

random_stream::random_stream(std::uint64_t seed, std::string_view purpose) {
    std::uint64_t mixed = splitmix64(seed) ^ hash(purpose);
    for (auto &word : state_) word = splitmix64(mixed);
}

std::uint64_t random_stream::next() {
    const std::uint64_t result = rotate_left(state_[1] * 5, 7) * 9;
    const std::uint64_t shifted = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = rotate_left(state_[3], 45);
    return result;
}

double random_stream::uniform() {
    return static_cast<double>(next() >> 11) * 0x1p-53;
}

double random_stream::symmetric(double limit) {
    return limit * (2.0 * uniform() - 1.0);
}

double random_stream::normal() {
    if (has_spare_) {
        has_spare_ = false;
        return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    const double angle = two_pi * uniform();
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
}

}  // namespace compbox::twin
