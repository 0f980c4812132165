// SPDX-License-Identifier: MIT
#include "tests/world/signing.h"

#include <sodium.h>

#include <vector>

namespace compbox::world {

namespace {

const std::string trusted_comment = "timestamp:1732600000\tfile:coefficients.json";

std::string base64(const std::string &bytes) {
    std::string text(sodium_base64_ENCODED_LEN(bytes.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
    sodium_bin2base64(text.data(), text.size(),
                      reinterpret_cast<const unsigned char *>(bytes.data()), bytes.size(),
                      sodium_base64_VARIANT_ORIGINAL);
    text.pop_back();  // the zero
    return text;
}

const unsigned char *bytes_of(const std::string &text) {
    return reinterpret_cast<const unsigned char *>(text.data());
}

}  // namespace

signing_key::signing_key(std::uint64_t seed, const std::string &id) : id_(id) {
    std::array<unsigned char, crypto_sign_SEEDBYTES> from{};
    for (std::size_t i = 0; i < from.size(); ++i)
        from[i] = static_cast<unsigned char>(seed >> 8 * (i % 8));
    crypto_sign_seed_keypair(public_.data(), secret_.data(), from.data());
}

std::string signing_key::public_text() const {
    const std::string key(public_.begin(), public_.end());
    return "untrusted comment: a key\n" + base64("Ed" + id_ + key) + "\n";
}

std::string signing_key::detached(const std::string &bytes) const {
    std::string made(crypto_sign_BYTES, '\0');
    crypto_sign_detached(reinterpret_cast<unsigned char *>(made.data()), nullptr, bytes_of(bytes),
                         bytes.size(), secret_.data());
    return made;
}

std::string signing_key::sign(const std::string &text, bool hashed) const {
    std::string hash(64, '\0');
    crypto_generichash(reinterpret_cast<unsigned char *>(hash.data()), hash.size(), bytes_of(text),
                       text.size(), nullptr, 0);
    const std::string of_file = detached(hashed ? hash : text);
    return "untrusted comment: a signature\n" + base64((hashed ? "ED" : "Ed") + id_ + of_file) +
           "\ntrusted comment: " + trusted_comment + "\n" +
           base64(detached(of_file + trusted_comment)) + "\n";
}

file_signer::file_signer(std::uint64_t seed)
    : known_(2 * seed, "FACTORY1"),
      stranger_(2 * seed + 1, "STRANGER"),
      namesake_(2 * seed + 1, "FACTORY1") {}

std::string file_signer::sign(const std::string &text, dice &chance) const {
    return known_.sign(text, !chance.one_in(3));
}

std::string file_signer::no_signature(const std::string &text, const std::string &older,
                                      dice &chance, std::string &words) const {
    const std::string good = known_.sign(text);
    switch (chance.below(6)) {
        case 0:
            words = "without a signature";
            return "";
        case 1:
            words = "signed by a stranger";
            return stranger_.sign(text);
        case 2:
            words = "signed by a key of the same id";
            return namesake_.sign(text);
        case 3:
            words = "with the signature of another file";
            return known_.sign(older);
        case 4: {
            words = "with a changed comment in the signature";
            std::string changed = good;
            return changed.replace(changed.find("timestamp:1"), 11, "timestamp:2");
        }
        default:
            words = "with half a signature";
            return good.substr(0, good.size() / 2);
    }
}

}  // namespace compbox::world
