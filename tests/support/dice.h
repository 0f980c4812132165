// SPDX-License-Identifier: MIT
// Random numbers with a fixed seed, the same on every machine (no std::uniform_…, whose results
// differ between libraries).
#pragma once

#include <cstdint>
#include <random>

namespace compbox_test {

struct dice {
    explicit dice(uint32_t seed) : engine(seed) {}
    uint32_t operator()() { return static_cast<uint32_t>(engine()); }
    uint32_t operator()(size_t below) { return static_cast<uint32_t>(engine() % below); }
    std::mt19937 engine;
};

}  // namespace compbox_test
