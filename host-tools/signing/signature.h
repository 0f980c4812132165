// SPDX-License-Identifier: MIT
// Key pairs and signatures in the format of minisign (hal/linux/signature.h has the other half).
// All cryptography is libsodium's.
#pragma once

#include <cstdint>
#include <string>

namespace compbox::signing {

// A secret key without a password. Its bytes leave memory with it.
class secret_key {
  public:
    // out: a new one, by the system's random numbers
    static secret_key make();
    // in : text of the file of `path`. Throws input_error for any other file, and for a key with a
    // password.
    static secret_key parse(const std::string &path, const std::string &text);
    ~secret_key();
    secret_key(const secret_key &) = default;
    secret_key &operator=(const secret_key &) = delete;

    std::string id() const;           // as minisign prints it
    std::string text() const;         // of its file
    std::string public_text() const;  // of the file of the public key

    // in : comment: one line that is signed too. out: text of the signature. Equal inputs give
    // equal bytes.
    std::string sign(const std::string &bytes, const std::string &comment) const;

  private:
    secret_key() = default;
    std::uint8_t id_[8], key_[64];
};

}  // namespace compbox::signing
