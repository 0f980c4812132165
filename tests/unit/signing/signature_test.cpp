// SPDX-License-Identifier: MIT
#include "host-tools/signing/signature.h"

#include <gtest/gtest.h>

#include "host-tools/formats/error.h"

extern "C" {
#include "hal/linux/signature.h"
}

namespace compbox::signing {
namespace {

// A file of minisign -G -W.
const std::string half_of_it =
    "NZapjX2DNVUyIk/gWHPtnflHwu2qYKvWZZ25jOo+yHmI9s9g4vVwlWz8QzAA1NJDqVdPlvKnV5k+YbxPPdaS3+IKlVqZ"
    "L4/4";
const std::string foreign = "untrusted comment: minisign encrypted secret key\nRWQAAEIy" +
                            std::string(64, 'A') + half_of_it + std::string(43, 'A') + "=\n";

std::string refusal(const std::string &text) {
    try {
        secret_key::parse("plant.key", text);
    } catch (const input_error &error) {
        return error.what();
    }
    return "";
}

bool fits(const secret_key &key, const std::string &bytes, const std::string &signature) {
    const std::string text = key.public_text();
    cb_public_key published;
    cb_signature parsed;
    return cb_public_key_parse(&published, text.data(), text.size()) &&
           cb_signature_parse(&parsed, signature.data(), signature.size()) &&
           cb_signature_fits(&parsed, &published, bytes.data(), bytes.size());
}

TEST(signing, what_a_new_key_signs_its_public_half_verifies) {
    const auto key = secret_key::make(), other = secret_key::make();
    for (const std::string &bytes : {std::string(), std::string("a"), std::string(200000, 'b')}) {
        const std::string signature = key.sign(bytes, "machine:lathe 3 revision:12");
        EXPECT_TRUE(fits(key, bytes, signature));
        EXPECT_FALSE(fits(other, bytes, signature));
        EXPECT_FALSE(fits(key, bytes + "c", signature));
        EXPECT_EQ(signature, key.sign(bytes, "machine:lathe 3 revision:12"));
    }
    EXPECT_NE(key.id(), other.id());
    EXPECT_EQ(key.id().size(), 16u);
}

TEST(signing, a_key_goes_through_its_file) {
    const auto key = secret_key::make();
    const auto again = secret_key::parse("plant.key", key.text());
    EXPECT_EQ(again.text(), key.text());
    EXPECT_EQ(again.sign("bytes", "words"), key.sign("bytes", "words"));
    EXPECT_NE(key.public_text().find("key " + key.id() + "\n"), std::string::npos);
}

TEST(signing, takes_a_key_of_minisign) {
    const auto key = secret_key::parse("plant.key", foreign);
    EXPECT_EQ(key.id(), "5535837D8DA99635");
    EXPECT_NE(
        key.public_text().find("\nRWQ1lqmNfYM1VWz8QzAA1NJDqVdPlvKnV5k+YbxPPdaS3+IKlVqZL4/4\n"),
        std::string::npos);
    // but for the first words, minisign's file has the same bytes
    EXPECT_EQ(key.text().substr(key.text().find('\n')), foreign.substr(foreign.find('\n')));
}

TEST(signing, refuses_what_is_no_key) {
    const std::string sentence = "plant.key: is not a secret key; compbox keygen makes one";
    for (std::size_t length = 0; length < foreign.size(); ++length)
        EXPECT_EQ(refusal(foreign.substr(0, length)), sentence);
    EXPECT_EQ(refusal(foreign + "\n"), sentence);
    EXPECT_EQ(refusal(secret_key::make().public_text()), sentence);
    std::string changed = foreign;
    changed[changed.find("RWQAAEIy")] = 'S';
    EXPECT_EQ(refusal(changed), sentence);
}

TEST(signing, refuses_a_key_with_a_password_and_a_damaged_one) {
    std::string text = foreign;
    text.replace(text.find("RWQAAEIy"), 8, "RWRTY0Iy");  // "Sc", scrypt
    EXPECT_EQ(refusal(text),
              "plant.key: is protected by a password; make a key without one by compbox keygen");
    const std::size_t key_at = foreign.find(half_of_it) + 12;  // behind most of the id
    for (std::size_t at = key_at; at < foreign.find(half_of_it) + half_of_it.size(); ++at) {
        text = foreign;
        text[at] = text[at] == 'A' ? 'B' : 'A';
        EXPECT_EQ(refusal(text), "plant.key: is damaged; use the copy of it that you kept") << at;
    }
}

}  // namespace
}  // namespace compbox::signing
