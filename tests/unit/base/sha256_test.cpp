// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <string>

extern "C" {
#include "firmware/base/sha256.h"
}

namespace {

std::string sha256(const std::string &text) {
    uint8_t digest[CB_SHA256_BYTES];
    cb_sha256(text.data(), text.size(), digest);
    std::string printed;
    for (const uint8_t byte : digest) {
        printed += "0123456789abcdef"[byte >> 4];
        printed += "0123456789abcdef"[byte & 15];
    }
    return printed;
}

// Values of NIST's examples for FIPS 180-4, and of `python3 -c "import hashlib; …"`.
TEST(sha256, known_values) {
    EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    EXPECT_EQ(sha256(std::string(1000000, 'a')),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

// The length has its place behind 55 bytes of the last block, and needs another one behind more.
TEST(sha256, every_length_around_a_block) {
    std::string all;
    for (std::size_t length = 0; length <= 200; ++length) {
        all += sha256(std::string(length, static_cast<char>(length)));
    }
    EXPECT_EQ(sha256(all), "32bf3dfd680d6eec35c7e7faa2afb75b13290ffd987b0a324736d2d0bc1bcf13");
}

}  // namespace
