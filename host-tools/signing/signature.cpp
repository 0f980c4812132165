// SPDX-License-Identifier: MIT
#include "host-tools/signing/signature.h"

#include <sodium.h>

#include <cstring>
#include <stdexcept>
#include <vector>

#include "host-tools/formats/error.h"

namespace compbox::signing {

namespace {

using bytes = std::vector<std::uint8_t>;

// The file of a secret key: "Ed", its protection (zeros: none), "B2", salt and two limits of the
// password, id, key, check sum. What belongs to a password is zero.
constexpr std::size_t protection_at = 2, checksum_kind_at = 4, id_at = 54, key_at = id_at + 8,
                      secret_bytes = key_at + 64 + 32;
constexpr const char *untrusted = "untrusted comment: ";

void start_sodium() {
    if (sodium_init() < 0) throw std::runtime_error("libsodium does not start");
}

std::string base64(const bytes &data) {
    std::string text(sodium_base64_ENCODED_LEN(data.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
    sodium_bin2base64(text.data(), text.size(), data.data(), data.size(),
                      sodium_base64_VARIANT_ORIGINAL);
    text.pop_back();  // its final zero
    return text;
}

void append(bytes &to, const void *data, std::size_t size) {
    const auto *begin = static_cast<const std::uint8_t *>(data);
    to.insert(to.end(), begin, begin + size);
}

std::string lines(const std::string &comment, const bytes &data) {
    return untrusted + comment + "\n" + base64(data) + "\n";
}

// out: the bytes of the second of two lines; empty if the text is anything else
bytes second_line(const std::string &text) {
    const auto first_end = text.find('\n');
    bytes data(secret_bytes);
    std::size_t length = 0;
    if (text.rfind(untrusted, 0) != 0 || first_end == std::string::npos || text.back() != '\n' ||
        text.size() < first_end + 2)
        return {};
    const int failed = sodium_base642bin(data.data(), data.size(), text.data() + first_end + 1,
                                         text.size() - first_end - 2, nullptr, &length, nullptr,
                                         sodium_base64_VARIANT_ORIGINAL);
    return failed == 0 && length == data.size() ? data : bytes();
}

// out: whether the second half of the key, the public one, belongs to the first
bool is_whole(const std::uint8_t *key) {
    std::uint8_t published[crypto_sign_PUBLICKEYBYTES], secret[crypto_sign_SECRETKEYBYTES];
    crypto_sign_seed_keypair(published, secret, key);
    const bool same = sodium_memcmp(secret, key, sizeof secret) == 0;
    sodium_memzero(secret, sizeof secret);
    return same;
}

}  // namespace

secret_key secret_key::make() {
    start_sodium();
    secret_key made;
    std::uint8_t published[crypto_sign_PUBLICKEYBYTES];
    randombytes_buf(made.id_, sizeof made.id_);
    crypto_sign_keypair(published, made.key_);
    return made;
}

secret_key secret_key::parse(const std::string &path, const std::string &text) {
    start_sodium();
    bytes data = second_line(text);
    if (data.empty() || std::memcmp(data.data(), "Ed", 2) != 0) {
        throw input_error(path, 0, 0, "is not a secret key; compbox keygen makes one");
    }
    if (data[protection_at] != 0 || data[protection_at + 1] != 0) {
        throw input_error(path, 0, 0,
                          "is protected by a password; make a key without one by compbox keygen");
    }
    secret_key parsed;
    std::memcpy(parsed.id_, data.data() + id_at, sizeof parsed.id_);
    std::memcpy(parsed.key_, data.data() + key_at, sizeof parsed.key_);
    sodium_memzero(data.data(), data.size());
    if (!is_whole(parsed.key_)) {
        throw input_error(path, 0, 0, "is damaged; use the copy of it that you kept");
    }
    return parsed;
}

secret_key::~secret_key() {
    sodium_memzero(key_, sizeof key_);
}

std::string secret_key::id() const {
    std::string text;
    for (std::size_t i = sizeof id_; i-- > 0;) text += fmt::format("{:02X}", id_[i]);
    return text;
}

std::string secret_key::text() const {
    bytes data(id_at);
    std::memcpy(data.data(), "Ed", 2);
    std::memcpy(data.data() + checksum_kind_at, "B2", 2);
    append(data, id_, sizeof id_);
    append(data, key_, sizeof key_);
    data.resize(secret_bytes);  // minisign leaves the check sum zero where there is no password
    return lines("compbox secret key " + id(), data);
}

std::string secret_key::public_text() const {
    bytes data;
    append(data, "Ed", 2);
    append(data, id_, sizeof id_);
    append(data, key_ + crypto_sign_SEEDBYTES, crypto_sign_PUBLICKEYBYTES);
    return lines("compbox public key " + id(), data);
}

std::string secret_key::sign(const std::string &content, const std::string &comment) const {
    std::uint8_t hash[64], of_file[crypto_sign_BYTES];
    bytes of_comment(crypto_sign_BYTES), data, over;
    crypto_generichash(hash, sizeof hash, reinterpret_cast<const std::uint8_t *>(content.data()),
                       content.size(), nullptr, 0);
    crypto_sign_detached(of_file, nullptr, hash, sizeof hash, key_);
    append(data, "ED", 2);
    append(data, id_, sizeof id_);
    append(data, of_file, sizeof of_file);
    append(over, of_file, sizeof of_file);
    append(over, comment.data(), comment.size());
    crypto_sign_detached(of_comment.data(), nullptr, over.data(), over.size(), key_);
    return lines("signature by compbox, key " + id(), data) + "trusted comment: " + comment + "\n" +
           base64(of_comment) + "\n";
}

}  // namespace compbox::signing
