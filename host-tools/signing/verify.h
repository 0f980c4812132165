// SPDX-License-Identifier: MIT
// Who signed a coefficient file, judged by the code of compboxd.
#pragma once

#include <string>

namespace compbox::signing {

extern const std::string suffix;  // of the signature beside a file

// in : the file and its bytes, folder of public keys. out: path of the key that signed it. Throws
// input_error with the daemon's sentence, or if the folder has no key.
std::string signer_of(const std::string &path, const std::string &bytes, const std::string &keys);

}  // namespace compbox::signing
