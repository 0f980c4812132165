// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <array>
#include <random>

extern "C" {
#include "firmware/base/memory_check.h"
}

namespace {

constexpr uint32_t size = 64;
using memory = std::array<uint32_t, size>;

memory some_memory() {
    memory words{};
    std::mt19937 random(1);
    for (unsigned i = 0; i < 40; ++i)
        words[i] = static_cast<uint32_t>(random());  // the rest zeros, as in a pool
    return words;
}

uint32_t sum(const memory &words) {
    return cb_memory_check(0, words.data(), size);
}

TEST(memory_check, pieces_give_the_same_as_the_whole) {
    const memory words = some_memory();
    for (uint32_t cut = 0; cut <= size; ++cut) {
        const uint32_t first = cb_memory_check(0, words.data(), cut);
        EXPECT_EQ(cb_memory_check(first, words.data() + cut, size - cut), sum(words));
    }
}

TEST(memory_check, every_single_bit_counts) {
    memory words = some_memory();
    const uint32_t good = sum(words);
    for (unsigned bit = 0; bit < 32 * size; ++bit) {
        words[bit / 32] ^= 1u << bit % 32;
        EXPECT_NE(sum(words), good) << bit;
        words[bit / 32] ^= 1u << bit % 32;
    }
}

TEST(memory_check, every_two_bits_of_neighbours_count) {
    memory words = some_memory();
    const uint32_t good = sum(words);
    for (unsigned word = 0; word + 1 < size; ++word) {
        for (unsigned pair = 0; pair < 1024; ++pair) {
            const uint32_t a = 1u << pair % 32, b = 1u << pair / 32;
            words[word] ^= a;
            words[word + 1] ^= b;
            EXPECT_NE(sum(words), good) << word << ' ' << pair;
            words[word] ^= a;
            words[word + 1] ^= b;
        }
    }
}

TEST(memory_check, exchanged_words_and_stray_writes_count) {
    std::mt19937 random(2);
    const memory words = some_memory();
    for (int i = 0; i < 10000; ++i) {
        memory other = words;
        const auto a = static_cast<unsigned>(random() % 40),
                   b = static_cast<unsigned>(random() % 40);
        if (i % 2)
            std::swap(other[a], other[b]);
        else
            std::fill_n(other.begin() + a, 1 + b % 4, static_cast<uint32_t>(random()));
        EXPECT_EQ(sum(other) == sum(words), other == words) << i;
    }
}

}  // namespace
