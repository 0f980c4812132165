// SPDX-License-Identifier: MIT
// Who signs coefficient files in the world: keys and signatures in minisign's format
// (docs/signing.md), and what is no signature of a file.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "tests/world/dice.h"

namespace compbox::world {

class signing_key {
  public:
    // in : id: two keys may have the same
    signing_key(std::uint64_t seed, const std::string &id);
    // out: the file NAME.pub
    std::string public_text() const;
    // out: the file FILE.minisig; hashed: of the file's hash, as minisign and compbox sign make it
    std::string sign(const std::string &text, bool hashed = true) const;

  private:
    std::string detached(const std::string &bytes) const;

    std::string id_;
    std::array<unsigned char, 32> public_{};
    std::array<unsigned char, 64> secret_{};
};

// The key that the box knows, and others.
class file_signer {
  public:
    explicit file_signer(std::uint64_t seed);
    std::string known_key() const { return known_.public_text(); }
    std::string sign(const std::string &text, dice &chance) const;
    // in : older: a text that was signed before
    // out: what does not vouch for the text; "": there is no signature at all. `words` says which
    std::string no_signature(const std::string &text, const std::string &older, dice &chance,
                             std::string &words) const;

  private:
    signing_key known_, stranger_, namesake_;
};

}  // namespace compbox::world
